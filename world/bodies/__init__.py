"""What bodies are made of: masses and inertias, convex hulls, and robots that are described by a URDF file."""
