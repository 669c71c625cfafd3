"""Parameters of a football table from measured tracks of its ball, and the command that fits them."""
