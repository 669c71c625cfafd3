"""The virtual hub: decides each packet's fate, closes ticks and writes the capture."""
