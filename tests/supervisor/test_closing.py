"""A run that has ended waits for its capture as long as there is progress; one that is cut off is an error."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.common.units import Pace
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings, System
from foosim.vhub.core import HubCore
from foosim.world.frame import Frame

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
S: Final = 1_000_000_000


class Slow:
    """A vHub that takes long to close its capture: rows are written until `stalls_s`, and all are after `takes_s`."""

    def __init__(self, takes_s: float, stalls_s: float = 1e9, capture: str = "run.mcap", syncs_s: float = 0.0) -> None:
        self.syncs_ns = int(syncs_s * S)
        """Until then the disk writes."""
        self.takes_ns, self.stalls_ns, self.capture = int(takes_s * S), int(stalls_s * S), capture
        self.at: dict[float, Callable[[System], object]] = {}
        """What happens when, in s behind the end of the run."""
        self.seen: list[dict[str, Any]] = []
        self.waited: set[str] = set()
        self.committed: Callable[[Frame], None] = lambda frame: None
        self.ended_ns = 0

    def __call__(self, hub: HubCore, passed_ns: int) -> bool:
        if not self.ended_ns:
            self.ended_ns = self.system.bus.now_ns
            for at_s, do in self.at.items():
                self.system.later(int(at_s * S), partial(do, self.system))
        hub.shell.capture = self.capture
        hub.shell.recording = {"state": "closing", "problem": "", "written": min(passed_ns, self.stalls_ns) // (S // 2)}
        hub.shell.disk_progress = min(passed_ns, self.syncs_ns) // (S // 2)
        self.waited |= {hub.waiting_for}
        told = self.system.supervisor.status(0)
        self.seen.append({"written": told["recording"]["written"], "waits": told["processes"][VHUB]["waiting_for"]})
        return passed_ns >= self.takes_ns

    def run(self, ticks: int = 10, pace: Pace | None = None) -> dict[str, Any]:
        def prepare(system: System) -> None:
            self.system = system

        settings = Settings(closing=self, on_commit=self.committed)
        rehearse(TABLE.read_text(), TABLE.name, ticks, 1, ["engine=pure"], settings, pace=pace, prepare=prepare)
        self.took_s = (self.system.bus.now_ns - self.ended_ns) / S
        return self.system.supervisor.result()


def test_as_long_as_there_is_progress_it_is_waited_for_and_shown() -> None:
    slow = Slow(takes_s=55)
    found = slow.run()
    assert (found["reason"], found["failed"], found["capture"]) == ("done", False, "run.mcap")
    assert 55 <= slow.took_s < 56
    written = [seen["written"] for seen in slow.seen]
    assert written == sorted(written) and len(set(written)) > 100 and slow.seen[-1]["waits"] == "capture"


@pytest.mark.parametrize("until_s", [1000, 20])
def test_a_disk_that_goes_on_is_progress_while_no_row_is_written(until_s: int) -> None:
    """One `fdatasync` takes longer than deadlines.close: the disk's account moves; when it stands, it is cut off."""
    slow = Slow(takes_s=55, stalls_s=5, syncs_s=until_s)
    found = slow.run()
    assert found["failed"] == (until_s == 20)
    assert (55 <= slow.took_s < 56) if until_s == 1000 else (50 <= slow.took_s < 51)


@pytest.mark.parametrize("capture", ["run.mcap", ""])
def test_without_progress_it_is_cut_off_which_is_an_error_where_there_is_a_capture(capture: str) -> None:
    slow = Slow(takes_s=1000, stalls_s=20, capture=capture)
    found = slow.run()
    assert 50 <= slow.took_s < 51, "20 s, and deadlines.close"
    if not capture:
        assert (found["reason"], found["failed"], found["capture"]) == ("done", False, None)
        return
    why = "its vHub has made no progress in closing it for 30 s (deadlines.close)"
    assert found["reason"] == f"done; the capture is cut off: {why}"
    assert found["failed"] and found["capture"] == "run.mcap"


def test_a_vhub_that_ends_while_it_closes_its_capture_cuts_it_off() -> None:
    def kill(system: System) -> None:
        system.leave(VHUB)
        system._supervisor_sees_gone(VHUB)

    slow = Slow(takes_s=1000)
    slow.at[15] = kill
    found = slow.run()
    assert found["reason"] == "done; the capture is cut off: its vHub ended before it was closed"
    assert found["failed"] and 15 <= slow.took_s < 17


def test_a_vhub_that_was_gone_before_the_end_and_is_back_cuts_nothing_off() -> None:
    """Its connection was lost while the world ran, and behind the end for as long as the deadline allows."""

    slow = Slow(takes_s=55)

    def saw(frame: Frame) -> None:
        if frame.tick == 50:
            slow.system.later(0, partial(slow.system._supervisor_sees_gone, VHUB))

    slow.committed = saw
    slow.at[20] = lambda system: system._supervisor_sees_gone(VHUB)
    found = slow.run(ticks=700, pace=Pace("realtime"))
    assert [recovery["name"] for recovery in found["recoveries"]] == ["vhub"]
    assert (found["reason"], found["failed"], found["capture"]) == ("done", False, "run.mcap")
    assert 55 <= slow.took_s < 56


def test_a_supervisor_that_stood_still_meanwhile_cuts_nothing_off() -> None:
    """It hears of no progress for 100 s, and then that the connection has ended and is there again."""
    slow = Slow(takes_s=55)
    slow.at[10] = lambda system: system.set_forward(SUPERVISOR, 100 * S)
    slow.at[20] = lambda system: system.pause(SUPERVISOR, 31 * S)
    slow.at[51.1] = lambda system: system._supervisor_sees_gone(VHUB)
    found = slow.run()
    assert (found["reason"], found["failed"], found["capture"]) == ("done", False, "run.mcap")
    assert 55 <= slow.took_s < 56


def test_the_time_of_its_last_progress_rests_as_well() -> None:
    """Not only that of the end, which is far behind."""
    slow = Slow(takes_s=55)
    slow.at[45.2] = lambda system: system.set_forward(SUPERVISOR, 100 * S)
    assert slow.run()["reason"] == "done"
