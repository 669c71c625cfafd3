"""Energy of robots: batteries and what charges them."""
