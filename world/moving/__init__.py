"""What motions have in common: upright bodies, wheels, arcs, paths, and the numbers of many entities at once."""
