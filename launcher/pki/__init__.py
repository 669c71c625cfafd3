"""Makes certificates, and brings them to hosts."""
