"""The world part of a deployment: the computed entities, without machines and network."""

from collections.abc import Callable, Collection, Iterable, Mapping
from fractions import Fraction
from functools import cached_property
from math import gcd
from typing import Annotated, Any, Final, NamedTuple, Protocol, Self, TypeVar

from pydantic import Field, PrivateAttr, SerializeAsAny

from foosim.common import limits, units
from foosim.common.spec_base import Name, RobotName, SpecBase
from foosim.common.units import Quantity, period_ticks
from foosim.world.component_types import registry
from foosim.world.component_types.descriptions import Engine, Kit, Model
from foosim.world.component_types.settings import EntitySettings, RobotSettings, RuleSettings, SceneSettings
from foosim.world.earth import EarthOrigin
from foosim.world.events import EVENTS_MAX, WorldEvent
from foosim.world.matter.mesh import AssetError, Mesh, check_digest
from foosim.world.matter.physics import PhysicsSettings, SurfaceSettings
from foosim.world.scene import Shape
from foosim.world.scenery import (
    SCENERY_MAX,
    AssetFolder,
    AssetPath,
    Contents,
    Digest,
    Scenery,
    open_meshes,
    scenery_shape,
)

KITS: Final = "kits"
"""The field of kits' sections, each of which is under the name of its kit in a file."""
KITS_MAX: Final = 16
RULES_MAX: Final = 64
SURFACES_MAX: Final = 64
ROBOT_FILES_MAX: Final = 256
"""The greatest count of files of robots' models in one world."""

SEEDLESS: Final = frozenset({"fetched", "drawn world", "drawer", "casting"})
"""Shared values that are the same with any seed."""

Section = TypeVar("Section", bound=SpecBase)
T = TypeVar("T")


class Timed(Protocol):
    """Settings with a rate."""

    @property
    def rate_hz(self) -> Fraction:
        """The rate."""

    @property
    def offset_ns(self) -> int:
        """The delay after a multiple of the period."""


class Schedule(NamedTuple):
    """The ticks at which a sensor is due: those k for which (k step + shift) mod period is below the step.

    A reading is due at times t for which (t - offset) rate is whole. It is taken at the first tick not before, so at
    most a tick's length later: at tick k where floor((k T - offset) rate) is more than at tick k - 1, T being the tick.
    The numbers are this inequality in integers, divided by their greatest common divisor. With a period of n whole
    ticks they are 1, -offset in ticks, n.
    """

    step: int
    shift: int
    period: int

    def is_due(self, tick: int) -> bool:
        """Whether a reading is taken at a tick."""
        return (tick * self.step + self.shift) % self.period < self.step

    @property
    def least_ticks(self) -> int:
        """The least number of ticks between two readings; where the period is not whole ticks, some have one more."""
        return self.period // self.step


def schedule_of(timed: Timed, tick_ns: int) -> Schedule:
    """Return the schedule of a rate, at most that of the ticks."""
    rate = timed.rate_hz
    step, period = tick_ns * rate.numerator, units.NS_PER_S * rate.denominator
    shift = -timed.offset_ns * rate.numerator
    assert 0 < step <= period, f"{rate} Hz at ticks of {tick_ns} ns"
    common = gcd(step, shift, period)
    return Schedule(step // common, shift // common % (period // common), period // common)


def default_engine(world: Mapping[str, Any]) -> str:
    """Return the engine of a world (its sections by their fields) that names none."""
    models: list[Model | None] = [
        registry.find_model(name) for kit in _kits(world.get(KITS, {})) for name in kit.entities.values()
    ]
    models += [one.component_type for section in ("robots", "objects") for one in world.get(section, {}).values()]
    return "bullet" if any(model is not None and model.shares_solve for model in models) else "mujoco"


def _kits(names: Iterable[str]) -> list[Kit]:
    """Return kits by name, in name order."""
    found = [registry.find("kit", name) for name in sorted(names)]
    return [kit for kit in found if isinstance(kit, Kit)]


class WorldSpec(SpecBase):
    """The world: its robots, the sections of kits, rules, a scene, fixed things, and events.

    `digests` (BLAKE2b) identify the files of robots' models, by path in the asset folder; they are written when a run
    is planned. A world without an `engine` has bullet if there are rods or balls in it, else
    mujoco.
    """

    world: Name
    seed: Annotated[int, Field(ge=0, le=limits.COUNTER_MAX)]
    tick_ns: Annotated[int, Quantity(units.TIME, "0.1 ms", "100 ms")] = Field(alias="tick")
    substeps: Annotated[int, Field(ge=1, le=64)]
    kits: dict[str, SerializeAsAny[SpecBase]] = Field(default={}, max_length=KITS_MAX)
    rules: dict[Name, SerializeAsAny[RuleSettings]] = Field(default={}, max_length=RULES_MAX)
    scene: SerializeAsAny[SceneSettings] | None = None
    origin: EarthOrigin | None = None
    assets: AssetFolder = "."
    scenery: dict[Name, Scenery] = Field(default={}, max_length=SCENERY_MAX)
    physics: PhysicsSettings | None = None
    surfaces: dict[Name, SurfaceSettings] = Field(default={}, max_length=SURFACES_MAX)
    objects: dict[RobotName, SerializeAsAny[EntitySettings]] = Field(default={}, max_length=limits.ENTITIES_MAX)
    events: list[WorldEvent] = Field(default=[], max_length=EVENTS_MAX)
    digests: dict[AssetPath, Digest] = Field(default={}, max_length=ROBOT_FILES_MAX)
    robots: dict[RobotName, SerializeAsAny[RobotSettings]] = Field(min_length=1, max_length=limits.ENTITIES_MAX)
    engine: str = Field(default_factory=default_engine)
    _contents: Contents = PrivateAttr(default_factory=Contents)
    _shared: dict[str, tuple[object, Any]] = PrivateAttr(default_factory=dict)

    @cached_property
    def engine_type(self) -> Engine:
        """The registered engine."""
        return registry.find_engine(self.engine)

    @cached_property
    def kit_types(self) -> Mapping[str, Kit]:
        """The registered kits, by name in name order."""
        return {kit.name: kit for kit in _kits(self.kits)}

    @cached_property
    def world_rules(self) -> Mapping[str, RuleSettings]:
        """The rules of the world, by name in name order: those of its kits, and those of the deployment."""
        found = dict(self.rules)
        for kit in self.kit_types.values():
            for label, data in kit.rules.items():
                rule = registry.find("rule", data["kind"])
                found[label] = rule.settings.model_validate(dict(data)).typed(rule)  # type: ignore[attr-defined]
        return dict(sorted(found.items()))

    def section(self, kit: str, kind: type[Section]) -> Section:
        """Return the section of a kit that this world has."""
        found = self.kits[kit]
        assert isinstance(found, kind), found
        return found

    def senders_to(self, robot: str) -> tuple[str, ...]:
        """The endpoints that may command a robot, in name order: in a world by itself there are none."""
        return ()

    def settings_of(self, name: str) -> EntitySettings | None:
        """Return the settings of a robot or an object; None of an entity that a kit brings."""
        return self.robots.get(name) or self.objects.get(name)

    def shared(self, what: str, make: Callable[[], T]) -> T:
        """Return a value shared by all users of this world, built at its first use."""
        kept = self._shared.get(what)
        if kept is None or kept[0] is not self:  # a changed copy of a world has what was shared of it
            kept = self, make()
            self._shared = {**self._shared, what: kept}
        found: T = kept[1]
        return found

    def with_seed(self, seed: int) -> Self:
        """Return the world with another seed. It shares what draws its scene: that does not depend on the seed."""
        spec = self.model_copy(update={"seed": seed})
        spec._shared = {
            what: (spec, found) for what, (owner, found) in self._shared.items() if owner is self and what in SEEDLESS
        }
        return spec

    def with_contents(self, contents: Contents) -> Self:
        """Return the world with the contents of the files that it names."""
        spec = self.model_copy()
        spec._contents, spec._shared = contents, {}
        return spec

    @property
    def asset_files(self) -> Mapping[str, bytes]:
        """The contents of the given files, by path."""
        return self._contents.files

    def robot_files(self, files: Mapping[str, bytes]) -> list[str]:
        """The files of robots' models, in name order, as far as `files` (contents by path) name them.

        Raises AssetError.
        """
        found: dict[str, None] = {}
        for robot in self.robots.values():
            found |= dict.fromkeys(robot.asset_paths(files))
        if len(found) > ROBOT_FILES_MAX:
            raise AssetError(
                f"{min(found)}: one of {len(found)} files of robots, at most {ROBOT_FILES_MAX} are allowed"
            )
        return sorted(found)

    @property
    def has_drawn_readings(self) -> bool:
        """Whether readings of a sensor are drawn where they are looked at."""
        return any(one.component_type.drawn_by for robot in self.robots.values() for one in robot.sensors.values())

    @property
    def fetched(self) -> dict[str, bytes]:
        """The contents of files, by path, that came after the world was read without them: pictures are drawn with
        them."""
        return self.shared("fetched", dict)

    def check_robot_files(self, files: Mapping[str, bytes], optional: Collection[str] = ()) -> None:
        """Raise AssetError for a file of a robot that is missing, has another digest or is invalid.

        `optional` files may be missing.
        """
        for path in self.robot_files(files):
            if path not in files:
                if path in optional:
                    continue
                raise AssetError(f"{path}: the file of a robot is missing")
            if path in self.digests:
                check_digest(path, files[path], self.digests[path])
        for robot in self.robots.values():
            robot.check_assets(files)

    @property
    def lacks_files(self) -> bool:
        """Whether a file of a robot's model is missing: its body and state are unknown."""
        files = self._contents.files
        return any(path not in files for path in self.robot_files(files))

    def file_with(self, digest: str) -> bytes | None:
        """The content of the given file with this digest (hex)."""
        return self._contents.by_digest.get(digest)

    def mesh_of(self, thing: str) -> Mesh | None:
        """The triangles of a thing of the scenery that is a mesh, None as long as its file was not given."""
        return self._contents.meshes.get(thing)

    def scenery_shapes(self) -> list[Shape]:
        """The scenery beside kits and scene, in name order; files that its meshes are in were given."""
        meshes = self._contents.meshes
        return [scenery_shape(name, thing, meshes.get(name)) for name, thing in sorted(self.scenery.items())]

    def open_meshes(self) -> list[str]:
        """The things of the scenery that are walls without a thickness; files that its meshes are in were given."""
        return open_meshes(self.scenery, self._contents.meshes)

    def ticks(self, rate_hz: Fraction) -> int:
        """The period of a rate in ticks of this deployment."""
        return period_ticks(rate_hz, self.tick_ns)

    def turns(self, timed: Timed) -> tuple[int, int]:
        """Period and offset, in ticks, of a player in lockstep: its ticks are offset + n periods."""
        return self.ticks(timed.rate_hz), timed.offset_ns // self.tick_ns

    def schedule(self, sensor: Timed) -> Schedule:
        """The ticks of a sensor."""
        return schedule_of(sensor, self.tick_ns)
