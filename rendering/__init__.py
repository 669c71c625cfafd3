"""Pictures of a world, drawn from a camera's optics and the poses of what moves: bits do not depend on the machine."""
