"""MCAP as captures use it: the format, the writer, checks, and the scan of an unfinished file."""
