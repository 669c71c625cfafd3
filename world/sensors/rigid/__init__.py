"""Sensors of rigid bodies: what they touch and hold."""
