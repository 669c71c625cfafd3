"""The base classes of components: what foosim calls of each, as hooks that are empty by default.

A component derives from the class of its type, is registered by the decorator of that name
(`world/component_types/registry.py`) and overrides what it needs. It gets its settings and its mounting, and is a pure
function of the frame, its settings and keyed draws: its state is in slots, which its class declares, and its object
keeps only what follows from deployment and layout.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Self, cast

from msgspec.structs import astuple

from foosim.world.component_types.jobs import JobState

if TYPE_CHECKING:
    from foosim.common.finding import Finding
    from foosim.world.component_types.descriptions import Size
    from foosim.world.components.entities import Marked, MarkKind, Motors
    from foosim.world.components.reach import Reach
    from foosim.world.components.view import Mounting, Slot, View, WritableView
    from foosim.world.frame import Frame
    from foosim.world.layout import Entity, Layout
    from foosim.world.matter.physics import Physics
    from foosim.world.scene import Body, Shape, Vector

    Limits = Mapping[str, tuple[float, float]]


class Declared:
    """A slot that a class of components declares, or a field of the robot's model that it needs."""

    def __init__(self, size: Size | None, name: str = "", *, is_shared: bool = False) -> None:
        self.size, self.name, self.is_shared = size, name, is_shared

    def __set_name__(self, owner: type[Any], attribute: str) -> None:
        self.name = self.name or attribute.lstrip("_")


def slot(size: Size = 1, *, shared: bool = False) -> Slot:
    """Declare a slot at the class of a component: with `target = slot(3)`, `self.target` is the slot `target`.

    The name of the slot is that of the attribute, without `_` before it. `ENTITY` in place of a size is a reference to
    an entity. The size may be a function of (settings, carrier), except in rules. If it is `shared`, a rule of an
    entity writes the model's field of that name instead, where there is one.
    """
    return cast("Slot", Declared(size, is_shared=shared))


def need(name: str = "") -> Slot:
    """Declare at the class of a component that it needs a field of the robot's model, by default that of the
    attribute's name: with `heading = need()`, `self.heading` is that field."""
    return cast("Slot", Declared(None, name))


class Component:
    """What sensors, actuators, modifiers and rules have in common."""

    type_name: ClassVar[str] = ""
    declared: ClassVar[Mapping[str, Declared]] = {}
    """The slots and needs of the class, by attribute."""

    def __init_subclass__(cls) -> None:
        attributes = {attribute: one for kind in reversed(cls.__mro__) for attribute, one in vars(kind).items()}
        cls.declared = {attribute: one for attribute, one in attributes.items() if isinstance(one, Declared)}

    def __new__(cls, settings: Any, at: Any, *more: Any) -> Self:
        made = super().__new__(cls)
        for attribute, one in cls.declared.items():
            setattr(made, attribute, at.slot(one.name))
        return made

    def __init__(self, settings: Any, at: Any) -> None:
        """`at` is the mounting; the settings of an entity of a kit are None."""

    @staticmethod
    def check(settings: Any, at: Any) -> None:
        """Raise IncompatibleComponent where the settings do not fit the robot or the world; `at` is the mounting.

        A modifier gets its numbers in place of a mounting (`per_field.Numbers`), and raises
        BadValue.
        """


class Sensor(Component):
    """A sensor of a robot."""

    type_name = "sensor"
    together: ClassVar[Any] = None
    """A static method of a list of sensors of the class, that returns an object whose `sample(view)` returns the
    numbers of their readings as an array (sensors, numbers), with the same bits. Their readings are of one length."""
    rays: ClassVar[Any] = None
    """A static method of (sensors, numbers of a frame) that returns both ends of each of their rays, for drawing: an
    array (rays, 6), in m in the world frame."""

    def sample(self, view: WritableView) -> Any:
        """Return the measurement: a value of the registered reading."""
        return None

    def limits(self) -> Limits:
        """Return the least and the greatest value that each field of a reading can have."""
        return {}


class Actuator(Component):
    """An actuator of a robot."""

    type_name = "actuator"
    steady: ClassVar[bool] = False
    """Whether `command` is a function of the robot's state and the slots, whatever the tick: a rod at rest that its
    actuators leave unchanged is not solved."""
    FAILURES: ClassVar[Mapping[float, str]] = {}
    """The meaning of each number in the slot `failure`, for the sender of a job."""
    together: ClassVar[Any] = None
    """A static method of a list of actuators of the class, of robots that move by kinematics: it returns an object
    whose `command(view)` returns an array (actuators, motors, 2), with the same bits."""

    def accept(self, command: Any, view: WritableView) -> bool:
        """Take a command within the limits, a value of the registered type, into the slots; False: it is refused."""
        return False

    def command(self, view: View) -> Motors:
        """Return (target speed, greatest force or acceleration) of each motor of the robot, in SI units.

        For motors of rigid bodies a third number may follow, `drives.Motor.slope`.
        """
        return ()

    def limits(self) -> Limits:
        """Return the least and the greatest value of each field of a command that has bounds."""
        return {}

    def bounds(self) -> Sequence[tuple[float, float]] | None:
        """Return the least and the greatest value of each number of a command whose fields have several each."""
        return None

    def within(self, command: Any) -> Any:
        """Return the command that is carried out instead, where limits are of several numbers together."""
        return command

    def names(self) -> Sequence[str]:
        """Return the names of a command's numbers in messages; empty: those of its fields."""
        return ()

    def problem(self, command: Any) -> str:
        """Return why `accept` refuses a command in every state, for a warning; empty if it does not."""
        return ""

    def hold(self, view: WritableView) -> None:
        """Hold the present state from now on: the robot goes out of service, or comes back, or its job ended."""

    def excite(self, view: WritableView) -> None:
        """Command some motion, for the fixed small run that distinguishes engines."""

    def wrench(self, view: View) -> tuple[Vector, Vector] | None:
        """Return a force (N) at the centre of mass of a free rigid base and a torque (N m), in its principal axes."""
        return None

    def unpowered(self) -> Motors | None:
        """Return the set-points of the motors of a robot without power; None: a speed of 0 with the usual force."""
        return None

    def progress(self, view: WritableView) -> JobState:
        """Return, after the robot was solved and while a job runs, whether it runs on, is done or has failed."""
        return JobState.FAILED


class SetPointActuator(Actuator):
    """An actuator that keeps all fields of the last command, each a number, in a slot."""

    _set_point: Slot
    """Declared by its class."""

    def accept(self, command: Any, view: WritableView) -> bool:
        """Take all numbers."""
        view.write(self._set_point, *astuple(command))
        return True

    def hold(self, view: WritableView) -> None:
        """Set all numbers to 0."""
        view.write(self._set_point, *[0.0] * self._set_point.size)


class Modifier(Component):
    """A modifier of the readings of a sensor or the commands of an actuator. It works on numbers alone."""

    type_name = "modifier"
    together: ClassVar[Any] = None
    """A static method of a list of modifiers of the class, that returns an object whose `apply(values, view)` does the
    same to an array (modifiers, numbers)."""

    def apply(self, values: list[float], view: WritableView) -> list[float] | None:
        """Return what becomes of the numbers of a value; None: it is dropped."""
        return values

    def accept(self, values: list[float], view: WritableView) -> list[float] | None:
        """Return what becomes of the numbers of a command; None: it is dropped, or waits."""
        return self.apply(values, view)

    def due(self, view: WritableView) -> list[float] | None:
        """Return a command that had to wait and takes effect at this tick; None: there is none."""
        return None


class Model(Component):
    """An entity of a model, in the frames of one layout."""

    type_name = "model"
    is_upright: bool = True
    """Whether obstacles meet an entity that moves by kinematics as a cylinder (`upright`) instead of its shapes."""

    def __init__(self, settings: Any, at: Mounting) -> None:
        self.settings, self.at = settings, at

    def body(self) -> Body | None:
        """Return its links and shapes; None without a body."""
        return None

    def place(self, view: WritableView) -> None:
        """Set its fields for tick 0. All are 0 before, and references -1."""

    def check_place(self, position: Vector) -> None:
        """Raise BadValue where it cannot be put in a running world (m, world frame)."""

    def place_at(self, view: WritableView, position: Vector, velocity: Vector = (0.0, 0.0, 0.0)) -> None:
        """Put it somewhere (m, m/s, world frame): overridden by models whose settings have no place."""

    def derive(self, view: WritableView) -> None:
        """Write the fields of a rigid model that follow from the engine's result, which is finite."""

    def is_plausible(self, numbers: Sequence[float], before: Sequence[float]) -> bool:
        """Whether its new, finite state is valid: inside its area, within its speed limit and its reach."""
        return True

    def out_of_bounds(self, numbers: Sequence[float]) -> str:
        """Return the problem of a state that no run should reach; empty without one."""
        return ""

    def excite(self, view: WritableView) -> None:
        """Set it in motion, for the fixed small run that distinguishes engines."""

    def set(self, field: str, value: float) -> Mapping[str, Sequence[float]]:
        """Return the numbers of its slots for a new value of a settable field."""
        return {field: (value,)}

    def upright(self) -> Any:
        """Return the cylinder that it is to obstacles (`moving.upright.Upright`); None: the one around its body."""
        return None

    def wheels(self) -> Any:
        """Return its two driven wheels (`moving.wheels.Wheels`); None without these."""
        return None


class Motion:
    """How the entities of a model without rigid-body dynamics move: one object moves all of a layout.

    It gets a `MotionMounting`, and may write all fields of these entities.
    """

    slots: ClassVar[Mapping[str, int]] = {}
    """Its slots of each entity, as `motion.FIELD`."""
    takes_arrays: ClassVar[bool] = False
    """Whether `motors` may be an array of shape (entities, motors, 2)."""

    def move(self, entities: Sequence[Entity], motors: Any, view: Any) -> None:
        """Write the state of these entities after a tick with these set-points of their motors.

        `view.numbers` are those of all entities at the start of the tick, before commands reached them. Written
        numbers are read at the next tick, so that the order in which entities are moved changes nothing.
        """


class _Marking(Component):
    mark_kinds: ClassVar[Mapping[str, MarkKind]] = {}
    """The look of its marks, by kind."""

    def apply(self, view: WritableView) -> None:
        """Write the effect of the rule in this tick."""

    def place(self, view: WritableView) -> None:
        """Write its slots at tick 0."""

    def set(self, field: str, value: float) -> Mapping[str, Sequence[float]]:
        """Return the numbers of its slots for a new value of a settable field."""
        return {field: (value,)}

    def marks(self, before: Frame, after: Frame) -> Iterable[Marked]:
        """Yield its marks between two frames, which may be several ticks apart."""
        return ()


class Rule(_Marking):
    """A rule of the world: `apply` edits the frame before the tick is solved, on every node alike.

    It gets its settings and a `RuleMounting`.
    """

    type_name = "rule"

    def status(self, view: View) -> Mapping[str, Any]:
        """Return its state for displays, as JSON."""
        return {}

    @staticmethod
    def text(status: Any) -> str:
        """Return its part of the status in words; `status` has that of all rules and kits."""
        return ""


class EntityRule(_Marking):
    """A rule of one entity: `apply` runs after the entity was solved; others are seen as at the start of the tick.

    `marks` is called with frames that both have the entity.
    """

    type_name = "entity_rule"

    def has_power(self, view: View) -> bool:
        """Whether the drives of the entity have power in this tick."""
        return True


class Kit:
    """A section of the deployment."""

    type_name: ClassVar[str] = "kit"

    def __init__(self, section: Any, spec: Any) -> None:
        """The section of the deployment, and its world."""

    @staticmethod
    def check(section: Any, spec: Any) -> Iterable[Finding]:
        """Yield problems between settings, before any kit or robot is built."""
        return ()

    def shapes(self) -> tuple[Shape, ...]:
        """Return its scenery."""
        return ()

    def physics(self) -> Physics | None:
        """Return its surfaces and bodies for rigid bodies; None without any."""
        return None

    def reach(self, layout: Layout) -> Reach | None:
        """Return the bounding volumes of its rods and balls; None of a kit without any."""
        return None

    def findings(self) -> Iterable[Finding]:
        """Yield problems of places, which need all single settings to be valid."""
        return ()

    def strays(self, frame: Frame) -> list[str]:
        """Return descriptions of entities at places that no run should reach."""
        return []

    def status(self, frame: Frame) -> Mapping[str, Any]:
        """Return its state for displays, as JSON."""
        return {}

    @staticmethod
    def text(status: Any) -> str:
        """Return its part of the status in words; `status` has that of all rules and kits."""
        return ""
