"""What things are made of: what their materials do to waves, what their surfaces do to bodies, their triangles."""
