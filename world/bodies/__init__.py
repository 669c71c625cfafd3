"""Parts of bodies: masses and inertias, convex hulls, and robots from URDF files."""
