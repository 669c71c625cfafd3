"""Gateways: other programs speak with a run in their own language."""
