"""Where rays and places meet the shapes of a world: one geometry for sensors, motions and lines of sight."""
