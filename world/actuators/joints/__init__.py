"""Actuators of the joints of a robot."""
