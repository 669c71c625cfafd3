"""Physics engines of the table by name, and the one of a hall. Each is imported when it is chosen: a run on the pure
engine needs no pybullet.

Another engine is one file with a class that has `interface.Engine`'s methods, and one line here.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from typing import Final

from foosim.deployment.schema import Deployment
from foosim.node.engines.interface import Engine, EngineFactory
from foosim.world.layout import Layout


def _bullet(deployment: Deployment, layout: Layout) -> Engine:
    from foosim.node.engines.bullet import BulletEngine

    return BulletEngine(deployment, layout)


def _pure(deployment: Deployment, layout: Layout) -> Engine:
    from foosim.node.engines.analytic import PureEngine

    return PureEngine(deployment, layout)


ENGINES: Final[Mapping[str, EngineFactory]] = {"bullet": _bullet, "pure": _pure}


def make_engine(deployment: Deployment, layout: Layout) -> Engine:
    """Return the engine of a deployment's world, built at once; rovers have their own, whichever is named."""
    if deployment.is_hall:
        from foosim.node.engines.planar import RoverEngine

        return RoverEngine(deployment, layout)
    return ENGINES[deployment.engine](deployment, layout)


SPARES: Final = 2
"""Engines that a node may build before the first one is given back: the next layout's, and the one after that."""


def prepare_spares(deployment: Deployment) -> None:
    """Get ready what would hold up the ticks later, when another engine is built beside them."""
    if deployment.engine == "bullet" and not deployment.is_hall:
        from foosim.node.engines.bullet import connect_spares

        connect_spares(SPARES)


def build_in_steps(deployment: Deployment, layout: Layout) -> Generator[None, None, Engine]:
    """Build the deployment's engine in steps, each short enough to do between two ticks."""
    if deployment.engine == "bullet" and not deployment.is_hall:
        from foosim.node.engines.bullet import BulletEngine

        return (yield from BulletEngine.in_steps(deployment, layout))
    yield
    return make_engine(deployment, layout)
