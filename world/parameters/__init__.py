"""The parts of kits: the settings of their sections, and what follows from these alone."""
