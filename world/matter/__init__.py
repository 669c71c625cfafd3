"""Matter of things: radio materials, surfaces in contacts, triangles."""
