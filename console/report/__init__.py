"""The report of a capture: one page with charts and map, made of the page's modules."""
