"""What kits are made from: the settings of their sections, and what follows from these alone."""
