"""The context from which the stages of one link are made."""

from __future__ import annotations

from dataclasses import dataclass, field

from foosim.common.keyed_random import draw_words
from foosim.deployment.network.radios import Radio
from foosim.vhub.line_of_sight.placement import World
from foosim.vhub.network.air import Air
from foosim.vhub.network.custom_models import LinkModel
from foosim.vhub.network.draw_address import DrawKeys
from foosim.vhub.network.good_bad_periods import Times
from foosim.vhub.network.link_budget import Budget
from foosim.vhub.network.memory import LinkState, RadioState
from foosim.vhub.network.packet import Flight

BLOCK_SHIFT = 32
"""Further draws of a packet: the number of their block is in the bits above that of the copy."""


@dataclass(frozen=True, slots=True)
class LinkSetup:
    """One directed link: its ends, its settings at a time, its state and the state that it shares."""

    source: str
    destination: str
    settings: Radio
    radio: str
    draws: DrawKeys
    """Keys of its draws."""
    sending: DrawKeys
    """Keys of the draws of its sender's broadcasts."""
    memory: LinkState
    times: Times
    """Its bursts and outages in seconds."""
    sender: RadioState
    """The radio, or the port of a wire, that sends its packets."""
    world: World
    is_routed: bool = True
    """Whether a path exists: two endpoints with radios need one in common."""
    air: Air | None = None
    budget: Budget | None = None
    """Propagation to the receiver; None without radios."""
    cuts: tuple[tuple[int, int], ...] = ()
    holds: tuple[tuple[int, int], ...] = ()
    """Times of its cuts, and of its clogs."""
    in_flight_dropped: bool = True
    jitter_ns: tuple[int, ...] = ()
    """The quantiles of its jitter (`jitter.jitter_ns`); none without one."""
    opportunities_ms: tuple[int, ...] = ()
    """The times of a trace of capacity."""
    model: LinkModel | None = None
    """A custom link model."""
    faults: list[str] = field(default_factory=list)
    """Called with the failure of such a model, which ends the run."""
    own: Radio | None = None
    """The settings of the sender's radio, for its broadcasts; None without them."""

    def words(self, flight: Flight, block: int) -> tuple[int, ...]:
        """Return a further block of eight draws of a packet; block 0 are those of the named slots."""
        return draw_words(self.draws.of(flight.channel), flight.draw, flight.copy | block << BLOCK_SHIFT)

    @property
    def is_radio(self) -> bool:
        return self.settings.is_on_air

    @property
    def shared(self) -> Radio:
        """The settings for broadcasts, which no rule of a single receiver changes."""
        return self.settings if self.own is None else self.own
