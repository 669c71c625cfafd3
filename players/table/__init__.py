"""What the players of the football table are made of: the ball's track, rods, shots, devices of people."""
