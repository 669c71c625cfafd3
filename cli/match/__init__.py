"""The command `foosim-match`."""
