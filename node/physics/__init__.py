"""The engines: their interface, their building, the bodies of each."""
