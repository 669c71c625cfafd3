"""The file format of a capture: rows, parts, reading, cutting, and its MCAP container in `mcap`."""
