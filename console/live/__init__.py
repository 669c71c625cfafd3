"""A running system as a source of the page."""
