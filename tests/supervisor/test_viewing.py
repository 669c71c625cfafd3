"""Who looks at a run: what a lease brings, when, and that nobody else notices. In rehearsal, on virtual time."""

from __future__ import annotations

import base64
from typing import Any

import pytest

from foosim.common import limits
from foosim.common.json_text import decode_json, encode_json
from foosim.common.units import Pace
from foosim.deployment.loader import load_deployment
from foosim.protocol import channels
from foosim.protocol.actions import Publish
from foosim.protocol.codec import decode, encode
from foosim.protocol.messages import Answer, Commit, Inquiry, Request
from foosim.simulation.system import OPERATOR, Settings, System
from foosim.supervisor.core import SupervisorCore
from foosim.supervisor.records import fold
from foosim.supervisor.settings import RunSettings
from foosim.supervisor.viewing import BYTES_PER_S_MAX
from foosim.world.frame import frame_from_bytes
from foosim.world.layout import build_layout
from tests.supervisor.test_requests import MS, REALTIME, TABLE, TEXT, Run


def shown(run: Run) -> list[Commit]:
    """What people were shown."""
    return [decode(Commit, payload) for payload in run.system.people.viewed]


def result(answer: Answer) -> dict[str, Any]:
    assert answer.accepted, answer.text
    content = decode_json(answer.result)
    assert isinstance(content, dict)
    return content


def test_nobody_looks_and_nothing_is_shown() -> None:
    run = Run(ticks=40).ask_at(20, "status").ask_at(20, "watch").ask_at(20, "watch", hz=0).go()
    assert [answer.accepted for answer in run.answers] == [True] * 3
    assert not shown(run) and channels.VIEW.name not in dict(run.said)


def test_frames_are_shown_at_the_rate_of_the_lease_as_they_were_committed() -> None:
    run = Run(ticks=120, pace=REALTIME).ask_at(20, "watch", hz=50).go()
    assert result(run.answers[0]) == {"hz": 50.0, "lease_s": 5.0}
    ticks = [commit.tick for commit in shown(run)]
    assert ticks[1:-1] == list(range(ticks[1], ticks[-2] + 1, 10)), "a tick takes 2 ms"
    assert len(ticks) == pytest.approx(100 / 10, abs=2)
    said = {payload for channel, payload in run.said if channel == channels.COMMIT.name}
    assert set(run.system.people.viewed) <= said, "the same bytes"


def test_the_most_eager_lease_sets_the_rate_and_whoever_is_gone_does_not() -> None:
    core = begun()
    asked = [(f"one.{n}", hz) for n, hz in enumerate((10.0, 40.0, 20.0))]
    for at_ns, (name, hz) in zip((0, 0, 1000 * MS), asked, strict=True):
        assert result(ask(core, at_ns, "watch", name, hz=hz))["hz"] == hz
    assert rate(core, 2000 * MS, 3000 * MS) == 40
    core.wake(5000 * MS)
    assert rate(core, 5000 * MS, 5900 * MS) == pytest.approx(0.9 * 20, abs=1), "two leases of 5 s are over"
    core.wake(6000 * MS)
    assert not core.viewing.is_shown


def test_a_large_world_is_shown_less_often() -> None:
    core = begun()
    core.state.commits[core.state.frame.tick] = bytes(180_000)
    got = result(ask(core, 0, "watch", hz=50))["hz"]
    assert got == pytest.approx(BYTES_PER_S_MAX / 180_000, rel=1e-6) and 25 < got < 30


def test_a_frame_in_which_others_are_present_is_shown_at_once() -> None:
    run = Run(nodes=2).ask_at(20, "watch", hz=0.1).ask_at(40, "add", name="ball-2", at="0.3,0.2,0.05")
    run.ask_at(70, "remove", name="ball-2").go()
    changes = [answer.tick + 1 for answer in run.answers[1:]]
    assert set(changes) <= {commit.tick for commit in shown(run)} and len(shown(run)) <= 4


def test_a_paused_world_is_shown_as_it_stands() -> None:
    run = Run(ticks=120, pace=REALTIME).ask_at(30, "watch", hz=20).ask_at(40, "pause")
    run.ask_after(40, 300 * MS, "step", count=3).ask_after(40, 600 * MS, "watch", hz=20)
    run.ask_after(40, 900 * MS, "resume").go()
    paused, stepped = run.answers[1].tick, run.answers[2].tick + 3
    assert {paused, stepped} <= {commit.tick for commit in shown(run)}


def test_a_lease_that_begins_while_the_world_is_paused_brings_the_frame_that_stands() -> None:
    run = Run(ticks=60, pace=REALTIME).ask_at(40, "pause")
    run.ask_after(40, 300 * MS, "watch", hz=50).ask_after(40, 600 * MS, "resume").go()
    assert shown(run)[0].tick == run.answers[0].tick == run.answers[1].tick


def test_what_describe_says_is_enough_to_read_a_frame() -> None:
    run = Run(nodes=2).ask_at(30, "add", name="ball", at="0.3,0.2,0.05").ask_at(60, "move", robot="red.goal", node="n2")
    described = result(run.ask_at(80, "describe").go().answers[2])
    assert (described["run"], described["first_tick"], described["epoch"]) == ("run", 0, 2)
    assert described["owners"]["red.goal"] == "n2"
    deployment = load_deployment(described["deployment"], described["deployment_name"])
    layout = build_layout(deployment)
    assert layout.digest.hex() == described["layout"]
    commit = decode(Commit, base64.b64decode(described["frame"]))
    frame = frame_from_bytes(commit.tick, layout, commit.values, commit.outboxes)
    assert frame.digest == commit.digest and frame.tick == described["tick"] == run.answers[2].tick
    absent = [layout[name].is_absent(frame.numbers) for name in ("ball-2", "ball-3")]
    assert absent == [False, True]
    assert frame.digest == run.frames[frame.tick - 1].digest


def test_before_the_first_frame_there_is_none_and_all_else_is_described() -> None:
    run = Run(ticks=20)
    request = Request(OPERATOR, "early", "describe", b"{}")
    run.system.bus.put(OPERATOR, channels.REQUEST, OPERATOR, encode(request), 0)
    described = result(run.go().system.answers["early"])
    assert described["frame"] is None and described["tick"] == 0 and len(described["layout"]) == 64


def test_looking_is_not_journalled_nor_kept_and_not_even_a_refusal_is() -> None:
    run = Run(ticks=40).ask_at(20, "watch", hz=50).ask_at(20, "describe").ask_at(20, "watch", hz=1000)
    run.ask_at(20, "pause").ask_after(24, 100 * MS, "resume").go()
    assert [answer.accepted for answer in run.answers] == [True, True, False, True, True]
    assert run.answers[2].text == "hz: a number from 0 to 100 is needed, not 1000"
    assert [answer.id for answer in run.system.supervisor.state.answers.values()] == [run.asked[3], "later-4"]


@pytest.mark.parametrize("hz", [-1, 100.5, True, "50", [50]])
def test_a_rate_that_is_none_is_refused(hz: object) -> None:
    answer = ask(begun(), 0, "watch", hz=hz)
    assert not answer.accepted and answer.text.startswith("hz: a number from 0 to 100 is needed, not ")


def test_who_only_looks_may_ask_for_what_changes_nothing_and_no_more() -> None:
    core = begun()
    verbs = {}
    for verb in ("status", "describe", "watch", "pause", "push", "down", "fly"):
        core.actions.clear()
        inquiry = encode(Inquiry("desk.1", f"id-{verb}", verb, encode_json({"hz": 5})))
        core.receive(channels.INQUIRY, "desk.1", inquiry, 0)
        (said,) = core.actions
        assert isinstance(said, Publish), "nothing is journalled"
        verbs[verb] = decode(Answer, said.payload)
    assert [verb for verb, answer in verbs.items() if answer.accepted] == ["status", "describe", "watch"]
    assert verbs["pause"].text == "'pause' is for operators: a viewer may request status, describe, watch"
    core.actions.clear()
    core.receive(channels.INQUIRY, "desk.1", encode(Request("desk.1", "id", "down", b"{}")), 0)
    assert core.refused == 1 and core.state.end is None, "a request on the key of an inquiry is none"


def test_so_many_may_look_and_no_more() -> None:
    core = begun()
    for number in range(limits.OPERATORS_MAX):
        assert ask(core, 0, "watch", f"one.{number}", hz=1).accepted
    answer = ask(core, 0, "watch", "late", hz=1)
    assert (answer.accepted, answer.text) == (False, "64 watch the run already")
    assert ask(core, 1, "watch", "one.3", hz=1).accepted, "who has a lease renews it"
    assert ask(core, 5000 * MS, "watch", "late", hz=1).accepted, "leases end"


def test_a_status_has_what_was_asked_for_last_also_after_a_loss_of_the_supervisor() -> None:
    """By who takes over from the records of the first file of a journal, and from those of a further one."""
    path = TABLE
    system = System(
        RunSettings("run", path.name, TEXT, Pace("fast"), 60), Settings(keeps_journals=True, observes=("publish",))
    )
    heads: list[bytes] = []
    for n in range(40):
        system.at_tick(10, lambda n=n: system.request("rate", pace="fast" if n else "quick"))  # type: ignore[misc]
    system.at_tick(20, lambda: heads.append(system.supervisor.state.checkpoint()))
    system.at_tick(30, lambda: system.request("status"))
    system.run()
    system.close()
    told = result(list(system.answers.values())[-1])["requests"]
    assert len(told) == 32 and told[-1] == {
        "tick": told[-1]["tick"],
        "verb": "rate",
        "text": f"pace fast from tick {told[-1]['tick']}",
        "who": OPERATOR,
        "accepted": True,
    }
    deployment = system.supervisor.state.deployment
    kept = list(system.supervisor.state.last_requests)
    assert fold(deployment, system.journal).kept.requests == kept == fold(deployment, heads).kept.requests


# --- a core alone ----------------------------------------------------------------------------------------------------


def begun() -> SupervisorCore:
    """A supervisor whose run is about to begin."""
    return SupervisorCore(RunSettings("run", TABLE.name, TEXT, REALTIME), bytes(32), 0)


def ask(core: SupervisorCore, now_ns: int, verb: str, who: str = OPERATOR, **arguments: Any) -> Answer:
    core.actions.clear()
    core.receive(channels.REQUEST, who, encode(Request(who, "id", verb, encode_json(arguments))), now_ns)
    (answer,) = [action for action in core.actions if isinstance(action, Publish)]
    assert answer.channel is channels.ANSWER and answer.name == who
    return decode(Answer, answer.payload)


def rate(core: SupervisorCore, begin_ns: int, end_ns: int) -> int:
    """How many of the commits between two times are shown, of one each 2 ms."""
    core.actions.clear()
    for now_ns in range(begin_ns, end_ns, 2 * MS):
        core.viewing.committed(b"frame", [], now_ns)
    return len(core.actions)
