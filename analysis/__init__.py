"""What a capture says: explanations of packets, comparison of captures, tables, exports."""
