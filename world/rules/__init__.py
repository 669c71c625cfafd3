"""What a world does by itself."""
