"""Controllers as content: players of the football table, the rovers of the warehouse with their base."""

OF_THE_TABLE = {
    "keeper": "foosim.players.football:Keeper",
    "passive": "foosim.players.football:Passive",
    "striker": "foosim.players.football:Striker",
    "team": "foosim.players.football:Team",
}
"""Classes that play football by themselves, by the names that `foosim match` knows."""
