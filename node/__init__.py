"""A simulation node: computes its share of every tick, core in core.py, shell in main.py."""
