"""Robots that move by kinematics or on wheels, the hall, batteries."""
