"""Actuators of robots, one file each: from commands and frame to motor commands."""
