"""Physics engines by name. Each is imported when it is chosen: a run on the pure engine needs no pybullet.

Another engine is one file with a class that has `interface.Engine`'s methods, and one line here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from foosim.node.engines.interface import Engine, EngineFactory
from foosim.protocol.deployment import Deployment
from foosim.protocol.layout import Layout


def _bullet(deployment: Deployment, layout: Layout) -> Engine:
    from foosim.node.engines.bullet import BulletEngine

    return BulletEngine(deployment, layout)


def _pure(deployment: Deployment, layout: Layout) -> Engine:
    from foosim.node.engines.pure import PureEngine

    return PureEngine(deployment, layout)


ENGINES: Final[Mapping[str, EngineFactory]] = {"bullet": _bullet, "pure": _pure}
