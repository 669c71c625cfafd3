"""Environments of the football table for learning: their rewards, and their arguments by id."""
