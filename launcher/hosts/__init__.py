"""The machines of a run: ssh, systemd units, preparation, and whether a port is reached."""
