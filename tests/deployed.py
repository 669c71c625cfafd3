"""The deployments of the repository, and the table as it is deployed or with other settings."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.world.layout import build_layout

DEPLOY: Final = Path(__file__).parents[1] / "deploy"
TABLE: Final = DEPLOY / "table.yaml"
TEXT: Final = TABLE.read_text()


def deployed(*sets: str) -> Deployment:
    """Return the table with settings."""
    return load_deployment(apply_sets(TEXT, TABLE.name, sets), TABLE.name)


DEPLOYMENT: Final = load_deployment(TEXT, TABLE.name)
LAYOUT: Final = build_layout(DEPLOYMENT)
