"""Energy of robots: batteries and chargers."""
