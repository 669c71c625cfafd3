"""A world put together from its forms: what computes it, what it begins with, how its ticks are divided."""
