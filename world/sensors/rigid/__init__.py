"""Sensors of rigid bodies: touches and grasps."""
