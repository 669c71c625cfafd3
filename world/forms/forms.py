"""What there is to know of a registered form without making one: what it needs, remembers and writes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from foosim.common.errors import BadValue, show
from foosim.common.names import NAME_RULE, is_name

if TYPE_CHECKING:
    from msgspec import Struct

    from foosim.common.spec_base import SpecBase


class References(int):
    """How many references to entities a slot has, in place of numbers.

    A reference is the index of an entity, -1 for none: it follows its entity when others come and go.
    """


ENTITY: Final = References(1)
"""A slot that refers to an entity."""
NO_ENTITY: Final = -1.0

SAMPLES: Final = "samples"
"""The slot of each sensor that counts what it has sampled; no component declares one of this name."""
ROBOTS: Final = "*"
SLOTS_MAX: Final = 65_536
"""Numbers in all slots of one component, model, motion or rule."""
WORDS: Final[Mapping[str, str]] = MappingProxyType({"entity_rule": "rule of entities", "rule": "rule of worlds"})
"""What forms are called, where that is not their name."""
NO_SLOTS: Final[Mapping[str, int]] = MappingProxyType({})
NO_SETTINGS: Final[Mapping[str, float | None]] = MappingProxyType({})

BODY: Final[Mapping[str, int]] = MappingProxyType(
    {"position": 3, "orientation": 4, "linear_velocity": 3, "angular_velocity": 3}
)
"""The fields of a free rigid body: SI units, in the world frame, orientation as a quaternion x, y, z, w."""
JOINTS: Final = ("joint_positions", "joint_velocities", "joint_efforts")
"""The fields of a jointed rigid body, a number for each joint: m or rad, m/s or rad/s, N or N m. An effort is what the
joint's motor applied in the last substep."""
CONTACTS: Final[Mapping[str, int]] = MappingProxyType({"contacts": 3})
"""The contact log of a rigid body in the last tick: count of touches that began, impulse (N s), last substep or -1."""


@dataclass(frozen=True, slots=True)
class Carrier:
    """What a modifier is on: how many numbers a value has, and in which time they come one after the other (ns).

    Commands come in a tick's time at the earliest.
    """

    size: int
    period_ns: int


def word_of(form: str) -> str:
    """Return what one of a form is called."""
    return WORDS.get(form, form)


def with_article(noun: str) -> str:
    """Return a noun behind `a` or `an`."""
    return f"{'an' if noun[:1] in 'aeiou' else 'a'} {noun}"


def slots_problem(slots: object, *, is_sensor: bool = False) -> str:
    """Return what is wrong with slots: a mapping of names to counts of numbers; empty if nothing is."""
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


SlotsOf: TypeAlias = Callable[[Any, Carrier], Mapping[str, int]]
"""The slots of a component, by its settings and what it is on; a sensor or actuator is on no numbers. Raises BadValue
for settings that do not fit that."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """A registered class: its form and name, the class, and the model of its settings.

    `kit` is the section that a deployment must have, empty where any world will do.
    """

    form: str
    name: str
    made: Callable[..., Any]
    settings: type[SpecBase]
    kit: str = ""

    @property
    def module(self) -> str:
        """The module that it is in."""
        return self.made.__module__

    @property
    def summary(self) -> str:
        """The first line of its docstring."""
        return (self.made.__doc__ or "").strip().partition("\n")[0]


@dataclass(frozen=True, slots=True, kw_only=True)
class Component(Form):
    """A sensor, actuator or modifier.

    `value` is the type of its readings or commands; a modifier has none. `slots` are the numbers that it remembers, by
    field: they are in the frame as `NAME.FIELD`, NAME being that of the component on its robot. `needs` are the fields
    that the model of its robot must have. `several` is the setting that says how many numbers the last field of a
    reading has, if it has several. `moves` says that an actuator commands the motors of its robot: one of a robot may.
    `speaks` is a slot of its own, a field of the robot or `RULE.SLOT` of a rule of it: a sensor also measures at each
    tick at whose start its first number is not 0.
    `per_field` are the settings with a number for each field (`forms.per_field`), and the least that is valid of each;
    None without a least one.
    """

    value: type[Struct] | None = None
    slots: Mapping[str, int] | SlotsOf = field(default_factory=dict)
    needs: tuple[str, ...] = ()
    several: str = ""
    speaks: str = ""
    moves: bool = False
    per_field: Mapping[str, float | None] = field(default_factory=dict)

    def slots_on(self, settings: Any, carrier: Carrier) -> Mapping[str, int]:
        """Return its slots with these settings. Raises BadValue where these do not fit what it is on, or no slots
        follow from them."""
        if not callable(self.slots):
            return self.slots
        try:
            found: Any = self.slots(settings, carrier)
        except (BadValue, KeyboardInterrupt):
            raise
        except BaseException as error:  # SystemExit, too: a function may do anything
            raise BadValue(f"its slots are not known: {type(error).__name__}: {error}", self.name) from error
        problem = slots_problem(found, is_sensor=self.form == "sensor")
        if problem:
            raise BadValue(f"its slots are wrong: {problem}", self.name)
        return found  # type: ignore[no-any-return]


@dataclass(frozen=True, slots=True, kw_only=True)
class Model(Form):
    """A model of entities.

    `slots` are the fields of its state. Those that foosim itself needs it has whatever it declares: robots `down` and
    `refused`, what is solved `quarantined`. An engine solves one that is rigid; one with a `motion` goes on by that;
    any other stays as it is. A robot has an owner, and sends and receives packets. `actuators` and `rules` are those of
    a robot that says nothing of them, as in a deployment. `units` are those of its fields' numbers, the last one
    standing for all behind it; fields that every model calls the same need none.
    """

    slots: Mapping[str, int] = field(default_factory=dict)
    is_robot: bool = True
    has_body: bool = True
    """Whether it is somewhere, with an antenna; else only a place of the network can say where."""
    is_rigid: bool = False
    motion: str = ""
    actuators: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    rules: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    tags: tuple[str, ...] = ()
    units: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def is_solved(self) -> bool:
        """Whether a node computes its next state; that of any other stays as it is."""
        return self.is_rigid or bool(self.motion)

    @property
    def is_free(self) -> bool:
        """Whether it is a rigid body that nothing holds: it can be pushed."""
        return self.is_rigid and "linear_velocity" in self.slots


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion(Form):
    """How entities without rigid-body dynamics go on.

    `needs` are the fields of an entity that it reads, `writes` those that it alone writes, `slots` what it remembers
    besides, as `motion.FIELD`.
    """

    needs: tuple[str, ...] = ()
    writes: tuple[str, ...] = ()
    slots: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldRule(Form):
    """What a world does by itself, before a tick is solved.

    `slots` are what it remembers, as `NAME.FIELD` of the entity `world`, NAME being that of the rule in its world;
    `each` are what it remembers of the entities of a model (`ROBOTS`: of all robots), as `NAME.FIELD`. `writes` are the
    models whose state it may change.
    """

    slots: Mapping[str, int] = field(default_factory=dict)
    each: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    writes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class EntityRule(Form):
    """What an entity does by itself, after it was solved, computed by the node that solves it.

    `slots` are what it remembers, as `NAME.FIELD`; `needs` are the fields of the entity that it reads, `writes` those
    that it changes.
    """

    slots: Mapping[str, int] = field(default_factory=dict)
    needs: tuple[str, ...] = ()
    writes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Engine(Form):
    """What computes rigid bodies. `meshes` says that it has scenery of triangles."""

    meshes: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene(Form):
    """Scenery that never moves, made from settings."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Kit(Form):
    """A section of a deployment that makes a world from few numbers.

    `entities` are what is in the world beside the robots, their models by name; `addable` the models of which a running
    world can have more; `rules` the rules of the world, by name.
    """

    entities: Mapping[str, str] = field(default_factory=dict)
    addable: tuple[str, ...] = ()
    rules: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
