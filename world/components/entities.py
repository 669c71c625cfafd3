"""What the world asks of models, motions, rules and kits: the methods of their classes.

None of their objects remembers anything: what lasts is numbers of the frame. An object keeps only what follows from the
deployment and the layout.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol, TypeAlias, TypeVar

from foosim.common.keyed_random import draw_key
from foosim.world.components.view import Mounting, Slot, SolvingView, WritableView
from foosim.world.layout import WORLD, Entity, Layout
from foosim.world.matter.physics import Physics
from foosim.world.scene import Body, Shape
from foosim.world.spec import WorldSpec

if TYPE_CHECKING:
    from foosim.common.finding import Finding

S = TypeVar("S")

Motors = tuple[tuple[float, ...], ...]
"""What actuators ask of each motor of an entity: target speed, and greatest force or acceleration (SI units).

Of a rigid body a third number may follow, `drives.Motor.slope`."""
Marked: TypeAlias = tuple[int, str, str]
"""What happened: the tick, the kind of the mark, the text."""


@dataclass(frozen=True, slots=True)
class MarkKind:
    """How marks of a kind look on a time line, and what several of them are called.

    `is_cut` says that something is put elsewhere then: no way leads there.
    """

    look: Literal["score", "start", "away", "rest", "lost"]
    text: str
    is_cut: bool = False


class Model(Protocol):
    """An entity of a model, in the frames of one layout. It is made from its settings and its mounting.

    The settings of what is no robot are None. A class may have further methods:
    `check_place(position, velocity)` raises BadValue where a running world cannot have another one, and
    `place_at(view, position, velocity)` sets it there (m, m/s, world frame), for models that can be added;
    `out_of_bounds(numbers)` says what is wrong with a state that no run should come to, empty if nothing is;
    `stir(view)` sets it in motion, for the fixed small run that tells engines apart;
    `derive(view)`, of a rigid model, writes the fields that follow from what the engine has computed, which is finite;
    `is_plausible(numbers, before)` says whether its new, finite state can be: where it may be, within its speed limit
    and its reach. What holds for any rigid body is checked beside it (`world.assembly.body_limits`).
    """

    def body(self) -> Body | None:
        """Return its links and shapes; None of what has none."""

    def place(self, view: WritableView) -> None:
        """Set its fields to what they are at tick 0. All are 0 before, and references -1."""


class Motion(Protocol):
    """How entities go on: one object moves all of a layout that go on so. It is made from a `MotionMounting`.

    `motors` of a class whose `takes_arrays` is True may be an array of shape (entities, motors, 2).
    """

    def move(self, entities: Sequence[Entity], motors: Sequence[Motors], view: SolvingView) -> None:
        """Write the state after a tick of these entities, whose motors are asked for this much.

        `view.numbers` are those at the start of the tick, of all entities, before commands reached them: what these ask
        for is in `motors`. What is written is seen by nobody before the next tick, so that the order in which entities
        are moved, and who else is, changes nothing.
        """


class Rule(Protocol):
    """A rule of the world. It is made from its settings and a `RuleMounting`.

    A class may have further methods: `status(view)`, what is shown of it as a mapping for JSON, and the static
    `text(status)`, the same in words; `marks(before, after)`, which yields what it did between two frames, several
    ticks apart maybe, each as `Marked`. How its kinds of marks look is its `mark_kinds`, each a `MarkKind` by name.
    """

    def apply(self, view: WritableView) -> None:
        """Edit the frame before the tick is solved: every node does the same."""


class EntityRule(Protocol):
    """A rule of one entity. It is made from its settings and its mounting.

    A class may have `marks(before, after)` and `mark_kinds`, as a rule of the world may. It is asked about frames that
    both have the entity. It may have further methods: the static `check(settings, at)`, which raises Misfit where the
    settings do not fit robot or world; `place(view)`, which writes what it has at tick 0; and `has_power(view)`: where
    one of a robot's rules says False at a tick, its drives get none.
    """

    def apply(self, view: WritableView) -> None:
        """Write what follows from the entity's state after the tick; others are seen as they were at its start."""


class Kit(Protocol):
    """A section of the deployment. It is made from its settings and the deployment's world.

    A class may have further methods: the static `check(data)`, which yields what is wrong between settings of plain
    data; `status(frame)` and the static `text(status)`, as a rule has them; and `strays(frame)`, the descriptions of
    entities that are where no run should bring them, for what a model cannot see of a single one.
    """

    def shapes(self) -> tuple[Shape, ...]:
        """Return its scenery."""

    def physics(self) -> Physics | None:
        """Return what rigid bodies feel; None of a kit without any."""

    def findings(self) -> Iterator[Finding]:
        """Yield what is wrong with places: what needs all single settings to be right."""


def mounting_of(spec: WorldSpec, layout: Layout, entity: Entity) -> Mounting:
    """Return what the model of an entity is made with."""
    return Mounting(spec, layout, entity, "", draw_key(spec.seed, "model", entity.name), frozenset(entity.fields))


@dataclass(frozen=True, slots=True)
class MotionMounting:
    """What a motion moves: the entities of a layout that go on by it. `writes` are the fields that it may write."""

    spec: WorldSpec
    layout: Layout
    name: str
    entities: tuple[Entity, ...]
    writes: frozenset[str]

    def settings(self, kind: type[S]) -> dict[int, S]:
        """Return the settings of what is moved, which are of this class, by index."""
        found: dict[int, S] = {}
        for entity in self.entities:
            settings = self.spec.settings_of(entity.name)
            assert isinstance(settings, kind), f"the motion {self.name} moves what has a {kind.__name__}"
            found[entity.index] = settings
        return found

    def slot(self, entity: Entity, field: str) -> Slot:
        """Return a slot of the motion itself on an entity, else a field of the entity."""
        own = f"motion.{field}"
        name = own if own in entity.offsets else field
        return Slot(
            entity.offsets[name],
            entity.counts[name],
            f"{entity.name} {name}",
            name is own or field in self.writes,
        )


@dataclass(frozen=True, slots=True)
class RuleMounting:
    """Where a rule of the world is: in which world, under which name, and the key of its draws.

    `writes` are the models whose state it may change.
    """

    spec: WorldSpec
    layout: Layout
    name: str
    key: bytes
    writes: frozenset[str]

    def slot(self, field: str) -> Slot:
        """Return what the rule itself remembers of the world."""
        return self._slot(self.layout[WORLD], f"{self.name}.{field}", is_own=True)

    def of(self, entity: Entity, field: str) -> Slot:
        """Return what the rule remembers of an entity, else a field of the entity."""
        own = f"{self.name}.{field}"
        if own in entity.offsets:
            return self._slot(entity, own, is_own=True)
        return self._slot(entity, field, is_own=entity.model in self.writes)

    def _slot(self, entity: Entity, name: str, *, is_own: bool) -> Slot:
        return Slot(entity.offsets[name], entity.counts[name], f"{entity.name} {name}", is_own)
