"""The time of what a page shows, and two sources on one clock."""
