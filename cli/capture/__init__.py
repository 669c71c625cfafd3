"""The verbs of `foosim capture`."""
