"""Environments of the football table for what learns: their rewards, and their arguments by id."""
