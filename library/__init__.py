"""The content of worlds, one file for each component type, by the kind of world; and the players."""
