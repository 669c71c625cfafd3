"""What the vHub knows, as values with snapshot and restore, and how it goes on from its journal."""
