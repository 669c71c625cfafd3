"""What forms of the world have in common: their registry, their settings, the values that they exchange."""
