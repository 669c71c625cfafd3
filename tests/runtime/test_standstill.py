"""How a loop finds that it stood still, and what a process that is alone makes of it."""

from __future__ import annotations

import logging
from types import SimpleNamespace
from typing import Any, Final

import pytest

from foosim.runtime.roles import loop as loops
from foosim.runtime.roles.loop import Loop
from foosim.runtime.roles.role import Role
from foosim.runtime.roles.standstill import STOOD_NS, Standstill, standstill_text
from foosim.runtime.supervisor_timeout import UNKNOWN_NS, SupervisorTimeout
from foosim.runtime.transport.inbox import Inbox

MS: Final = 1_000_000
S: Final = 1_000 * MS


def test_only_who_looks_later_than_it_meant_to_has_stood_still() -> None:
    own = Standstill(0)
    assert own.look(100 * MS, 100 * MS) == 0, "in time"
    assert own.look(200 * MS, 150 * MS) == 0, "a message woke it"
    assert own.look(200 * MS, 200 * MS + STOOD_NS) == 0, "as late as any"
    assert own.look(300 * MS, 4_300 * MS) == 4_000 * MS, "it was not woken"
    assert own.look(4_310 * MS, 5_300 * MS) == 990 * MS, "its turn took as long"
    assert own.look(0, 5_310 * MS) == 0, "what has been due for long counts from the last look on"


def test_a_process_that_stood_still_waits_for_its_supervisor_as_long_as_it_was_awake() -> None:
    orphan = SupervisorTimeout()
    orphan.rest(5 * S, 5 * S)
    assert not orphan.is_alone
    orphan.hear(False, 10 * S)
    orphan.rest(100 * S, 115 * S)
    assert not orphan.is_over(None, 110 * S + UNKNOWN_NS - 1) and orphan.is_over(None, 110 * S + UNKNOWN_NS)
    orphan.rest(50 * S, 120 * S)
    assert orphan.is_over(None, 120 * S + UNKNOWN_NS), "never longer than from now on"


def test_only_a_long_standstill_is_worth_a_line() -> None:
    assert (
        standstill_text(999 * MS) == ""
        and standstill_text(3_140 * MS) == "event loop was blocked for 3.1 s; peer deadlines extended"
    )


def test_the_loop_tells_of_it_before_anything_else(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, did = [7 * S], list[Any]()
    monkeypatch.setattr(loops, "time", SimpleNamespace(monotonic_ns=lambda: clock[0]))
    core = SimpleNamespace(actions=[], receive=None, wake=lambda now_ns: did.append(("wake", now_ns)))
    inbox = Inbox(10)
    log = logging.getLogger("standstill")
    role = Role("standstill", core, log, lambda now_ns: now_ns + 100 * MS)
    loop = Loop(inbox, log)
    loop.add(role)
    role.stood = lambda stood_ns, now_ns: did.append((stood_ns, now_ns))
    for pass_ms in (0, 100, 4_100):
        clock[0] += pass_ms * MS
        inbox.wake()
        loop.go_round()
    woken = [("wake", at_ns) for at_ns in (7 * S, 7_100 * MS)]
    assert did == [*woken, (4_000 * MS, 11_200 * MS), ("wake", 11_200 * MS)]
