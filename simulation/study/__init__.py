"""Studies of a deployment: runs over combinations of its parameters and seeds, and their results as a table."""
