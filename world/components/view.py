"""What sensors and actuators have in common: what they see of the world, and where they are mounted.

A component is a pure function of the frame, its settings and keyed draws. Whatever it remembers is numbers of the
frame, which it declares when it registers itself (`registry`); an object keeps only what follows from the deployment
and the layout.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from foosim.common.errors import BadValue, Failed
from foosim.common.finding import Location
from foosim.world.forms.failures import failure_of
from foosim.world.forms.jobs import JobState
from foosim.world.forms.per_field import Numbers, read_per_field
from foosim.world.layout import WORLD, Entity, Layout
from foosim.world.spec import WorldSpec

if TYPE_CHECKING:  # numpy is for those who compute a tick
    import numpy as np
    from numpy.typing import NDArray

Result = TypeVar("Result")


class ComponentError(Failed):
    """A form has raised, or returned what it must not: whichever node computes its tick, it would do so again.

    `component` is which one of `entity` it is, `cause` has its traceback.
    """

    def __init__(self, component: str, entity: str, tick: int, cause: BaseException) -> None:
        super().__init__(f"{called_of(component, entity)} failed at tick {tick}: {failure_of(cause)}")
        self.component, self.entity, self.tick, self.cause = component, entity, tick, cause


class Misfit(BadValue):
    """A setting of a component that its robot or its world does not fit; `path` leads to it from the component's."""

    def __init__(self, path: Location, what: str, value: object, nearest: str | None = None) -> None:
        super().__init__(what, value, nearest)
        self.path = path


def called_of(component: str, entity: str) -> str:
    """Return in words which component of which entity it is; `entity` is empty, or that of the world, of others."""
    return component + {"": "", WORLD: " of the world"}.get(entity, f" of {entity}")


def component_error(component: str, entity: str, tick: int, error: BaseException) -> ComponentError:
    """Return what a call of a form has come to, whatever it raised: SystemExit, too.

    An interrupt, and an error that names its form already, is raised as it is.
    """
    if isinstance(error, KeyboardInterrupt | ComponentError):
        raise error
    return ComponentError(component, entity, tick, error)


def called(component: str, entity: str, tick: int, call: Callable[..., Result], *arguments: Any) -> Result:
    """Return what a call of a form returns. Raises ComponentError."""
    try:
        return call(*arguments)
    except BaseException as error:
        raise component_error(component, entity, tick, error) from error


def has_together(kind: type[Any], alone: str) -> bool:
    """Whether a class has `together`, and not only one that it inherits beside another method `alone` of its own."""
    for one in kind.__mro__:
        if "together" in vars(one):
            return True
        if alone in vars(one):
            return False
    return False


@dataclass(frozen=True, slots=True)
class Slot:
    """A field of an entity in the frame: the place of its first number, and how many there are.

    `is_own`: the component that asked for it declared it, and may write it. `is_others`: it is a field of another
    entity than the component's, which reads what it was at the start of the tick, whichever node computes that one.
    """

    at: int
    size: int
    name: str
    is_own: bool
    is_others: bool = False

    @property
    def places(self) -> range:
        """The places of its numbers in the frame."""
        return range(self.at, self.at + self.size)


class View:
    """What a component sees of the world in one tick: the numbers of the frame, by slots.

    `numbers` are those of all entities, SI units, in the world frame of reference; they are not written to directly.
    Those of other entities than the component's may be of the tick's start or of its end, as nodes share the work: they
    are read by `read`, which gives what they were at the start, or from `start`, all numbers as they were then.
    """

    __slots__ = ("_values", "count", "numbers", "start", "tick")

    def __init__(
        self,
        tick: int,
        numbers: Sequence[float],
        values: NDArray[np.float64] | None = None,
        start: Sequence[float] | None = None,
    ) -> None:
        self.tick = tick
        self.numbers = numbers
        self.start = numbers if start is None else start
        self.count = 0
        """How many commands an actuator has had in the tick before this one; 0 for readings."""
        self._values = values

    @property
    def values(self) -> NDArray[np.float64]:
        """The numbers as an array, which is not written to."""
        if self._values is None:
            import numpy as np

            self._values = np.frombuffer(array("d", self.numbers))  # takes a third of what np.array does
            self._values.setflags(write=False)
        return self._values

    def read(self, slot: Slot) -> Sequence[float]:
        """Return the numbers of a slot: of another entity than the component's, those of the start of the tick."""
        numbers = self.start if slot.is_others else self.numbers
        return numbers[slot.at : slot.at + slot.size]


def some_together(what: str, tick: int, made: Any, members: Sequence[Any], rows: NDArray[np.intp]) -> Any:
    """Return what some of several components are together, by their rows; `made` is what all of them are.

    It is taken from that where that can be. Raises ComponentError, which names them as `what`.
    """
    if hasattr(made, "taken"):
        return called(what, "", tick, made.taken, rows)
    some = [members[row] for row in rows.tolist()]
    return called(what, "", tick, type(some[0]).together, some)


class SlotReadings:
    """The readings of several sensors that are numbers of the frame as they are: read as one array."""

    def __init__(self, places: Sequence[Sequence[int]] | NDArray[np.intp]) -> None:
        """`places` are those of each sensor's numbers, of one length."""
        import numpy as np

        self._places = np.array(places)

    def taken(self, rows: NDArray[np.intp]) -> SlotReadings:
        """Return those of some of the sensors, by their rows."""
        return SlotReadings(self._places[rows])

    def sample(self, view: View) -> NDArray[np.float64]:
        """Return the numbers, of shape (sensors, numbers)."""
        numbers: NDArray[np.float64] = view.values[self._places]
        return numbers


class WritableView(View):
    """A view in the part of a tick in which components write to their slots."""

    __slots__ = ("_commands", "_written")

    def __init__(self, tick: int, numbers: list[float], start: Sequence[float] | None = None) -> None:
        self.tick, self.numbers, self.count = tick, numbers, 0  # as a View has them: there are several in each tick
        self.start = numbers if start is None else start
        self._values: NDArray[np.float64] | None = None
        self._written = numbers
        self._commands: dict[object, int] = {}

    @property
    def written_to(self) -> list[float]:
        """The numbers that `write` changes."""
        return self._written

    def count_command(self, actuator: object) -> None:
        """Say in `count` how many commands of the tick an actuator has had before this one."""
        self.count = self._commands.get(actuator, 0)
        self._commands[actuator] = self.count + 1

    def write(self, slot: Slot, *values: float) -> None:
        """Write all numbers of a slot, which the component must have declared."""
        size = slot.size
        if not (slot.is_own and len(values) == size and all(map(isfinite, values))):
            check_write(slot, values)
        self._written[slot.at : slot.at + size] = values

    def write_rows(self, slots: Sequence[Slot], rows: Sequence[list[float]]) -> None:
        """Write a row to each of these slots: of as many numbers as it has, all of them finite."""
        written = self._written
        for slot, row in zip(slots, rows, strict=True):
            assert slot.is_own and len(row) == slot.size, slot
            written[slot.at : slot.at + slot.size] = row


class SolvingView(WritableView):
    """A view in which entities go on: `numbers` are those at the start of the tick, what is written is at its end."""

    __slots__ = ()

    def __init__(
        self,
        tick: int,
        start: Sequence[float],
        written: list[float],
        values: NDArray[np.float64] | None = None,
    ) -> None:
        """`values` are the numbers at the start as an array; None: it is made where somebody asks for it."""
        super().__init__(tick, written, start)
        self.numbers = start
        self._values = values


class SensingView(WritableView):
    """A view in which sensors and their modifiers remember: what they write is in the next frame, not in this one."""

    __slots__ = ("not_finite", "written")

    def __init__(self, tick: int, numbers: list[float], values: NDArray[np.float64] | None = None) -> None:
        super().__init__(tick, numbers)
        self._values = values
        self.written: dict[int, float] = {}
        """Numbers of the next frame, by place."""
        self.not_finite: list[Any] = []
        """Sensors whose reading has a number that is not finite."""

    def write(self, slot: Slot, *values: float) -> None:
        """Write all numbers of a slot, which the component must have declared."""
        check_write(slot, values)
        self.written.update(enumerate(values, slot.at))


def check_write(slot: Slot, values: Sequence[float]) -> None:
    """Assert that a component may write these numbers to a slot."""
    assert slot.is_own, f"it writes {slot.name}, which is not its own and not declared in its writes"
    assert len(values) == slot.size, f"{len(values)} numbers for {slot.name}, which has {slot.size}"
    assert all(map(isfinite, values)), f"{', '.join(map(str, values))} for {slot.name}: numbers of a frame are finite"


@dataclass(frozen=True, slots=True)
class Mounting:
    """Where a component is: on which entity of which world, under which name, and the key of its draws.

    `writes` are the fields of the entity itself that it may write, beside its own slots. `is_owners`: its slots are the
    owner's, as those of sensors; a rule of one name has the solver's.
    """

    spec: WorldSpec
    layout: Layout
    robot: Entity
    name: str
    key: bytes
    writes: frozenset[str] = frozenset()
    is_owners: bool = False

    def slot(self, field: str) -> Slot:
        """Return a slot of the component itself, else one of its entity, by field."""
        offsets, own = self.robot.offsets, f"{self.name}.{field}"
        is_there = own in offsets and (offsets[own] >= self.robot.split) == self.is_owners
        name = own if is_there else field
        return Slot(
            offsets[name], self.robot.counts[name], f"{self.robot.name} {name}", is_there or field in self.writes
        )

    def of(self, entity: Entity, field: str) -> Slot:
        """Return a field of any entity, to be read: of another one as it was at the start of the tick."""
        is_others = entity.index != self.robot.index
        return Slot(entity.offsets[field], entity.counts[field], f"{entity.name} {field}", False, is_others)


@dataclass(frozen=True, slots=True)
class ModifierMounting:
    """What a modifier is on: the numbers of a reading or command, with the bounds of each, and the key of its draws.

    `period_s` is the time between two readings, `period_ticks` the least number of ticks between them: where the period
    is not whole ticks, some are one tick farther apart. Those of commands are a tick's.
    """

    mounting: Mounting
    numbers: Numbers
    low: tuple[float, ...]
    high: tuple[float, ...]
    tick_ns: int
    period_s: float
    period_ticks: int
    key: bytes

    def slot(self, field: str) -> Slot:
        """Return a slot of the modifier."""
        return self.mounting.slot(field)

    def per_field(self, written: Any, other: float) -> list[float]:
        """Return a setting's number for each number, and `other` for those of which it says nothing, as None does."""
        if written is None:
            return [other] * self.numbers.size
        return [other if number is None else number for number in read_per_field(written, self.numbers)]


class Sensor(Protocol):
    """What the tick of a node asks of a sensor. It is made from its settings and its mounting.

    A class may have four more methods: the static `check(settings, at)`, which raises Misfit where the settings do not
    fit robot or world; `limits()`, the least and greatest value of each field that it can measure;
    the static `together(sensors)`, which returns an object whose `sample(view)` gives the numbers of the readings of
    several as an array of shape (sensors, numbers), with the same bits; and the static `rays(sensors, numbers)`, which
    returns both ends of each ray that several send, as an array of shape (rays, 6) in the world's frame (m), to be
    drawn. Readings of those that are asked together are of one length.
    """

    def sample(self, view: WritableView) -> Any:
        """Return what is measured: a value of the registered reading."""


class Modifier(Protocol):
    """What is asked of a modifier. It is made from its settings and its mounting; it works on numbers alone.

    A class may have further methods: the static `check(settings, numbers)`, which raises BadValue where the settings do
    not fit the numbers that it is on (`forms.per_field.Numbers`); the static `together(modifiers)`, which returns an
    object whose `apply(values, view)` does the same to an array of shape (modifiers, numbers), and for commands
    `accept`, which takes one in place of `apply`, with `due(view)`, which returns one that had to wait and takes effect
    at this tick, or None.
    """

    def apply(self, values: list[float], view: WritableView) -> list[float] | None:
        """Return what becomes of the numbers of a value; None: it is dropped."""


class Actuator(Protocol):
    """What the tick of a node asks of an actuator. It is made from its settings and its mounting.

    The setting `joints` of its registration names the joints that it commands, so that several may share a robot.
    `steady = True` of a class says that what it asks follows from the state and its slots alone, whatever the tick is:
    a rod that such actuators have left as it was stays so, unsolved.

    A class may have seven more methods: `wrench(view)`, which returns a force (N) at the centre of mass of a free rigid
    base and a torque (N m), both in its principal axes; `bounds()`, which returns the least and the greatest value of
    each number of a command, where that is numbers whose fields have several each; `within(command)`, which returns the
    command that is carried out instead, where limits are of several numbers together; `names()`, what the numbers of a
    command are called; `problem(command)`, why `accept` refuses a command in every state, empty if it does not, for a
    warning; `unpowered()`, which returns what is asked of the motors of a robot without power; where there is none,
    that is a speed of 0 with the force or acceleration of `command`. The static `together(actuators)` returns an object
    whose `command(view)` gives what several ask, of robots that move by kinematics, as an array of shape (actuators,
    motors, 2), with the same bits.
    """

    def accept(self, command: Any, view: WritableView) -> bool:
        """Take a command within the limits, a value of the registered type, into the slots; False: it is refused."""

    def limits(self) -> Mapping[str, tuple[float, float]]:
        """Return the least and the greatest value of each field of a command that has bounds."""

    def hold(self, view: WritableView) -> None:
        """Ask for the present state from here on: the robot is taken out of service, or put back into it."""

    def stir(self, view: WritableView) -> None:
        """Ask for some motion, for the fixed small run that tells engines apart."""

    def command(self, view: View) -> tuple[tuple[float, ...], ...]:
        """Return (target speed, greatest force or acceleration) of each motor of the robot, in SI units.

        For motors of rigid bodies a third number may follow, `drives.Motor.slope`.
        """


class JobActuator(Actuator, Protocol):
    """An actuator whose commands may be jobs: registered with `jobs=True`, its command has a last field `job`.

    `accept` gets the command of a job as any other one, without its number. `hold` is called besides when a job is
    cancelled or fails. A class with a slot `failure` says by that why it could not do what it was told last: it has the
    sentences by the numbers in `FAILURES`.
    """

    def progress(self, view: WritableView) -> JobState:
        """Return, after the robot was solved and while a job runs, whether it runs on, is done or has failed."""
