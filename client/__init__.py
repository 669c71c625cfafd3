"""Client library: `client.connect` is for programs and interactive use, `player` for controllers that `up` starts."""
