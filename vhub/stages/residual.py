"""Residual loss: losses that the geometry does not explain, singly or in bursts.

Bursts are a state: of time (all flows on a link see the same outages) or of the packets one after the other. Sources:
Gilbert (1960) and Elliott (1963); Salsano, Ludovici and Ordine, "Definition of a general and intuitive loss model for
packet networks" (2009) for the four states. All verdicts compare integers.
"""

from __future__ import annotations

from typing import Final

from foosim.common.keyed_random import UNIT, Slot, chance_threshold, draw_key
from foosim.deployment.network.impairments import Burst, GilbertElliott, Markov4
from foosim.vhub.network.good_bad_periods import Episodes
from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.network.memory import LinkState
from foosim.vhub.network.packet import Flight
from foosim.vhub.stages.explanation import Explanation, Seen, beside
from foosim.vhub.stages.stage import Stage

_LOSS: Final = int(Slot.LOSS)
RANDOM_LOSS: Final = "random_loss"
BURST_LOSS: Final = "burst_loss"
CHAIN_BLOCK: Final = 1
"""The block of a packet's draws whose first word moves the Markov chain."""
GOOD: Final = 0
BAD: Final = 1
"""The states of two; of four they are the good one and a burst, so that an event may change one model to the other."""
BETWEEN: Final = 2
SINGLE: Final = 3
"""Of four states: a delivery within a burst, and a single loss. Of two these are good."""


class Residual(Stage):
    """Independent losses, those of outages, and those of a state of a subclass."""

    def __init__(self, setup: LinkSetup, good_loss: float = 0.0, bad_loss: float = 0.0) -> None:
        loss = setup.settings.loss
        self._setup = setup
        self._burst = chance_threshold(good_loss), chance_threshold(bad_loss)
        self._any = tuple(chance_threshold(state + (1.0 - state) * loss) for state in (good_loss, bad_loss))
        self._outages: Episodes | None = None
        if (outages := setup.settings.outages) is not None:
            self._outages = setup.times.of(_time_key(setup, "outages"), outages.mean_on_ns, outages.mean_off_ns)

    def is_bad(self, flight: Flight) -> bool:
        """Whether the packet meets the link in its bad state."""
        return False

    def at_sending(self, flight: Flight) -> str:
        bad = flight.is_bad = self.is_bad(flight)
        if self._outages is not None and self._outages.is_bad(flight.sent_ns):
            flight.is_bad = True
            return BURST_LOSS
        word = flight.words[_LOSS]
        if word >= self._any[bad]:
            return ""
        return BURST_LOSS if word < self._burst[bad] else RANDOM_LOSS

    def explain(self, seen: Seen, note: Explanation) -> None:
        if self._outages is not None and self._outages.is_bad(seen.row.sent_ns):
            note.add("an outage, in which all is lost", outage=True)
            return
        threshold, draw = self._any[seen.row.is_bad], seen.flight.words[_LOSS]
        note.add("{state} state", state="bad" if seen.row.is_bad else "good")
        note.add(", loss {}", beside(draw, threshold), loss_rate=threshold / UNIT, loss_draw=draw / UNIT)


class InTime(Residual):
    """Bad times of a link, the same for all its packets."""

    def __init__(self, setup: LinkSetup, episodes: Episodes, bad_loss: float) -> None:
        super().__init__(setup, 0.0, bad_loss)
        self._episodes = episodes

    def is_bad(self, flight: Flight) -> bool:
        return self._episodes.is_bad(flight.sent_ns)


class ByPacket(Residual):
    """Two states, good and bad, that change from packet to packet."""

    def __init__(self, setup: LinkSetup, p: float, r: float, good_loss: float, bad_loss: float) -> None:
        super().__init__(setup, good_loss, bad_loss)
        self._memory: LinkState = setup.memory
        self._leaves = chance_threshold(p), chance_threshold(r)

    def is_bad(self, flight: Flight) -> bool:
        memory = self._memory
        state = BAD if memory.chain == BAD else GOOD
        if self._setup.words(flight, CHAIN_BLOCK)[0] < self._leaves[state]:
            state = BAD - state
        memory.chain = state
        return state == BAD


class FourStates(Residual):
    """Good, a burst, a delivery within a burst, a single loss: lost is what meets the second or the last."""

    def __init__(self, setup: LinkSetup, chain: Markov4) -> None:
        super().__init__(setup, 0.0, 1.0)
        self._memory: LinkState = setup.memory
        self._steps: tuple[tuple[tuple[float, int], ...], ...] = (
            ((chain.p14, SINGLE), (chain.p13, BAD)),
            ((chain.p31, GOOD), (chain.p32, BETWEEN)),
            ((chain.p23, BAD),),
            ((1.0, GOOD),),
        )

    def is_bad(self, flight: Flight) -> bool:
        memory = self._memory
        word, below = self._setup.words(flight, CHAIN_BLOCK)[0], 0.0
        for chance, state in self._steps[memory.chain]:
            below += chance
            if word < chance_threshold(min(1.0, below)):
                memory.chain = state
                break
        return memory.chain in {BAD, SINGLE}


def chain_of_burst(burst: Burst) -> GilbertElliott:
    """Return p and r with which the mean loss and the mean number of losses in a row are the configured ones.

    With L the loss, e that in the bad state and b the mean run: r = 1 - (1 - 1/b) / e, p = r share / (1 - share) where
    share = L / e. Source: the stationary distribution of the chain.
    """
    assert burst.mean_burst is not None
    share = burst.loss / burst.bad_loss
    r = 1.0 - (1.0 - 1.0 / burst.mean_burst) / burst.bad_loss
    p = min(1.0, r * share / (1.0 - share))
    return GilbertElliott.model_construct(p=p, r=r, h=1.0 - burst.bad_loss, k=1.0)


def make_residual(setup: LinkSetup) -> Residual | None:
    """Return the stage of a link; None where nothing is lost."""
    settings = setup.settings
    chain = settings.gilbert_elliott
    if settings.burst is not None and settings.burst.mean_burst is not None:
        chain = chain_of_burst(settings.burst)
    if chain is not None:
        return ByPacket(setup, chain.p, chain.r, 1.0 - chain.k, 1.0 - chain.h)
    if settings.markov4 is not None:
        return FourStates(setup, settings.markov4)
    burst = settings.burst
    if burst is not None:
        return InTime(setup, setup.times.of_burst(_time_key(setup, "burst"), burst), burst.bad_loss)
    return Residual(setup) if settings.loss > 0.0 or settings.outages is not None else None


def _time_key(setup: LinkSetup, what: str) -> bytes:
    """Return the key of the lengths of a link's times."""
    return draw_key(int.from_bytes(setup.draws.key[:8], "little"), what)
