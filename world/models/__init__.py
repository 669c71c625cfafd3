"""Models of entities: one file each, which has its settings, its fields, its body, and its registration."""
