"""Controllers as content: the football teams, and the rovers of the warehouse with their base."""

MOVED = {
    "foosim.client.players": "foosim.players.football",
    "foosim.client.patrol": "foosim.players.warehouse_rover",
    "foosim.client.dispatch": "foosim.players.warehouse_base",
}
"""Modules that deployments of earlier versions name, and where their classes are."""
