"""The vHub's state as values with snapshot and restore, and how it is restored from its journal."""
