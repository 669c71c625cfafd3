"""A world built from its forms: its engine-independent computation, its start, the division of its ticks."""
