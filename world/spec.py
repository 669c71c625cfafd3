"""The world part of a deployment: what is computed, and nothing of where it is computed or what lies between.

It holds a football table or a hall with mobile robots, the robots, and the scenery.
"""

from collections.abc import Mapping
from fractions import Fraction
from typing import Annotated, Literal, Protocol, Self

from pydantic import Field, PrivateAttr

from foosim.common import limits, units
from foosim.common.spec_base import Name, RobotName, SpecBase
from foosim.common.units import Quantity, period_ticks
from foosim.world.kits.hall import Hall
from foosim.world.kits.table import Table
from foosim.world.mesh import Mesh
from foosim.world.robots.foosball_rod import RodRobot
from foosim.world.robots.overhead_camera import CameraRobot
from foosim.world.robots.rover import RoverRobot, StationRobot
from foosim.world.scene import Shape
from foosim.world.scenery import SCENERY_MAX, AssetFolder, Contents, Scenery, open_meshes, scenery_shape

Robot = Annotated[RodRobot | CameraRobot | RoverRobot | StationRobot, Field(discriminator="model")]


class Timed(Protocol):
    """What happens at a rate."""

    @property
    def rate_hz(self) -> Fraction:
        """How often."""

    @property
    def offset_ns(self) -> int:
        """By how much later than a multiple of the period."""


class WorldSpec(SpecBase):
    """The world: one of `table` and `hall` is given."""

    world: Name
    seed: Annotated[int, Field(ge=0, le=limits.COUNTER_MAX)]
    tick_ns: Annotated[int, Quantity(units.TIME, "0.1 ms", "100 ms")] = Field(alias="tick")
    substeps: Annotated[int, Field(ge=1, le=64)]
    engine: Literal["bullet", "pure"]
    table_: Table | None = Field(default=None, alias="table")
    hall_: Hall | None = Field(default=None, alias="hall")
    assets: AssetFolder = "."
    scenery: dict[Name, Scenery] = Field(default={}, max_length=SCENERY_MAX)
    robots: dict[RobotName, Robot] = Field(min_length=1, max_length=limits.ENTITIES_MAX)
    _contents: Contents = PrivateAttr(default_factory=Contents)

    @property
    def is_hall(self) -> bool:
        """Whether the world is a hall with mobile robots; else it is a football table."""
        return self.hall_ is not None

    @property
    def table(self) -> Table:
        """The football table of a world that is one."""
        assert self.table_ is not None, "this world has no table"
        return self.table_

    @property
    def hall(self) -> Hall:
        """The hall of a world that is one."""
        assert self.hall_ is not None, "this world is no hall"
        return self.hall_

    def with_contents(self, contents: Contents) -> Self:
        """The same with what is in the files that it names."""
        spec = self.model_copy()
        spec._contents = contents
        return spec

    @property
    def asset_files(self) -> Mapping[str, bytes]:
        """The contents of the files that it was given, by path."""
        return self._contents.files

    def file_with(self, digest: str) -> bytes | None:
        """The content of the file with this digest (hex), of those that it was given."""
        return self._contents.by_digest.get(digest)

    def mesh_of(self, thing: str) -> Mesh | None:
        """The triangles of a thing of the scenery that is a mesh, None as long as its file was not given."""
        return self._contents.meshes.get(thing)

    def scenery_shapes(self) -> list[Shape]:
        """The scenery beside table or hall, in name order; files that its meshes are in were given."""
        meshes = self._contents.meshes
        return [scenery_shape(name, thing, meshes.get(name)) for name, thing in sorted(self.scenery.items())]

    def open_meshes(self) -> list[str]:
        """The things of the scenery that are walls without a thickness; files that its meshes are in were given."""
        return open_meshes(self.scenery, self._contents.meshes)

    def ticks(self, rate_hz: Fraction) -> int:
        """The period of a rate in ticks of this deployment."""
        return period_ticks(rate_hz, self.tick_ns)

    def turns(self, timed: Timed) -> tuple[int, int]:
        """Period and offset, in ticks, of a sensor or of a player in lockstep: its ticks are offset + n periods."""
        return self.ticks(timed.rate_hz), timed.offset_ns // self.tick_ns
