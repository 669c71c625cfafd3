"""A world built from its components: its engine-independent computation, its start, the division of its ticks."""
