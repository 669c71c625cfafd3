"""Robots as a deployment declares them."""
