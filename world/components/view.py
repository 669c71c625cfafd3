"""Common parts of sensors and actuators: their view of the world, and their mounting.

A component is a pure function of the frame, its settings and keyed draws. All its state is numbers of the frame, which
it declares when it registers itself (`component_types/registry.py`); an object keeps only data of deployment
and layout.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any, TypeVar

from foosim.common.errors import BadValue, Failed
from foosim.common.finding import Location
from foosim.world.component_types.failures import failure_of
from foosim.world.component_types.per_field import Numbers, read_per_field
from foosim.world.layout import WORLD, Entity, Layout
from foosim.world.spec import WorldSpec

if TYPE_CHECKING:  # only processes that compute ticks import numpy
    import numpy as np
    from numpy.typing import NDArray

Result = TypeVar("Result")


class ComponentError(Failed):
    """A component has raised, or returned an invalid value: each node that computes its tick would fail as it did.

    `component` is its name on `entity`, which is empty, or the world, for other components; `cause` has its traceback.
    """

    def __init__(self, component: str, entity: str, tick: int, cause: BaseException) -> None:
        whose = {"": "", WORLD: " of the world"}.get(entity, f" of {entity}")
        super().__init__(f"{component}{whose} failed at tick {tick}: {failure_of(cause)}")
        self.component, self.entity, self.tick, self.cause = component, entity, tick, cause


class IncompatibleComponent(BadValue):
    """A setting of a component or robot that does not fit its robot or its world; `path` leads to it from the settings
    of that component or robot."""

    def __init__(self, path: Location, what: str, value: object, nearest: str | None = None) -> None:
        super().__init__(what, value, nearest)
        self.path = path


def component_error(component: str, entity: str, tick: int, error: BaseException) -> ComponentError:
    """Return the ComponentError of a call of a component, for each exception: SystemExit, too.

    An interrupt, and an error that names its component already, is raised as it is.
    """
    if isinstance(error, KeyboardInterrupt | ComponentError):
        raise error
    return ComponentError(component, entity, tick, error)


def called(component: str, entity: str, tick: int, call: Callable[..., Result], *arguments: Any) -> Result:
    """Return the value of a call of a component. Raises ComponentError."""
    try:
        return call(*arguments)
    except BaseException as error:
        raise component_error(component, entity, tick, error) from error


def has_together(kind: type[Any], alone: str) -> bool:
    """Whether a class has `together` that fits its method `alone`: one inherited beside another `alone` does not."""
    own: type[Any] = next((one for one in kind.__mro__ if "together" in vars(one) or alone in vars(one)), object)
    return vars(own).get("together") is not None


@dataclass(frozen=True, slots=True)
class Slot:
    """A field of an entity in the frame: the place of its first number, and how many there are.

    `is_own`: the component declared it, and may write it. `is_others`: it is a field of another entity than the
    component's, whose value is that of the start of the tick, in any node.
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
    """A component's view of the world in one tick: the numbers of the frame, by slots.

    `numbers` are those of all entities, SI units, in the world frame of reference; they are never written to directly.
    Those of other entities than the component's may be of the tick's start or of its end, as nodes share the work:
    `read` returns the values at the start, and `start` has all numbers of that time.
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
        """The count of commands that an actuator has had in the tick before this one; 0 for readings."""
        self._values = values

    @property
    def values(self) -> NDArray[np.float64]:
        """The numbers as an array, to be read only."""
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
    """Return the `together` object of some of several components, by their rows; `made` is that of all of them.

    It is taken from `made` where that has `taken`. Raises ComponentError, which names them as `what`.
    """
    if hasattr(made, "taken"):
        return called(what, "", tick, made.taken, rows)
    some = [members[row] for row in rows.tolist()]
    return called(what, "", tick, type(some[0]).together, some)


class WritableView(View):
    """A view in the part of a tick in which components write to their slots."""

    __slots__ = ("_commands", "_written")

    def __init__(
        self,
        tick: int,
        numbers: Sequence[float],
        start: Sequence[float] | None = None,
        written: list[float] | None = None,
        values: NDArray[np.float64] | None = None,
    ) -> None:
        """`written` are other numbers than the read ones, where motions write the state at the end of a tick;
        `values` are the numbers as an array where there is one already."""
        self.tick, self.numbers, self.count = tick, numbers, 0  # as a View has them: there are several in each tick
        self.start = numbers if start is None else start
        self._values: NDArray[np.float64] | None = values
        if written is None:
            assert isinstance(numbers, list), "numbers that are written"
            written = numbers
        self._written = written
        self._commands: dict[object, int] = {}

    @property
    def written_to(self) -> list[float]:
        """The numbers that `write` changes."""
        return self._written

    def count_command(self, actuator: object) -> None:
        """Set `count` to the commands of the tick that an actuator has had before this one."""
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


class SensingView(WritableView):
    """A view in which sensors and their modifiers write their slots: into the next frame, not into this one."""

    __slots__ = ("not_finite", "written")

    def __init__(self, tick: int, numbers: list[float], values: NDArray[np.float64] | None = None) -> None:
        super().__init__(tick, numbers)
        self._values = values
        self.written: dict[int, float] = {}
        """Numbers of the next frame, by place."""
        self.not_finite: list[Any] = []
        """Sensors whose reading has a non-finite number."""

    def write(self, slot: Slot, *values: float) -> None:
        """Write all numbers of a slot, which the component must have declared."""
        check_write(slot, values)
        self.written.update(enumerate(values, slot.at))


def check_write(slot: Slot, values: Sequence[float]) -> None:
    """Assert that a component may write these numbers to a slot."""
    assert slot.is_own, f"it writes {slot.name}, neither its own slot nor declared in its writes"
    assert len(values) == slot.size, f"{len(values)} numbers for {slot.name}, which has {slot.size}"
    assert all(map(isfinite, values)), f"{', '.join(map(str, values))} for {slot.name}: numbers of a frame are finite"


@dataclass(frozen=True, slots=True)
class Mounting:
    """The mounting of a component: its world, its entity, its name, and the key of its draws.

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
        """Return a field of any entity, to be read: of another one its value at the start of the tick."""
        is_others = entity.index != self.robot.index
        return Slot(entity.offsets[field], entity.counts[field], f"{entity.name} {field}", False, is_others)


@dataclass(frozen=True, slots=True)
class ModifierMounting:
    """The mounting of a modifier: the numbers of a value, with the bounds of each, and the key of its draws.

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
        """Return a setting's number for each number, and `other` where the setting has none or is None."""
        if written is None:
            return [other] * self.numbers.size
        return [other if number is None else number for number in read_per_field(written, self.numbers)]
