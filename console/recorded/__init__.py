"""What is recorded as a source of the page: captures, replays, recorded poses, on one clock."""
