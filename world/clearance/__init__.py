"""Clearances: obstacles seen from above, places at the start, room around moving parts."""
