"""The interface of a physics engine to a node: load, command, step, read.

An engine holds the bodies of one layout and the scenery, and keeps no state: every tick starts with a complete load of
the solved bodies from the frame. Its bodies are the scene's bodies of those entities that are rigid
(`Entity.is_rigid`).

An `IslandEngine` solves bodies of any kind, an island at a time. An `Engine` solves all bodies in one go, and parks
the others: *free* ones are one link each, a sphere; *jointed* ones are chains of two links on a fixed base.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypeAlias, runtime_checkable

from foosim.deployment.schema import Deployment
from foosim.world.components.drives import Drives
from foosim.world.layout import Entity, Layout


class Weld(NamedTuple):
    """A body that a link of another one holds: the places of both among the bodies of an island, and the index of the
    link. The seven numbers of the frame from `grasp` on are the pose of the held body (position of the centre of mass,
    principal axes as a quaternion x, y, z, w) in the frame of the link."""

    holder: int
    link: int
    held: int
    grasp: int


@dataclass(frozen=True, slots=True)
class Island:
    """Bodies that an engine solves together, in name order, the set-points of each, the movers in their way, and the
    welds of held bodies."""

    bodies: tuple[Entity, ...]
    movers: tuple[Entity, ...]
    drives: tuple[Drives, ...]
    welds: tuple[Weld, ...] = ()


@runtime_checkable
class IslandEngine(Protocol):
    """An engine that solves one island after the other, each by itself: for bodies whose joints couple."""

    def solve(self, island: Island, numbers: list[float], start: Sequence[float]) -> None:
        """Write the next state of an island's bodies into `numbers`, which have their present one.

        `start` are the numbers at the start of the tick: movers have the pose and the velocity of these.
        """

    def close(self) -> None:
        """Free the engine's memory and clients. It is not used afterwards."""


class Engine(Protocol):
    """One physics engine with the bodies of `layout`. `state` is always the whole frame's numbers, in layout order."""

    def load(self, entities: Sequence[Entity], state: Sequence[float]) -> None:
        """Wipe the engine's memory and set these entities, where they have a body, to their state; park all others."""

    def command(self, entities: Sequence[Entity], commands: Sequence[Sequence[tuple[float, ...]]]) -> None:
        """Set the motors of these robots: for each joint the target speed and the greatest force (SI units), and maybe
        the slope by which the force falls with the speed (`drives.Motor`)."""

    def step(self, substeps: int) -> None:
        """Advance the loaded bodies by `substeps` substeps and log their contacts."""

    def read(self, entities: Sequence[Entity], state: list[float]) -> None:
        """Write position, velocity and the tick's contact log of these bodies into `state`.

        Also the effort of each joint's motor in the last substep: a force (N) or a torque (N m).
        """

    def close(self) -> None:
        """Free the engine's memory and clients. It is not used afterwards."""


AnyEngine: TypeAlias = Engine | IslandEngine
EngineFactory = Callable[[Deployment, Layout], Engine]
