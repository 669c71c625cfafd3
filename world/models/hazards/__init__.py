"""Models of hazards to robots: fires, doors."""
