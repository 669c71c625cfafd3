"""All links of a run, and their summary."""
