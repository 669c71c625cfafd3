"""Training of the player that comes with foosim: a shot is defended."""
