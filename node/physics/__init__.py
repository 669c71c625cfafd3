"""The engines themselves: their interface, what makes them, the bodies of each."""
