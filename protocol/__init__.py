"""The agreement between processes: messages, codec, channels, handshake, barrier, access."""
