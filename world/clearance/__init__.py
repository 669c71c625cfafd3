"""What is in the way of what: obstacles seen from above, places at the start, room around moving parts."""
