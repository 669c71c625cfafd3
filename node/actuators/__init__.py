"""Actuators of robots: what a command's bytes mean and what the motors are told.

One file each. To add one: a file with `accept` and `command` like `position`, and its use in `node.step`.
"""
