"""Players of the football table."""

OF_THE_TABLE = {
    "keeper": "foosim.library.table.players.football:Keeper",
    "passive": "foosim.library.table.players.football:Passive",
    "striker": "foosim.library.table.players.football:Striker",
    "team": "foosim.library.table.players.football:Team",
}
"""Classes that play football by themselves, by the names that `foosim match` knows."""
