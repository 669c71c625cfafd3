"""The canonical layout of a frame: which entity, in name order, keeps which numbers where.

An entity's slots stand in one run of float64 numbers: first what its solver writes (body, flags, contact log, rules'
and actuators' memory), then what its owner writes (the memory of its sensors). A layout is a pure function of the
deployment and of what was added since, so every process builds the same one and its digest names it.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from typing import Final

from foosim.common.errors import Malformed
from foosim.world.spec import WorldSpec

WORLD: Final = "world"
"""Name of a table's entity that has no body: score and the rules' memory."""

_BODY = (("position", 3), ("orientation", 4), ("linear_velocity", 3), ("angular_velocity", 3))
_CONTACTS = ("contacts", 3)
_SOLVER_FIELDS: Final[Mapping[str, tuple[tuple[str, int], ...]]] = {
    "ball": (*_BODY, ("quarantined", 1), _CONTACTS, ("still_ticks", 1), ("out_ticks", 1), ("wait_ticks", 1)),
    "rod": (
        ("joint_positions", 2),
        ("joint_velocities", 2),
        ("quarantined", 1),
        ("down", 1),
        _CONTACTS,
        ("set_point", 2),
        ("refused", 1),
    ),
    "camera": (("down", 1), ("refused", 1)),
    "world": (("score", 2), ("kickoffs", 1)),
    "rover": (
        ("position", 3),
        ("orientation", 4),
        ("heading", 1),
        ("wheel_speeds", 2),
        ("wheel_travel", 2),
        ("blocked", 1),
        ("quarantined", 1),
        ("down", 1),
        ("set_point", 2),
        ("charge", 1),
        ("refused", 1),
    ),
    "station": (("down", 1), ("refused", 1)),
}
"""The slots that the solver writes, by model. `contacts` is (count, impulse in N s, last substep or -1) of the tick;
`set_point` is the actuator's (a rod's slide in m and spin in rad; rim speeds of a rover's left and right wheel in m/s);
`refused` counts packets that the robot refused; `still_ticks`, `out_ticks` and `wait_ticks` are the memory of the rules
about dead balls, balls off the table and kick-off. `wheel_speeds` are rim speeds (m/s), `wheel_travel` how far the
wheels have turned (m), `blocked` whether an obstacle stopped it in the tick, `charge` its energy in J. Orientations
are quaternions x, y, z, w; positions and velocities are in the world frame, SI units."""

BODIES: Final = frozenset({"ball", "rod", "rover"})
ROBOTS: Final = frozenset({"rod", "camera", "rover", "station"})
ADDABLE: Final = frozenset({"ball"})
"""Models of which a running world can have more."""
BALL: Final = "ball"
"""Name of the ball that every table has, and no hall; further ones have other names and can be removed again."""


@dataclass(frozen=True)
class Entity:
    """One entry of a layout. `start` to `split` are the solver's slots, `split` to `stop` the owner's."""

    index: int
    name: str
    model: str
    start: int
    split: int
    stop: int
    offsets: Mapping[str, int]

    @property
    def has_body(self) -> bool:
        return self.model in BODIES

    @property
    def is_robot(self) -> bool:
        return self.model in ROBOTS


class Layout:
    """Entities in name order and where their slots are. Two layouts are equal when their digests are."""

    def __init__(self, models: Mapping[str, str], sensors: Mapping[str, Sequence[str]]) -> None:
        """Build from the model of every entity and the names of every robot's sensors (one slot each)."""
        entities = []
        position = 0
        for index, name in enumerate(sorted(models)):
            model = models[name]
            start = position
            offsets: dict[str, int] = {}
            for field, count in _SOLVER_FIELDS[model]:
                offsets[field] = position
                position += count
            split = position
            for sensor in sorted(sensors.get(name, ())):
                offsets[f"sampled.{sensor}"] = position
                position += 1
            entities.append(Entity(index, name, model, start, split, position, offsets))
        self.entities: tuple[Entity, ...] = tuple(entities)
        self.size = position
        self.models = dict(models)
        self.sensors = {name: tuple(sorted(channels)) for name, channels in sensors.items()}
        self._index = {entity.name: entity for entity in entities}
        self.robots = tuple([entity for entity in entities if entity.is_robot])
        """Entities that have an owner, in name order."""
        self.balls, self.rods, self.rovers = self._of("ball"), self._of("rod"), self._of("rover")
        self._digest = b""

    def _of(self, model: str) -> tuple[Entity, ...]:
        return tuple([entity for entity in self.entities if entity.model == model])

    def __getitem__(self, name: str) -> Entity:
        return self._index[name]

    def __contains__(self, name: object) -> bool:
        return name in self._index

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(entity.name for entity in self.entities)

    @property
    def digest(self) -> bytes:
        """BLAKE2b, 32 bytes, of every entity's name, model and slots."""
        if not self._digest:
            hasher = blake2b(digest_size=32)
            for entity in self.entities:
                for text in (entity.name, entity.model, *entity.offsets):
                    raw = text.encode()
                    hasher.update(struct.pack("<I", len(raw)) + raw)
                hasher.update(struct.pack("<3Q", entity.start, entity.split, entity.stop))
            self._digest = hasher.digest()
        return self._digest


def build_layout(spec: WorldSpec, added: Iterable[tuple[str, str]] = ()) -> Layout:
    """Return the layout of a deployment's world with `added` (name, model) entities, or raise `Malformed`."""
    models = {} if spec.is_hall else {BALL: "ball", WORLD: "world"}
    sensors: dict[str, Sequence[str]] = {}
    for name, robot in spec.robots.items():
        models[name] = robot.model
        sensors[name] = tuple(robot.sensors)
    for name, model in added:
        if spec.is_hall:
            raise Malformed(f"{model} {name} cannot be added: nothing can be to a hall")
        if model not in ADDABLE or name in models:
            raise Malformed(f"{model} {name} cannot be added: {' or '.join(sorted(ADDABLE))} with a free name can be")
        models[name] = model
    return Layout(models, sensors)
