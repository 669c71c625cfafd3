"""Random faults against invariants, by seed."""
