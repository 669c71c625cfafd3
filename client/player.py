"""Players: the base class of a controller, its inputs and its outputs.

The deployment names a player's class as `module:Class`, with a rate, the robots that it may command and hear, and
parameters. `client.playing` runs it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, nan
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from msgspec import Struct
from mypy_extensions import mypyc_attr

from foosim.common import limits
from foosim.common.errors import BadValue
from foosim.common.names import NAME_RULE, is_name
from foosim.world.component_types.payloads import Value

if TYPE_CHECKING:
    from foosim.deployment.schema import Deployment


class Packet(NamedTuple):
    """A packet to send: opaque `payload` to a robot's (or another client's) `channel`.

    An empty `destination` is a broadcast to all subscribers of this client's `channel`.
    """

    destination: str
    channel: str
    payload: bytes


class Sample(NamedTuple):
    """One packet of an endpoint's channel: its value, and when it was sent and due (simulated ns).

    `joints` are the names of the joints that the numbers of a reading of joints are of, in their order.
    """

    source: str
    channel: str
    sequence: int
    sent_ns: int
    due_ns: int
    value: Value
    joints: tuple[str, ...] = ()

    def by_joint(self, field: str) -> dict[str, float]:
        """Return the numbers of a field of a reading of joints, as `positions`, by the names of the joints.

        Raises BadValue for another reading or field.
        """
        numbers = getattr(self.value, field, None)
        if not self.joints or not isinstance(numbers, tuple) or len(numbers) != len(self.joints):
            raise BadValue(f"{self.source}/{self.channel} has no number for each joint in its field", field)
        return dict(zip(self.joints, numbers, strict=True))


Samples: TypeAlias = Mapping[tuple[str, str], Sample]
"""The newest sample of each (endpoint, channel) so far; a channel without one is absent."""
Command: TypeAlias = Struct | Mapping[str, Any] | Sequence[Any]
"""A command of a robot: numbers by name, `{"slide": 0.05, "spin": 0.0}`, or in their order, or the command's own type.
Of a robot with several actuators, commands by actuator: `{"drive": {...}, "arm": {...}}`."""
Commands: TypeAlias = Mapping[str, Command]
"""Commands by robot; a robot without one keeps its last command."""


@dataclass(frozen=True, slots=True)
class Turn:
    """Result of a player that also sends packets, in their order, or reports metrics, beside its commands."""

    commands: Commands
    packets: Sequence[Packet] = ()
    metrics: dict[str, float] = field(default_factory=dict)
    """What `report` was called with."""

    def report(self, name: str, value: float) -> None:
        """Report a metric, a number of the run's result: the last value of each name is in it. A bool is 0 or 1.

        No packet carries it, so that the network is the same with and without it. Raises BadValue for an invalid name,
        and for a value other than a finite number.
        """
        self.metrics[name] = metric_of(name, value)


def metric_of(name: object, value: object) -> float:
    """Return the value of a metric as a number. Raises BadValue as `Turn.report`."""
    if not isinstance(name, str) or not is_name(name):
        raise BadValue(f"not a name of a metric: {NAME_RULE}", name)
    try:
        number = nan if isinstance(value, str | bytes) else float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        number = nan
    if not isfinite(number):
        raise BadValue(f"metric {name} is no finite int, float or bool", value)
    return number


def keep_metrics(kept: dict[str, float], new: Mapping[str, float]) -> None:
    """Add metrics to the earlier ones of the same client. Raises BadValue for too many names."""
    if len(kept.keys() | new.keys()) > limits.METRICS_MAX:
        raise BadValue(f"a client reports at most {limits.METRICS_MAX} metrics; one more is", [*new][-1])
    kept.update(new)


@mypyc_attr(allow_interpreted_subclasses=True)
class Player:
    """A controller: derive from it and override its hooks. It sees packets only: samples are as old as the network
    made them, and some never come.

    It exists while one of its robots is in the world. When the last one is removed it is not called any more; when one
    is added, another player is created, which has received nothing.
    """

    robots: tuple[str, ...] = ()
    """The names of its robots that are present, in order: set before each call of `act`."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        """Called with the checked deployment and the player's `parameters` in it."""

    def act(self, tick: int, samples: Samples) -> Commands | Turn:
        """Return commands at `tick`, or a Turn that has packets, too.

        Equal calls in equal order must give equal results: use no clock, no dice.
        """
        return {}
