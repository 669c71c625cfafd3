"""The parts of the players of the football table: the ball's track, rods, shots, devices of people."""
