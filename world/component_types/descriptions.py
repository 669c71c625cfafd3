"""Descriptions of registered component types: their settings, slots, needs and writes."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from foosim.common.errors import BadValue, show
from foosim.common.names import NAME_RULE, is_name
from foosim.common.units import Quantity
from foosim.world.component_types.failures import failure_of

if TYPE_CHECKING:
    from msgspec import Struct

    from foosim.common.spec_base import SpecBase


class References(int):
    """The count of references to entities in a slot, in place of numbers.

    A reference is the index of an entity, -1 for none: it becomes that when its entity leaves the world.
    """


ENTITY: Final = References(1)
"""A slot that refers to an entity."""
NO_ENTITY: Final = -1.0

SAMPLES: Final = "samples"
"""The slot of each sensor that counts its samples; no component declares one of this name."""
BASE_CLASSES: Final = "foosim.world.components.base"
"""The module of the base classes of components."""
ROBOTS: Final = "*"
SLOTS_MAX: Final = 65_536
"""Numbers in all slots of one component, model, motion or rule."""
WORDS: Final[Mapping[str, str]] = MappingProxyType({"entity_rule": "rule of entities", "rule": "rule of worlds"})
"""The nouns of component types, where these differ from their names."""
NO_SLOTS: Final[Mapping[str, int]] = MappingProxyType({})
BODY: Final[Mapping[str, int]] = MappingProxyType(
    {"position": 3, "orientation": 4, "linear_velocity": 3, "angular_velocity": 3}
)
"""The fields of a free rigid body: SI units, in the world frame, orientation as a quaternion x, y, z, w."""
LINEAR_VELOCITY: Final = "linear_velocity"
"""A field of free rigid bodies only."""
JOINTS: Final = ("joint_positions", "joint_velocities", "joint_efforts")
"""The fields of a jointed rigid body, a number for each joint: m or rad, m/s or rad/s, N or N m. An effort is what the
joint's motor applied in the last substep."""
JOINTS_MAX: Final = 128
"""Joints that an actuator drives at most."""
JOINTS_READ_MAX: Final = 256
"""Joints that a sensor measures at most."""
CONTACTS: Final[Mapping[str, int]] = MappingProxyType({"contacts": 3})
"""The contact log of a rigid body in the last tick: count of touches that began, impulse (N s), last substep or -1."""

PARTNERS_MAX: Final = 4
PARTNERS: Final[Mapping[str, int]] = MappingProxyType(
    {"partners": References(PARTNERS_MAX), "partner_impulses": PARTNERS_MAX}
)
"""The entities that a rigid body touched in the last tick, at most four with the greatest impulses, in name order; and
these impulses (N s)."""
TOUCHES_MAX: Final = 2
TOUCHES: Final[Mapping[str, int]] = MappingProxyType(
    {
        "touches": 1,
        "touch_partners": References(TOUCHES_MAX),
        "touch_links": TOUCHES_MAX,
        "touch_places": TOUCHES_MAX,
        "touch_starts": TOUCHES_MAX,
        "touch_ends": TOUCHES_MAX,
        "touch_impulses": TOUCHES_MAX,
    }
)
"""Contacts of the links of a jointed body in the last tick, at most two with the greatest impulses in the order in
which they began: the count of contacts that began; of each its partner, the index of the link, the place along the
axis of the first joint, from that joint (m), the first and the last substep, and the impulse (N s)."""
STILL_TICKS: Final = "still_ticks"
STILL_POSE: Final = "still_pose"
POSE: Final = ("position", "orientation", "joint_positions")
RESTING: Final[Mapping[str, int]] = MappingProxyType({STILL_TICKS: 1})
"""The count of ticks that a rigid body has been still: an island of bodies that all have been for long is at rest. A
body with this field has also `still_pose`, its pose in these ticks, with the numbers of its pose's fields."""


@dataclass(frozen=True, slots=True)
class Carrier:
    """What carries a component: the count of numbers in a value, the least time between two values (whole ticks, ns),
    and the count of joints of its robot.

    Commands come in a tick's time at the earliest. A sensor or actuator has no numbers here, a modifier no robot.
    """

    size: int
    period_ns: int
    joints: int = 0


def overrides(kind: Callable[..., Any], hook: str) -> bool:
    """Whether a class of components has a hook of its own instead of the empty one of its base class."""
    having = [one for one in getattr(kind, "__mro__", ()) if hook in vars(one)]
    return bool(having) and having[0].__module__ != BASE_CLASSES


def word_of(type_name: str) -> str:
    """Return the noun of a component."""
    return WORDS.get(type_name, type_name)


def with_article(noun: str) -> str:
    """Return a noun after `a` or `an`."""
    return f"{'an' if noun[:1] in 'aeiou' else 'a'} {noun}"


def slots_problem(slots: object, *, is_sensor: bool = False) -> str:
    """Return the problem of slots, a mapping of names to counts of numbers; empty without one."""
    if not isinstance(slots, Mapping):
        return f"they are a mapping of names to counts of numbers, not {show(slots)}"
    numbers = 0
    for name, size in slots.items():
        if not (isinstance(name, str) and is_name(name)):
            return f"{show(name)}: {NAME_RULE}"
        if name == SAMPLES and is_sensor:
            return f"each sensor has a slot {SAMPLES} already"
        if not isinstance(size, int) or isinstance(size, bool) or not 1 <= size <= SLOTS_MAX:
            return f"{name} has 1 to {SLOTS_MAX} numbers, or ENTITY, not {show(size)}"
        numbers += size
    return f"{numbers} numbers in all, at most {SLOTS_MAX} are valid" if numbers > SLOTS_MAX else ""


ABSENT: Final = "absent"
"""The slot of each entity with a place: 1 while it is absent from the world, else 0."""
INACTIVE: Final = "inactive"
"""The slot of each robot with components for the switched-off ones: a bit for each of its sensors and actuators, the
lowest for the first by name."""
DOWN: Final = "down"
OF_ROBOTS: Final = (DOWN, "refused", "clamped")
"""Fields of each robot: whether it is out of service, and the counts of commands that it has refused and clamped."""
SET_BY_FOOSIM: Final = ("at", DOWN)
"""Fields that can be set of entities of each model."""
OF_SOLVED: Final = ("quarantined",)
"""Fields of each solved entity: whether it keeps its last state, since its new one was invalid."""

Size: TypeAlias = int | Callable[[Any, Carrier], int]
"""The count of a slot's numbers, or a function of the settings and the carrier, which raises BadValue for settings that
do not fit the carrier."""
FieldsOf: TypeAlias = Callable[[Any, Any], Mapping[str, int]]
"""The fields of an entity's state, by its settings (None except of robots) and the world (`WorldSpec`) with its
files. Raises BadValue for settings without valid fields."""


def slots_found(name: str, slots_of: Callable[..., Any], *arguments: Any, is_sensor: bool = False) -> Mapping[str, int]:
    """Return the slots that a function returns. Raises BadValue where it fails, or returns invalid slots."""
    try:
        found = slots_of(*arguments)
    except (BadValue, KeyboardInterrupt):
        raise
    except BaseException as error:  # SystemExit, too: a function may do anything
        raise BadValue(f"its slots failed: {failure_of(error)}", name) from error
    problem = slots_problem(found, is_sensor=is_sensor)
    if problem:
        raise BadValue(f"its slots are wrong: {problem}", name)
    return found  # type: ignore[no-any-return]


TriggerOf: TypeAlias = Callable[[Any], str]
"""The trigger of a sensor beside its rate, by its settings."""
ArrayLengthOf: TypeAlias = Callable[[Any, Mapping[str, int]], int]
"""The counts of numbers of a reading's last fields, by the settings and the counts of the robot's fields."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ComponentType:
    """A registered class: its type and name, the class, and the model of its settings.

    `kit` is the section that a deployment must have, empty where it fits any world.
    """

    type_name: str
    name: str
    factory: Callable[..., Any]
    settings: type[SpecBase]
    kit: str = ""

    @property
    def module(self) -> str:
        """The module of the class."""
        return self.factory.__module__

    @property
    def is_own(self) -> bool:
        """Whether it is foosim's own, rather than of another package."""
        return self.module.startswith("foosim.")

    @property
    def summary(self) -> str:
        """The first line of its docstring."""
        return (self.factory.__doc__ or "").strip().partition("\n")[0]


@dataclass(frozen=True, slots=True, kw_only=True)
class Component(ComponentType):
    """A sensor, actuator or modifier.

    `value` is the type of its readings or commands; a modifier has none. `slots` are the numbers of its state, by
    field, as its class declares them: they are in the frame as `NAME.FIELD`, NAME being that of the component on its
    robot. `needs` are the fields that the model of its robot must have: what its class declares, and others.
    `array_length` is the setting with the count of numbers of a reading's last fields, where these have several each,
    or a function that returns it.
    `moves`: an actuator commands the motors of its robot. `joints` is the setting that names their joints, in the order
    of the actuator's set-points; without such a setting, or with None, it commands all. No motor is commanded by two
    actuators. `jobs`: its commands may be jobs (`component_types/jobs.py`).
    `trigger` is a slot of its own, a field of the robot or `RULE.SLOT` of a rule of it: a sensor also measures at each
    tick at whose start its first number is not 0; or a function that returns it, maybe a slot of an actuator.
    `shown_as` is the Foxglove message that shows a sensor's readings, by its name in `component_types/shown.py`; empty
    for none. `drawn_by` is a class by `module:Class` that draws its readings where they are looked at, made with world,
    settings, robot and channel: a decoded reading keeps it as `drawn_by` in its `__dict__`; empty for none.
    `per_field` are the settings with a number for each field (`component_types/per_field.py`), and the least that is
    valid of each; None without a least one.
    """

    value: type[Struct] | None = None
    slots: Mapping[str, Size] = field(default_factory=dict)
    needs: tuple[str, ...] = ()
    array_length: str | ArrayLengthOf = ""
    trigger: str | TriggerOf = ""
    shown_as: str = ""
    drawn_by: str = ""
    moves: bool = False
    joints: str = ""
    jobs: bool = False
    per_field: Mapping[str, float | None] = field(default_factory=dict)

    def slots_on(self, settings: Any, carrier: Carrier) -> Mapping[str, int]:
        """Return its slots with these settings. Raises BadValue where these do not fit its carrier, or give no valid
        slots."""

        def found() -> Mapping[str, int]:
            return {name: size(settings, carrier) if callable(size) else size for name, size in self.slots.items()}

        return slots_found(self.name, found, is_sensor=self.type_name == "sensor")

    def trigger_by(self, settings: Any) -> str:
        """Return the trigger of a sensor with these settings beside its rate; empty without one."""
        return self.trigger(settings) if callable(self.trigger) else self.trigger

    def joints_named(self, settings: Any) -> Sequence[str] | None:
        """Return the joints that an actuator with these settings commands; None for all. Raises BadValue."""
        named = getattr(settings, self.joints) if self.joints else None
        if named is None or (isinstance(named, list | tuple) and all(isinstance(name, str) for name in named)):
            return named or None
        raise BadValue(f"the setting {self.joints} of {self.name} is a list of the names of joints, or None", named)


@dataclass(frozen=True, slots=True, kw_only=True)
class Model(ComponentType):
    """A model of entities.

    `slots` are the fields of its state, or a function of settings and world that returns them. foosim adds
    fields to the declared ones: `down`, `refused` and `clamped` to robots, `quarantined` to solved entities. An engine
    solves a rigid model; one with a `motion`, a class derived from `components.base.Motion`, moves by that; any other
    never changes. A robot has an owner, and sends and receives packets. `actuators` and `rules` are the defaults of a
    robot's settings, as in a deployment. `units` are those of its fields' numbers, the last one for all further ones;
    fields with the same name in every model need none. `variants` are descriptions in its place where its setting
    `dynamics` has one of these values. `settable` are fields of its state that can be set, as of a rule of entities
    (`EntityRule`).
    """

    slots: Mapping[str, int] | FieldsOf = field(default_factory=dict)
    is_robot: bool = True
    has_body: bool = True
    """Whether it has a place in the world, with an antenna; else only the network can give it a place."""
    on_demand: Mapping[str, int] = field(default_factory=dict)
    """Further fields of an entity with a component that needs them."""
    is_rigid: bool = False
    couples: bool = True
    """Whether its parts are coupled, as by the motors of an arm: its island has a solve of its own."""
    motion: type[Any] | None = None
    actuators: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    rules: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    tags: tuple[str, ...] = ()
    units: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    settable: Mapping[str, Quantity] = field(default_factory=dict)
    variants: Mapping[str, Model] = field(default_factory=dict)

    def variant(self, dynamics: object) -> Model:
        """Return the description of its entities whose setting `dynamics` has this value."""
        return self.variants.get(dynamics, self) if isinstance(dynamics, str) else self

    @property
    def is_solved(self) -> bool:
        """Whether a node computes its next state; that of any other never changes."""
        return self.is_rigid or self.motion is not None

    @property
    def mover(self) -> str:
        """The mover of its entities, in a word."""
        return "an engine" if self.is_rigid else "nothing" if self.motion is None else self.motion.__name__

    @property
    def declared(self) -> Mapping[str, int] | None:
        """The fields of the state of every entity of it; None where they follow from settings."""
        return None if callable(self.slots) else self.slots

    @property
    def shares_solve(self) -> bool:
        """Whether it is a rod or a ball of a table: an engine solves all of these together."""
        return self.is_rigid and not self.couples

    @property
    def can_be_free(self) -> bool:
        """Whether its entities are free rigid bodies, or some may be."""
        return self.is_rigid and (self.declared is None or LINEAR_VELOCITY in self.declared)

    def fields_of(self, settings: Any, spec: Any) -> Mapping[str, int]:
        """Return the fields of the state of an entity with these settings (None except of robots).

        Raises BadValue where these have no valid fields.
        """
        if not callable(self.slots):
            return self.slots
        found = slots_found(self.name, self.slots, settings, spec)
        return {**found, **{slot: 1 for slot in self.needed if slot not in found}}

    def demanded(self, needs: Iterable[str]) -> dict[str, int]:
        """Return the fields on demand that the components of an entity need."""
        needed = {*needs}
        return {slot: count for slot, count in self.on_demand.items() if slot in needed}

    @property
    def needed(self) -> tuple[str, ...]:
        """The fields that foosim itself needs."""
        return (*(OF_ROBOTS if self.is_robot else ()), *(OF_SOLVED if self.is_solved else ()))


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldRule(ComponentType):
    """A change of the world by itself, before a tick is solved.

    `slots` are its state, as its class declares it, as `NAME.FIELD` of the entity `world`, NAME being that of the rule
    in its world; `each` are its state of the entities of a model (`ROBOTS`: of all robots), as `NAME.FIELD`. `writes`
    are the models whose state it may change. `settable` are its fields that can be set, as of a rule of entities
    (`EntityRule`).
    """

    slots: Mapping[str, int] = field(default_factory=dict)
    each: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    writes: tuple[str, ...] = ()
    settable: Mapping[str, Quantity] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class EntityRule(ComponentType):
    """A change of an entity by itself, after it was solved, computed by the node that solves it.

    `slots` are its state, as `NAME.FIELD`; `needs` are the fields of the entity that it reads: its class declares both.
    `writes` are the fields that it changes. `shared` are slots that a model may have as fields of these names: of such
    a model it writes them.
    `settable` are fields that can be set during a run, and the limits: slots of its own with one number; or the numbers
    by slot that its method `set(field, value)` returns. Values are in SI units.
    """

    slots: Mapping[str, int] = field(default_factory=dict)
    needs: tuple[str, ...] = ()
    writes: tuple[str, ...] = ()
    shared: tuple[str, ...] = ()
    settable: Mapping[str, Quantity] = field(default_factory=dict)

    def slots_on(self, fields: Collection[str]) -> dict[str, int]:
        """Return its slots on an entity whose model has these fields."""
        return {slot: size for slot, size in self.slots.items() if not (slot in self.shared and slot in fields)}

    @property
    def written(self) -> tuple[str, ...]:
        """The fields of an entity that it may change, where the entity has them."""
        return (*self.writes, *self.shared)


@dataclass(frozen=True, slots=True)
class Engine:
    """An engine of rigid bodies: `module:Class`, called with deployment and layout (`node.physics.interface`).

    `meshes`: it has scenery of triangles. `islands`: it has bodies of any kind, and solves islands one after the other
    (`IslandEngine`); any other has rods and balls of a table. `grasps`: it holds two bodies together by
    `Island.welds`. `needs`: a module that not every installation has; `where` says which have it, and `instead` what
    to set without it.
    """

    name: str
    path: str
    meshes: bool = False
    islands: bool = False
    grasps: bool = False
    needs: str = ""
    where: str = ""
    instead: str = ""

    @property
    def lack(self) -> str:
        """What it lacks on this machine, in words; empty where it can be built."""
        if not self.needs or find_spec(self.needs) is not None:
            return ""
        return f"the engine {self.name} needs {self.needs}, which {self.where}"

    @property
    def bodies(self) -> str:
        """The bodies that it supports, in words."""
        return "bodies other than table rods and balls" if self.islands else "table rods and balls"


ENGINES: Final[dict[str, Engine]] = {
    "bullet": Engine(
        "bullet",
        "foosim.node.physics.bullet_engine:BulletEngine",
        meshes=True,
        needs="pybullet",
        where="has wheels for Python 3.11 alone",
        instead="set engine: pure, or use Python 3.11; pure resolves contacts one after the other, has no meshes, and "
        "gives slightly different results with other digests",
    ),
    "mujoco": Engine(
        "mujoco", "foosim.node.physics.mujoco_islands:MujocoIslands", meshes=True, islands=True, grasps=True
    ),
    "pure": Engine("pure", "foosim.node.physics.pure_engine:PureEngine"),
}
"""The engines by name; a package adds its own in a module that it names as an entry point."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene(ComponentType):
    """Scenery that never moves, by settings."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Kit(ComponentType):
    """A section of a deployment that builds a world by few numbers.

    `entities` are those of the world beside the robots, their models by name; `spares` returns the same of entities
    that are absent at the start, by the section; `rules` are the rules of the world, by name. `presets` are whole
    sections, as plain data, by name: a section may name one for its missing keys.
    """

    entities: Mapping[str, str] = field(default_factory=dict)
    spares: Callable[[Any], Mapping[str, str]] | None = None
    rules: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    presets: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
