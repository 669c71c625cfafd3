"""Physics engines behind one interface: Bullet, and a pure twin in Python."""
