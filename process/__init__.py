"""A process with several roles: supervisor, vHub, nodes and players on one loop."""
