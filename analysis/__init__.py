"""Analysis of captures: explanations of packets, comparison of captures, tables, exports."""
