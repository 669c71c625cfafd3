"""What component types have in common: their registry, descriptions, settings, and the values that they exchange."""
