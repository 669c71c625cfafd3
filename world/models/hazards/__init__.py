"""Models of what robots have to get along with: fires, doors."""
