"""Client library: `client.connect` is for programs and people, `player` for controllers that `up` starts."""
