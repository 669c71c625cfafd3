"""The network of a deployment: the radios of endpoints, the rules of links, and events.

A link is a directed pair of endpoints; `between` writes both directions. The first rule that matches the pair (and the
channel, where the rule names channels) is the link's; what it does not write comes from the radio that it goes `via`,
or from the first one that both ends carry. Without rule and radio a link is as `defaults` say: perfect.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Annotated, Final, Literal

from pydantic import BeforeValidator, Field, PlainValidator, StringConstraints

from foosim.common import names, units
from foosim.common.errors import BadValue
from foosim.common.spec_base import Name, SpecBase, default
from foosim.common.units import Quantity, custom_error
from foosim.deployment.network.impairments import Delay, Impairments, LinkSettings
from foosim.deployment.network.radios import PresetName, Radio, Site

LINK_RULES_MAX: Final = 512
RADIOS_MAX: Final = 64
EVENTS_MAX: Final = 4096
SELECTORS_MAX: Final = 16
"""Selectors on one side of a link rule."""
REST: Final = "rest"
"""In a partition: all endpoints outside the other groups."""

Selector = Annotated[str, StringConstraints(pattern=names.SELECTOR_PATTERN, max_length=names.SELECTOR_LENGTH_MAX)]
Moment = Annotated[int, Quantity(units.TIME, "0 s", "10000 h")]


Selectors = Annotated[
    list[Selector],
    BeforeValidator(
        lambda value: [value] if isinstance(value, str) else value, json_schema_input_type=Selector | list[Selector]
    ),
    Field(min_length=1, max_length=SELECTORS_MAX),
]


def selects(globs: Sequence[str], name: str) -> bool:
    """Whether one of the selectors matches a name."""
    return any(fnmatchcase(name, glob) for glob in globs)


class LinkRule(LinkSettings):
    """The settings of the directed links between the endpoints that `from` and `to` select.

    Omitted keys have the values of the radio.
    """

    id: Name
    from_: Selectors | None = Field(default=None, alias="from")
    to: Selectors | None = None
    between: Annotated[list[Selector], Field(min_length=2, max_length=2)] | None = None
    channels: Selectors | None = None
    via: Name | None = None

    @property
    def selectors(self) -> tuple[str, ...]:
        """Those of both ends."""
        return (*(self.from_ or ()), *(self.to or ()), *(self.between or ()))

    def matches(self, source: str, destination: str, channel: str | None = None) -> bool:
        """True if a packet from source to destination (on channel) is this rule's; None is any channel."""
        if self.channels is not None and channel is not None and not selects(self.channels, channel):
            return False
        if self.between is not None:
            one, other = self.between
            return (fnmatchcase(source, one) and fnmatchcase(destination, other)) or (
                fnmatchcase(source, other) and fnmatchcase(destination, one)
            )
        return selects(self.from_ or (), source) and selects(self.to or (), destination)


# --- events -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Lasting:
    """How long something lasts: this time, or a random one with this mean (exponential)."""

    ns: int
    is_random: bool = False


_DURATION: Final = Quantity(units.TIME, "1 us", "10000 h")


def _lasting(value: object) -> Lasting:
    if isinstance(value, dict) and set(value) == {"exponential"}:
        return Lasting(int(_DURATION.read(value["exponential"])), is_random=True)
    if isinstance(value, dict):
        raise custom_error(BadValue("not a time or {exponential: MEAN}", next(iter(value), value)))
    return Lasting(int(_DURATION.read(value)))


Lasts = Annotated[Lasting, PlainValidator(_lasting, json_schema_input_type=str | dict[Literal["exponential"], str])]


def _groups(value: object) -> object:
    """At least two, of which one is parted from the other."""
    if isinstance(value, list) and len(value) < 2:
        raise custom_error(BadValue("fewer than two groups, as in [[a, b], [rest]]", value))
    return value


class Clog(SpecBase):
    """Packets from one to the other wait until the clog is over."""

    from_: Selectors = Field(alias="from")
    to: Selectors


class Change(Impairments):
    """New settings of one link rule; other settings stay."""

    link: Name


class Event(SpecBase):
    """An event of the network `at` a simulated time, with exactly one of the actions.

    Partitions and clogs last `for` a time or `until` one, else to the next heal. With `symmetric` off only what
    goes from the first group to the others is cut.
    """

    at_ns: Moment = Field(alias="at")
    lasts: Lasts | None = Field(default=None, alias="for")
    until_ns: Moment | None = Field(default=None, alias="until")
    partition: Annotated[list[Selectors], Field(min_length=2, max_length=64), BeforeValidator(_groups)] | None = None
    symmetric: bool = True
    clog: Clog | None = None
    set: Change | None = None
    heal: Literal["all", "partitions", "clogs", "settings"] | None = None


def event_of(text: str, at_ns: int) -> Event:
    """Return the event that JSON without a time describes, at a time; raises ValueError (pydantic's) for none."""
    return Event.model_validate({**json.loads(text), "at": f"{at_ns} ns"})


ACTIONS: Final = ("partition", "clog", "set", "heal")


class Defaults(SpecBase):
    """What holds where nothing else is written."""

    preset: PresetName = "perfect"
    in_flight_on_partition: Literal["drop", "deliver"] = "drop"
    """What becomes of a packet that is on its way when a partition between its ends begins."""
    phase_ns: Delay = default("0 s", "phase")
    """The spread of radios' clocks: the packets of each radio reach it later by its own time, at most this.

    Without it all that is sent at one tick is sent at the same instant, and contends."""


class Network(SpecBase):
    """Radios and their carriers, the rules of links, and events; a pair without rule and radio is a default link."""

    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] | None = None
    """Of the draws of links and events; by default the deployment's."""
    defaults: Defaults = Field(default_factory=Defaults)
    radios: dict[Name, Radio] = Field(default={}, max_length=RADIOS_MAX)
    robots: dict[Selector, Annotated[list[Name], Field(max_length=16)]] = Field(default={}, max_length=LINK_RULES_MAX)
    """The radios of the endpoints that each selector matches; the first selector that matches is an endpoint's."""
    places: dict[Selector, Site] = Field(default={}, max_length=LINK_RULES_MAX)
    """Where endpoints without a body are (x, y, z in the world)."""
    links: list[LinkRule] = Field(default=[], max_length=LINK_RULES_MAX)
    events: list[Event] = Field(default=[], max_length=EVENTS_MAX)

    def place_of(self, endpoint: str) -> Site | None:
        """The place that is written for an endpoint."""
        return next((place for glob, place in self.places.items() if fnmatchcase(endpoint, glob)), None)
