"""What stands between two antennas."""
