"""What the stages of one link are made from."""

from __future__ import annotations

from dataclasses import dataclass, field

from foosim.protocol.draws import draw_words
from foosim.protocol.radios import Radio
from foosim.vhub.air import Air
from foosim.vhub.budget import Budget
from foosim.vhub.episodes import Times
from foosim.vhub.link_models import LinkModel
from foosim.vhub.memory import LinkState, RadioState
from foosim.vhub.packet import Flight
from foosim.vhub.world import World

BLOCK_SHIFT = 32
"""Further draws of a packet: the number of their block stands above that of the copy."""


@dataclass(frozen=True, slots=True)
class LinkSetup:
    """One directed link: its ends, its settings at a time, and what it remembers and shares."""

    source: str
    destination: str
    settings: Radio
    radio: str
    key: bytes
    """Of its draws."""
    sending_key: bytes
    """Of the draws of what its sender's radio sends once for several receivers."""
    memory: LinkState
    times: Times
    """Its bursts and outages in seconds."""
    sender: RadioState
    """The radio, or the port of a wire, that its packets leave by."""
    world: World
    is_routed: bool = True
    """Whether there is a way at all: two that have radios need one in common."""
    air: Air | None = None
    budget: Budget | None = None
    """How a signal reaches the receiver; None on what is no radio."""
    cuts: tuple[tuple[int, int], ...] = ()
    holds: tuple[tuple[int, int], ...] = ()
    """Times in which it is cut, and in which it is clogged."""
    in_flight_dropped: bool = True
    table: tuple[int, ...] = ()
    """The content of the file of a jitter that has one."""
    opportunities_ms: tuple[int, ...] = ()
    """The times of a trace of capacity."""
    model: LinkModel | None = None
    """A link model of one's own."""
    faults: list[str] = field(default_factory=list)
    """Takes why such a model has failed: the run ends for it."""
    own: Radio | None = None
    """What the sender's radio says by itself, which holds for what it sends once for all; None where nothing does."""

    def words(self, flight: Flight, block: int) -> tuple[int, ...]:
        """Return a further block of eight draws of a packet; block 0 are those of the named slots."""
        return draw_words(self.key, flight.sequence, flight.copy | block << BLOCK_SHIFT)

    @property
    def is_radio(self) -> bool:
        return self.settings.is_on_air

    @property
    def shared(self) -> Radio:
        """The settings for what is sent once for several receivers: no rule of one of them changes those."""
        return self.settings if self.own is None else self.own

    @property
    def sends_once(self) -> bool:
        """Whether a broadcast is sent once for all its receivers; a base station sends to each by itself."""
        return self.is_radio and self.settings.published == "broadcast" and self.settings.medium != "lte"
