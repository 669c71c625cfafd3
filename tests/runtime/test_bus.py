"""What the bus and the clocks of a rehearsal do to processes: cuts one way, clogs, old messages, healing."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foosim.protocol import channels
from foosim.runtime.roles.bus import LATE_NS, Bus, Weather
from foosim.simulation.settings import Clock

NOW_NS = 1_000
UNTIL_NS = 5_000


def arrivals(bus: Bus) -> list[tuple[int, str]]:
    """Return when what is on its way reaches whom."""
    came = []
    while not bus.is_empty:
        at_ns, _, receiver, *_ = bus.pop()
        came.append((at_ns, receiver))
    return came


@pytest.fixture
def bus() -> Bus:
    bus = Bus()
    for name in ("n1", "n2"):
        bus.subscribe(name, channels.NODE_READS)
    return bus


def say(bus: Bus, *names: str) -> list[tuple[int, str]]:
    """Let nodes say a part each; return when whom it reaches."""
    for name in names:
        bus.put(name, channels.PART, name, b"", NOW_NS)
    return arrivals(bus)


def test_a_process_is_cut_off_one_way_or_both(bus: Bus) -> None:
    assert say(bus, "n1", "n2") == [(NOW_NS, "n2"), (NOW_NS, "n1")]
    bus.cut_off("n1", UNTIL_NS, input_=False)
    assert say(bus, "n1", "n2") == [(NOW_NS, "n1")]
    bus.heal()
    bus.cut_off("n1", UNTIL_NS, output=False)
    assert say(bus, "n1", "n2") == [(NOW_NS, "n2")]
    bus.cut_off("n1", UNTIL_NS)
    assert say(bus, "n1", "n2") == []
    bus.heal()
    assert len(say(bus, "n1", "n2")) == 2


def test_what_is_clogged_waits_and_is_not_lost(bus: Bus) -> None:
    bus.clog("n1", UNTIL_NS)
    assert say(bus, "n1", "n2") == [(UNTIL_NS, "n2"), (UNTIL_NS, "n1")]
    bus.heal()
    assert say(bus, "n1", "n2") == [(NOW_NS, "n2"), (NOW_NS, "n1")]


def test_what_is_said_comes_once_more_late(bus: Bus) -> None:
    bus.repeat_until(UNTIL_NS)
    first, second = say(bus, "n1")
    assert first == (NOW_NS, "n2") and NOW_NS < second[0] < NOW_NS + LATE_NS and second[1] == "n2"
    bus.repeat_until(NOW_NS)
    assert len(say(bus, "n1")) == 1


def test_healed_nothing_is_lost_or_late() -> None:
    bus = Bus(Weather(seed=1, delay_ns=10, spread_ns=10, loss=1.0))
    bus.subscribe("n2", channels.NODE_READS)
    assert say(bus, "n1") == []
    bus.heal()
    assert say(bus, "n1") == [(NOW_NS, "n2")]


@given(offset_ns=st.integers(0, 10**13), drift_ppm=st.integers(-1000, 1000), virtual_ns=st.integers(0, 10**12))
def test_a_clock_tells_when_it_will_show_a_time(offset_ns: int, drift_ppm: int, virtual_ns: int) -> None:
    clock = Clock(offset_ns, drift_ppm)
    shown_ns = clock.at(virtual_ns)
    when_ns = clock.when(shown_ns)
    assert clock.at(when_ns) >= shown_ns and when_ns <= virtual_ns + 2
    assert clock.at(virtual_ns + 10_000) > shown_ns, "it never goes back"
