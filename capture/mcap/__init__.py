"""MCAP as captures use it: what stands in a file, writing, checks, and repair of a file that was left unfinished."""
