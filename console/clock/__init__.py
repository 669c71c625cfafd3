"""The clock of a page's sources, and the comparison of two."""
