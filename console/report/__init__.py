"""The report of a capture: one page with charts and map, drawn by the page's modules."""
