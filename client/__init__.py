"""What a controller's author imports: connect, robots with their channels, lockstep, players."""
