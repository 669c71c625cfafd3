"""What people ask of a running system: the tick that an answer names is the tick at which it takes effect.

Everything in rehearsal, where the tick of every message and the digest of every frame are known.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.common import limits
from foosim.common.json_text import decode_json, encode_json
from foosim.common.units import Pace
from foosim.protocol import channels
from foosim.protocol.actions import Publish
from foosim.protocol.codec import decode, encode
from foosim.protocol.messages import Answer, Epoch, Order, Request
from foosim.simulation.run import with_nodes
from foosim.simulation.settings import Traced
from foosim.simulation.system import OPERATOR, Settings, System
from foosim.supervisor.settings import RunSettings
from foosim.vhub.state.records import Closing
from foosim.world.frame import Frame

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TEXT: Final = TABLE.read_text()
TICKS: Final = 120
MS: Final = 1_000_000
T: Final = 2 * MS
FAST: Final = Pace("fast")
REALTIME: Final = Pace("realtime")
SETS: Final = ("engine=pure", "table.rules.kickoff_delay=20 ms", "table.spare_balls=3")


class Run:
    """A rehearsal and what was seen of it: frames and when they were committed, what was said, what was closed."""

    def __init__(
        self, nodes: int = 1, ticks: int = TICKS, pace: Pace = FAST, sets: tuple[str, ...] = (), world: str = ""
    ) -> None:
        """`world` is the text of another one than the table."""
        self.frames: list[Frame] = []
        self.times_ns: list[int] = []
        self.said: list[tuple[str, bytes]] = []
        self.closings: list[Closing] = []
        text = with_nodes(world or TEXT, TABLE.name, nodes, sets if world else (*SETS, *sets))
        settings = Settings(observer=self._observe, on_commit=self._commit, on_closing=self.closings.append)
        self.system = System(RunSettings("run", TABLE.name, text, pace, ticks), settings)
        self.asked: list[str] = []

    def _observe(self, traced: Traced) -> None:
        if traced.what == "publish" and traced.process == channels.SUPERVISOR:
            self.said.append((traced.channel, traced.payload))

    def _commit(self, frame: Frame) -> None:
        self.frames.append(frame)
        self.times_ns.append(self.system.bus.now_ns)

    def ask_at(self, tick: int, verb: str, **arguments: Any) -> Run:
        """Ask for something when frame `tick` is committed."""
        self.system.at_tick(tick, lambda: self.asked.append(self.system.request(verb, **arguments)))
        return self

    def ask_after(self, tick: int, delay_ns: int, verb: str, **arguments: Any) -> Run:
        """Ask for something a while after frame `tick` was committed: it may be the last one before a pause."""

        def ask() -> None:
            self.asked.append(f"later-{len(self.asked)}")
            request = Request(OPERATOR, self.asked[-1], verb, encode_json(arguments))
            bus = self.system.bus
            bus.put(OPERATOR, channels.REQUEST, OPERATOR, encode(request), bus.now_ns + delay_ns)

        self.system.at_tick(tick, ask)
        return self

    def go(self) -> Run:
        self.system.run()
        self.system.close()
        return self

    @property
    def answers(self) -> list[Answer]:
        """In the order in which was asked."""
        return [self.system.answers[identity] for identity in self.asked]

    @property
    def digests(self) -> list[bytes]:
        return [frame.digest for frame in self.frames]

    def first_difference(self) -> int:
        """The tick of the first frame that is not as in an undisturbed run."""
        pairs = zip(undisturbed().frames, self.frames, strict=True)
        return next(one.tick for one, other in pairs if one.digest != other.digest)


@cache
def undisturbed() -> Run:
    return Run().go()


# --- what changes the world ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("tick", [20, 40, 77])
def test_a_push_is_felt_in_the_tick_that_its_answer_names(tick: int) -> None:
    run = Run().ask_at(tick, "push", impulse=[0.0, 0.01, 0.0]).go()
    (answer,) = run.answers
    assert answer.accepted and answer.text == f"ball pushed at tick {answer.tick}"
    # Up to W ticks are committed in one turn, and that many are released behind them.
    assert tick < answer.tick <= tick + 2 * limits.RELEASE_AHEAD, "the first tick that was not released"
    assert run.first_difference() == answer.tick + 1
    frame, usual = run.frames[answer.tick], undisturbed().frames[answer.tick]
    assert frame.tick == usual.tick == answer.tick + 1
    faster = frame.at("ball", "linear_velocity", 1) - usual.at("ball", "linear_velocity", 1)
    assert faster == pytest.approx(0.01 / 0.021, rel=0.05)


@pytest.mark.parametrize(
    ("at", "what"),
    [
        ("0.224,0,0.02", "red.attack, "),
        ("-0.075,0.06,0.08", "red.midfield, "),
        ("0.03,0", "ball, "),
        ("0.3,0.335", "the table, "),
    ],
    ids=["figure", "tube", "ball", "wall"],
)
def test_a_ball_is_neither_added_nor_put_into_what_is_on_the_table(at: str, what: str) -> None:
    run = Run(ticks=20).ask_at(4, "add", name="ball", at=at).ask_at(4, "add", name="ball", at="0.15,0")
    added, beside, put = run.ask_at(10, "set", name="ball-2", field="at", value=at).go().answers
    assert beside.accepted and not (added.accepted or put.accepted)
    for answer in (added, put):
        assert answer.text.startswith(f"at of ball-2: a place that is occupied: ball-2 would be in {what}")


def busy(nodes: int) -> Run:
    """Adds, removes, pushes and moves, close to each other."""
    run = Run(nodes, ticks=260, pace=REALTIME)
    for tick in range(20, 240, 20):
        run.ask_at(tick, "push", impulse=[0.008 if tick % 40 else -0.008, 0.002, 0.0])
    run.ask_at(30, "add", name="ball-2", at="0.05,0.1,0.05").ask_at(31, "add", name="ball-3", at="-0.05,-0.1,0.05")
    run.ask_at(90, "push", name="ball-2", impulse=[0.02, 0.0, 0.0]).ask_at(120, "remove", name="ball-2")
    run.ask_at(160, "add", name="ball-2", at="-0.2,0,0.05").ask_at(200, "remove", name="ball-3")
    for tick in (50, 51, 130, 180) if nodes > 1 else ():
        run.ask_at(tick, "move", robot="red.midfield", node=f"n{tick % nodes + 1}")
    return run.go()


def test_a_move_is_an_epoch_at_the_commit_that_its_answer_names_and_changes_nothing() -> None:
    run = Run(nodes=2).ask_at(50, "move", robot="red.goal", node="n2").go()
    (answer,) = run.answers
    assert answer.accepted and answer.text == f"red.goal moved to n2 at tick {answer.tick}"
    epochs = [decode(Epoch, payload) for channel, payload in run.said if channel == channels.EPOCH.name]
    last = max(epochs, key=lambda epoch: epoch.epoch)
    assert (last.epoch, last.tick, dict(last.owners)["red.goal"]) == (2, answer.tick, "n2")
    assert last.digest == run.frames[answer.tick - 1].digest and answer.tick >= 50
    assert run.digests == undisturbed().digests and run.system.supervisor.state.account.moves == 1


def test_a_node_is_stopped_and_started_again_and_nothing_changes() -> None:
    run = Run(nodes=3).ask_at(30, "stop", node="n2").ask_at(40, "start", node="n2")
    run.system.at_tick(50, lambda: run.system.kill("n2"))
    run.system.at_tick(60, lambda: run.system.start("n2"))
    run.ask_at(55, "start", node="n2").go()
    stopped, started, again = run.answers
    assert stopped.accepted and stopped.text == f"n2 stopped at tick {stopped.tick}"
    assert started.accepted and started.text.startswith("n2 may take part from tick ") and again.accepted
    assert run.digests == undisturbed().digests
    supervisor = run.system.supervisor
    assert supervisor.state.members == ("n1", "n2", "n3") and supervisor.state.epoch == 3
    assert set(supervisor.state.owners.values()) == {"n1", "n2", "n3"}, "its robots came back with it"
    assert supervisor.state.roster.starts == {"n2": 2}, "which its launcher sees, also of one that is just not here"


def test_what_cannot_be_stopped_or_started() -> None:
    run = Run(nodes=2).ask_at(20, "stop", node="n9").ask_at(22, "start", node="n1").ask_at(30, "stop", node="n1")
    run.ask_at(40, "stop", node="n1").ask_at(50, "stop", node="n2").go()
    assert [(answer.accepted, answer.text) for answer in run.answers] == [
        (False, "no node 'n9'; there are n1, n2"),
        (True, "n1 takes part already"),
        (True, f"n1 stopped at tick {run.answers[2].tick}"),
        (True, "n1 is stopped already"),
        (False, "n2 is the only node that is left"),
    ]
    assert run.digests == undisturbed().digests


# --- pace ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("pace", [FAST, REALTIME], ids=str)
def test_a_pause_holds_the_world_before_the_tick_that_its_answer_names(pace: Pace) -> None:
    run = Run(pace=pace).ask_at(40, "pause")
    run.ask_after(40, 700 * MS, "status").ask_after(40, 900 * MS, "resume").go()
    paused, status, resumed = run.answers
    assert paused.accepted and paused.text == f"paused at tick {paused.tick}"
    assert paused.tick == status.tick == resumed.tick
    before, after = run.times_ns[: paused.tick], run.times_ns[paused.tick :]
    assert before[-1] - before[39] < 20 * MS and after[0] - before[39] == 900 * MS
    assert max(_gaps(run.times_ns, paused.tick)) < 10 * MS
    assert run.digests == undisturbed().digests
    assert run.system.supervisor.state.pacer.lags.max_ns == 0, "a pause is no lag"


def _gaps(times_ns: list[int], but: int) -> list[int]:
    return [times_ns[i] - times_ns[i - 1] for i in range(1, len(times_ns)) if i != but]


def test_a_step_computes_so_many_ticks_and_pauses() -> None:
    run = Run(pace=REALTIME).ask_at(40, "pause").ask_after(40, 500 * MS, "step", count=7)
    run.ask_after(40, 800 * MS, "status").ask_after(40, 900 * MS, "resume").go()
    paused, stepped, status, resumed = run.answers
    assert stepped.tick == paused.tick and stepped.text == f"7 ticks from tick {paused.tick}, then paused"
    assert status.tick == resumed.tick == paused.tick + 7
    asked_ns = run.times_ns[39] + 500 * MS
    assert run.times_ns[paused.tick - 1] < asked_ns
    assert set(run.times_ns[paused.tick : paused.tick + 7]) == {asked_ns}
    assert run.times_ns[paused.tick + 7] == asked_ns + 400 * MS
    assert run.digests == undisturbed().digests


def test_another_pace_holds_from_the_tick_that_its_answer_names() -> None:
    run = Run(pace=REALTIME).ask_at(40, "rate", pace="4x").go()
    (answer,) = run.answers
    assert answer.accepted and answer.text == f"pace 4x from tick {answer.tick}"
    gaps = _gaps(run.times_ns, 0)
    assert set(gaps[5 : answer.tick - 6]) == {T}
    assert set(gaps[answer.tick + 6 :]) == {T // 4}
    fast = Run(pace=REALTIME).ask_at(40, "rate", pace="fast").go()
    assert sum(_gaps(fast.times_ns, 0)[fast.answers[0].tick + 1 :]) == 0, "on a bus that takes no time"
    assert fast.digests == run.digests == undisturbed().digests


@pytest.mark.parametrize("pace", [FAST, REALTIME], ids=str)
@pytest.mark.parametrize("paused", [False, True])
def test_down_ends_the_run_after_the_tick_that_its_answer_names(pace: Pace, paused: bool) -> None:
    run = Run(pace=pace, ticks=0)
    if paused:
        run.ask_at(40, "pause")
    run.ask_after(40, 300 * MS if paused else 0, "down").go()
    down = run.answers[-1]
    assert down.accepted and down.text == f"the run ends at tick {down.tick}"
    assert run.frames[-1].tick == down.tick == run.system.supervisor.state.frame.tick
    assert run.system.supervisor.state.end is not None and not run.system.supervisor.state.end.failed
    assert [closing.frame.tick for closing in run.closings] == list(range(down.tick + 1)), "each frame once"
    assert run.digests == undisturbed().digests[: down.tick]


def test_status_is_of_the_tick_that_its_answer_names() -> None:
    run = Run(nodes=2)
    run.system.supervisor.state.busy = 0.4321
    (answer,) = run.ask_at(40, "status").go().answers
    status = decode_json(answer.result)
    assert status["ticks"] == answer.tick and status["digest"]["frame"] == run.frames[answer.tick - 1].digest.hex()
    assert (status["state"], status["epoch"], sorted(status["nodes"])) == ("running", 1, ["n1", "n2"])
    assert set(status["processes"]) == {"n1", "n2", "supervisor", "vhub"}
    own = status["processes"]["supervisor"]
    assert (own["role"], own["busy"], own["tick"]) == ("supervisor", 0.432, answer.tick)
    assert own["waiting_for"] == status["waiting_for"]


# --- ids and refusals ------------------------------------------------------------------------------------------------


def said_again(verb: str, **arguments: Any) -> tuple[Run, list[bytes]]:
    """Ask three times with one id, close to each other and later; return the answers' bytes."""
    run = Run(nodes=2)
    payload = encode(Request(OPERATOR, "mine", verb, encode_json(arguments)))

    def ask(system: System) -> None:
        system.bus.put(OPERATOR, channels.REQUEST, OPERATOR, payload, system.bus.now_ns)

    for tick in (30, 30, 31, 60):
        run.system.at_tick(tick, partial(ask, run.system))
    run.go()
    return run, [said for channel, said in run.said if channel == channels.ANSWER.name]


CHANGES: Final[dict[str, dict[str, Any]]] = {
    "push": {"impulse": [0.0, 0.01, 0.0]},
    "add": {"name": "ball", "at": "0.3,0.2,0.05"},
    "move": {"robot": "red.goal", "node": "n2"},
    "rate": {"pace": "2x"},
}


@pytest.mark.parametrize("verb", CHANGES)
def test_the_same_id_gets_the_same_answer_and_is_done_once(verb: str) -> None:
    run, answers = said_again(verb, **CHANGES[verb])
    assert len(answers) == 4 and len(set(answers)) == 1
    edits = [edit for channel, said in run.said if channel == channels.ORDER.name for edit in decode(Order, said).edits]
    assert len(edits) == (1 if verb in ("push", "add") else 0)
    assert run.system.supervisor.state.epoch == (2 if verb == "move" else 1)


def test_the_same_id_of_another_is_another_request() -> None:
    run = Run()
    said = []
    for sender in ("one", "other"):
        payload = encode(Request(sender, "1", "push", encode_json({"impulse": [0.0, 0.005, 0.0]})))
        run.system.at_tick(
            30, partial(run.system.bus.put, sender, channels.REQUEST, sender, payload, run.system.bus.now_ns)
        )
    run.go()
    said = [decode(Answer, payload) for channel, payload in run.said if channel == channels.ANSWER.name]
    assert [(answer.sender, answer.accepted) for answer in said] == [("one", True), ("other", True)]
    edits = [edit for channel, raw in run.said if channel == channels.ORDER.name for edit in decode(Order, raw).edits]
    assert len(edits) == 2


GREAT: Final = 10**400
BAD: Final[tuple[tuple[str, Mapping[str, Any], str], ...]] = (
    ("fly", {}, "no verb 'fly'; there are status, describe, watch, pause, resume, step, rate, add, remove, "),
    ("step", {}, "count: a whole number from 1 to 1000000000 is needed, not null"),
    ("step", {"count": 0}, "not 0"),
    ("step", {"count": True}, "not true"),
    ("step", {"count": 1.0}, "not 1.0"),
    ("step", {"count": "5"}, "not '5'"),
    ("step", {"count": GREAT}, "a whole number from 1 to 1000000000 is needed"),
    ("rate", {}, "not a pace (realtime, fast or a factor such as 2x), null"),
    ("rate", {"pace": "fats"}, "nearest is 'fast'"),
    ("rate", {"pace": ["fast"]}, "not a pace"),
    ("rate", {"pace": "0x"}, "out of range"),
    ("move", {}, "robot: a name is needed, not null"),
    ("move", {"robot": "red.gaol", "node": "n1"}, "no robot 'red.gaol'; there are blue.attack, "),
    ("move", {"robot": "red.gaol", "node": "n1"}, "nearest is red.goal"),
    ("move", {"robot": "red.goal", "node": "n9"}, "no node 'n9'; there are n1, n2"),
    ("move", {"robot": ["red.goal"], "node": "n1"}, "robot: a name is needed, not a list of 1"),
    ("push", {}, "impulse: three numbers of at most 1e+100 are needed, not null"),
    ("push", {"impulse": [1, 2]}, "not [1, 2]"),
    ("push", {"impulse": [1, 2, None]}, "not [1, 2, null]"),
    ("push", {"impulse": [0, 0, GREAT]}, "three numbers of at most 1e+100 are needed"),
    ("push", {"impulse": ["1", "2", "3"]}, "not ['1', '2', '3']"),
    ("push", {"impulse": [0.0, 0.0, 11.0]}, "impulse: 11 N s in all are too much, valid are at most 0.84 N s, "),
    ("push", {"impulse": [0.6, 0.6, 0.0]}, "which are the limit of ball, 40 m/s, at 0.021 kg"),
    ("push", {"name": "bal", "impulse": [0, 0, 0]}, "no free body 'bal'; there are ball, nearest is ball"),
    ("push", {"name": 7, "impulse": [0, 0, 0]}, "name: a name is needed, not 7"),
    ("add", {}, "name: a name is needed, not null"),
    ("add", {"name": "bal"}, "no entity to add (there are: ball, ball-2, ball-3, ball-4), 'bal', nearest is 'ball'"),
    ("add", {"name": "ball-5"}, "ball-4), 'ball-5', nearest is 'ball"),
    ("add", {"name": "camera"}, "camera is always in the world: fixed entities and entities of a kit neither"),
    ("add", {"name": "world"}, "world is always in the world: "),
    ("add", {"name": "ball-2", "node": "n1"}, "ball-2 is no robot: it has no node"),
    ("add", {"name": "ball-2", "node": "n9"}, "no node 'n9'; there are n1, n2"),
    ("add", {"name": "ball", "at": "9,0,0.1"}, "at of ball-2: a place outside of the table: valid are x up to 0.6 m"),
    ("add", {"name": "ball", "at": "0,0,0"}, "at of ball-2: a place outside of the table"),
    ("add", {"name": "ball", "at": "0"}, "no place: valid are X,Y or X,Y,Z"),
    ("add", {"name": "ball", "at": "0,one"}, "at of ball-2: "),
    ("add", {"name": "ball", "at": [0, 0]}, "no place: valid are X,Y or X,Y,Z, or some of x, y, z, roll, pitch, yaw"),
    ("add", {"name": "ball", "at": {"x": "0 m", "yow": "1 rad"}}, "at of ball-2: "),
    ("add", {"name": "ball", "at": f"{GREAT},0"}, "at of ball-2: "),
    ("remove", {}, "name: a name is needed, not null"),
    ("remove", {"name": "ball"}, "ball is always in the world: fixed entities and entities of a kit neither come"),
    ("remove", {"name": "ball-2"}, "ball-2 is absent already"),
    ("remove", {"name": "boll-2"}, "nothing to remove (there are: none), 'boll-2'"),
    ("push", {"name": "ball-2", "impulse": [0, 0, 0]}, "no free body 'ball-2'; there are ball"),
    ("set", {"name": "ball-2", "field": "at", "value": "0,0"}, "ball-2 is absent: add it first"),
    ("remove", {"name": "red.goal"}, "red.goal is always in the world"),
)


def test_what_cannot_be_is_refused_with_the_choices_and_changes_nothing() -> None:
    run = Run(nodes=2)
    for verb, arguments, _ in BAD:
        run.ask_at(40, verb, **arguments)
    run.go()
    assert len(run.answers) == len(BAD)
    for answer, (verb, arguments, expected) in zip(run.answers, BAD, strict=True):
        assert not answer.accepted, (verb, arguments)
        assert expected in answer.text, (verb, arguments, answer.text)
        assert len(answer.text) <= 4000
    assert run.digests == undisturbed().digests


@pytest.mark.parametrize("raw", [b"", b"null", b"[]", b"7", b'{"impulse": ', b"\xff\xfe", b"[" * 5000])
def test_arguments_that_are_no_object_are_refused(raw: bytes) -> None:
    run = Run(ticks=60)
    payload = encode(Request(OPERATOR, "mine", "push", raw))
    run.system.at_tick(30, lambda: run.system.bus.put(OPERATOR, channels.REQUEST, OPERATOR, payload, 0))
    answer = run.go().system.answers["mine"]
    assert not answer.accepted and answer.text


def test_before_the_start_and_after_the_end_only_status_and_down_are_answered() -> None:
    run = Run(ticks=30)
    for number, verb in enumerate(("status", "pause", "push")):
        request = Request(OPERATOR, f"early-{number}", verb, encode_json({"impulse": [0, 0, 0]}))
        run.system.bus.put(OPERATOR, channels.REQUEST, OPERATOR, encode(request), 0)
    run.go()
    early = [run.system.answers[f"early-{number}"] for number in range(3)]
    assert [answer.accepted for answer in early] == [True, False, False]
    assert {answer.text for answer in early[1:]} == {"the run has not started yet"}
    core = run.system.supervisor
    core.receive(channels.REQUEST, OPERATOR, encode(Request(OPERATOR, "late", "pause", b"{}")), 10**9)
    core.receive(channels.REQUEST, OPERATOR, encode(Request(OPERATOR, "later", "down", b"{}")), 10**9)
    said = [action for action in core.actions if isinstance(action, Publish) and action.channel is channels.ANSWER]
    late = [decode(Answer, action.payload) for action in said]
    assert [(answer.accepted, answer.text) for answer in late] == [
        (False, "the run has ended"),
        (True, "the run ends at tick 30"),
    ]
