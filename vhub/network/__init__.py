"""What links remember and share: packets in flight, settings, events, air, jitter."""
