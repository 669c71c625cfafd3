"""The parts of kits: the settings of their sections, and values that follow from these alone."""
