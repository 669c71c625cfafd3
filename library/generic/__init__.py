"""Components for any robot: sensors, modifiers, hazards, wind, zones."""
