"""Controllers as content: the football teams, and the rovers of the warehouse with their base."""
