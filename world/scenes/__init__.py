"""The football table and the warehouse: bodies, scenery and behaviour in a tick."""
