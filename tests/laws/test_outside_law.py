"""Law 7: no input from outside ends a process or corrupts a run; it is refused and counted, and nothing is lost.

On every channel of the table, to every process of a rehearsal, at random ticks: bytes that are no message, and messages
that lie about their sender, epoch, tick or contents. The frames are those of the undisturbed run.
`test_forged_law` has what looks true to the last field.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Sequence
from struct import pack
from typing import TYPE_CHECKING, Any, Final

import msgspec
import pytest
from msgspec.structs import replace

from foosim.client.core import ClientCore
from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.common.json_text import encode_json
from foosim.common.units import Pace
from foosim.protocol import channels
from foosim.protocol.channels import CHANNELS, SUPERVISOR, VHUB, Channel, Plane
from foosim.protocol.codec import decode, encode
from foosim.protocol.hub_messages import ResumeGrant, ResumeState
from foosim.protocol.messages import (
    Build,
    ClientHello,
    ClientWelcome,
    Commit,
    Deliveries,
    Done,
    Epoch,
    Farewell,
    Fetch,
    Go,
    Heartbeat,
    Hello,
    Inquiry,
    Join,
    Order,
    Part,
    Piece,
    Ready,
    Recall,
    Refusal,
    Request,
    Samples,
    Sent,
    Tempo,
    Up,
    Want,
    Watched,
)
from foosim.simulation.run import with_nodes
from foosim.simulation.system import Settings, System
from foosim.supervisor.settings import RunSettings
from foosim.world.edits import Edit, Push
from foosim.world.robot_packets import Delivered, RobotPacket

if TYPE_CHECKING:
    from tests.laws.conftest import Disturbed

NOBODY: Final = "nobody"
REFUSED: Final = ("refused", "malformed")
FAR: Final = 10_000
"""A tick that nobody has reached."""
COMMAND: Final = pack("<2d", 0.1, 1.0)
Lie = tuple[str, Channel, str, msgspec.Struct]
"""Who hears it, the channel, the name in the key, and what is said."""


# --- bytes that are no message ---------------------------------------------------------------------------------------


def no_message(disturbed: Disturbed, rng: random.Random, channel: Channel, known: Sequence[bytes]) -> bytes:
    """Random bytes, or a mutated message of this channel, that nobody can read as one of its messages."""
    while True:
        is_near = bool(known) and rng.random() < 0.7
        payload = disturbed.mutated(rng, rng.choice(known)) if is_near else rng.randbytes(rng.randrange(60))
        try:
            decode(channel.message, payload, channel.bytes_max)
        except Malformed:
            return payload


@pytest.mark.parametrize("seed", range(3))
def test_bytes_that_are_no_message_are_refused_counted_and_change_nothing(disturbed: Disturbed, seed: int) -> None:
    rng = random.Random(seed)
    _, said = disturbed.undisturbed()
    expected: Counter[str] = Counter()
    at_door = 0
    takes_part = [*disturbed.hearers(channels.PART, ""), VHUB, "player-blue", "player-red"]
    for channel in CHANNELS:
        for name in (*takes_part, NOBODY):
            for _ in range(4):
                payload = no_message(disturbed, rng, channel, said.get(channel.plane.name + channel.name, ()))
                tick = rng.randrange(disturbed.ticks - 20)
                disturbed.at(tick, lambda c=channel, n=name, p=payload: disturbed.put(c, n, p))  # type: ignore[misc]
                hearers = disturbed.hearers(channel, name)
                expected.update(hearers)
                at_door += channel.plane is Plane.RADIO and VHUB in hearers and tick > 0
    assert set(expected) == set(takes_part) and min(expected.values()) >= 12
    disturbed.assert_untouched(disturbed.go())
    assert disturbed.malformed() == expected
    assert disturbed.system.hub.state is not None
    assert disturbed.system.hub.state.refusals == {"malformed": at_door}, "what came before the build has no account"


def test_a_flood_is_refused_to_the_last_message(disturbed: Disturbed) -> None:
    def flood() -> None:
        for channel in CHANNELS:
            for name in (*disturbed.system.processes, NOBODY):
                for _ in range(100):
                    disturbed.put(channel, name, b"\xc1")

    disturbed.at(30, flood)
    disturbed.assert_untouched(disturbed.go())
    assert min(disturbed.malformed().values()) >= 300


# --- messages that lie -----------------------------------------------------------------------------------------------


def lies_to_nodes(system: System) -> list[Lie]:
    core = system.supervisor
    tick, epoch, frame = core.state.frame.tick, core.state.epoch, core.state.frame
    part = Part(epoch, tick + 1, "n2", bytes(32), [], b"", b"", [])
    push: list[Edit] = [Push("ball", (1.0, 0.0, 0.0))]
    owners = sorted(core.state.owners.items())
    new = Epoch(epoch + 9, tick, frame.digest, ["n1", "n2"], owners, b"")
    said: list[tuple[Channel, str, msgspec.Struct]] = [
        (channels.PART, "n2", replace(part, node="n1")),
        (channels.PART, "n2", replace(part, epoch=0)),
        (channels.PART, "n2", replace(part, tick=FAR)),
        (channels.PART, "n2", replace(part, tick=max(0, tick - 3))),
        (channels.PART, NOBODY, replace(part, node=NOBODY)),
        (channels.ORDER, SUPERVISOR, Order(0, tick, push)),
        (channels.ORDER, SUPERVISOR, Order(epoch, FAR, push)),
        (channels.ORDER, SUPERVISOR, Order(epoch + 7, tick + 1, push)),
        (channels.DELIVERIES, VHUB, Deliveries(FAR, [])),
        (channels.EPOCH, SUPERVISOR, replace(new, epoch=0)),
        (channels.EPOCH, SUPERVISOR, replace(new, owners=owners[1:])),
        (channels.EPOCH, SUPERVISOR, replace(new, owners=[*owners, owners[0]])),
        (channels.EPOCH, SUPERVISOR, replace(new, owners=[(robot, NOBODY) for robot, _ in owners])),
        (channels.EPOCH, SUPERVISOR, replace(new, roster=["n1", "n1", "n2"])),
        (channels.BUILD, "n1", Build("n1", "other", "first", "run", "t", "", "fast")),
        (channels.REFUSAL, "n1", Refusal("n1", "other", "go away")),
        (channels.PIECE, "n1", Piece("n1", "boot-1", bytes(32), 0, 3, b"lie")),
        (channels.COMMIT, "n1", Commit(epoch, tick, frame.digest, frame.values.tobytes(), [], [], True)),
    ]
    if tick > 3:
        packet = Delivered(0, "x", 1, 0, "red.goal", "position", COMMAND)
        said += [
            (channels.ORDER, SUPERVISOR, Order(epoch, tick - 3, push)),
            (channels.DELIVERIES, VHUB, Deliveries(tick - 3, [packet])),
        ]
    return [("n1", *lie) for lie in said]


def lies_to_the_hub(system: System) -> list[Lie]:
    core = system.supervisor
    tick, epoch, frame = core.state.frame.tick, core.state.epoch, core.state.frame
    commit = Commit(epoch, FAR, frame.digest, frame.values.tobytes(), [], [], True)
    sample = RobotPacket("camera", 0, "", "ball", b"lie")
    samples = Samples(tick + 1, bytes(32), "n1", list(core.state.owners), [sample])
    command = Sent(10**9, "red.goal", "position", 0, COMMAND)
    said: list[tuple[Channel, str, msgspec.Struct]] = [
        (channels.COMMIT, VHUB, commit),
        (channels.COMMIT, VHUB, replace(commit, tick=max(0, tick - 3))),
        (channels.COMMIT, VHUB, replace(commit, tick=tick + 1)),
        (channels.SAMPLES, "n1", replace(samples, node="n2")),
        (channels.SAMPLES, "n1", samples),
        (channels.SAMPLES, "n1", replace(samples, tick=FAR)),
        (channels.RESUME_GRANT, VHUB, ResumeGrant(VHUB, "other", FAR)),
        (channels.EPOCH, SUPERVISOR, Epoch(0, 0, frame.digest, [], [], b"")),
        (channels.EPOCH, SUPERVISOR, Epoch(epoch + 9, 0, frame.digest, ["n1"], [], b"")),
        (channels.TEMPO, SUPERVISOR, Tempo("1e999x", False)),
        (channels.WATCHED, SUPERVISOR, Watched([(NOBODY, "dragon")], [("red.goal", "dragon")])),
        (channels.BUILD, VHUB, Build(VHUB, "other", "first", "run", "t", "", "fast")),
        (channels.REFUSAL, VHUB, Refusal(VHUB, "other", "go away")),
        (channels.PIECE, VHUB, Piece(VHUB, "boot", bytes(32), 0, 3, b"lie")),
        (channels.CLIENT_HELLO, "player-red", ClientHello("player-red", "other", limits.PROTOCOL_VERSION, "", 0)),
        (channels.CLIENT_HELLO, NOBODY, ClientHello(NOBODY, "other", 99, "", 0)),
        (channels.UP, "player-red", Up("player-red", "other", [command])),
        (channels.UP, "player-red", Done("player-red", "other", tick, [command])),
        (channels.UP, "player-red", Join("player-red", "other", 1, [])),
        (channels.UP, "player-blue", Up("player-red", "boot", [command])),
        (channels.UP, "player-red", Done("player-red", "boot", FAR, [command])),
        (channels.UP, NOBODY, Up(NOBODY, "boot", [command])),
        (channels.CLIENT_FETCH, "player-red", Fetch("player-red", "other", bytes(32), 0)),
    ]
    return [(VHUB, *lie) for lie in said]


def lies_to_the_supervisor(system: System) -> list[Lie]:
    tick, epoch = system.supervisor.state.frame.tick, system.supervisor.state.epoch
    part = Part(epoch, tick + 1, "n1", bytes(32), [], b"", b"", [])
    hello = Hello("node", "n1", "other", limits.PROTOCOL_VERSION, "", bytes(32))
    beat = Heartbeat("n1", FAR, FAR, "", "player-red", float("nan"), b"{}")
    asked: tuple[tuple[str, dict[str, Any]], ...] = (
        ("push", {"impulse": [10**400, 0, 0]}),
        ("add", {"name": "ball", "at": "x"}),
        ("dragon", {}),
    )
    said: list[tuple[Channel, str, msgspec.Struct]] = [
        (channels.PART, "n1", replace(part, epoch=0)),
        (channels.PART, "n1", replace(part, tick=FAR)),
        (channels.PART, "n1", replace(part, node="n2")),
        (channels.PART, NOBODY, replace(part, node=NOBODY)),
        (channels.DELIVERIES, VHUB, Deliveries(FAR, [])),
        (channels.HELLO, "n1", hello),
        (channels.HELLO, "n1", replace(hello, name="n2")),
        (channels.HELLO, NOBODY, replace(hello, name=NOBODY)),
        (channels.HELLO, "n1", replace(hello, role="dragon", boot="boot")),
        (channels.FETCH, "n1", Fetch("n1", "boot-1", bytes(32), 0)),
        (channels.READY, "n1", Ready("n1", "other", bytes(32), bytes(32), bytes(32))),
        (
            channels.RESUME_STATE,
            VHUB,
            ResumeState(VHUB, "other", "boot", FAR, b"", bytes(32), 0, True, True, ""),
        ),
        (channels.HEARTBEAT, "n1", replace(beat, report=b"{")),
        (channels.HEARTBEAT, "n1", beat),
        (channels.HEARTBEAT, NOBODY, replace(beat, sender=NOBODY)),
        (channels.FAREWELL, NOBODY, Farewell(NOBODY, b"{}")),
        (channels.FAREWELL, "n1", Farewell("n2", b"{}")),
        (channels.REQUEST, NOBODY, Request("operator", "x", "down", b"{}")),
        *((channels.REQUEST, NOBODY, Request(NOBODY, verb, verb, encode_json(given))) for verb, given in asked),
        (channels.INQUIRY, NOBODY, Inquiry("operator", "x", "status", b"{}")),
        (channels.INQUIRY, NOBODY, Inquiry(NOBODY, "down", "down", b"{}")),
    ]
    if tick > 3:
        said += [(channels.DELIVERIES, VHUB, Deliveries(tick - 3, []))]
    return [(SUPERVISOR, *lie) for lie in said]


def lies(system: System) -> list[Lie]:
    """Well-formed messages that are not what they say, as they would be at the present tick."""
    stranger = Want(NOBODY, "dragon", FAR, FAR, [])
    welcome = ClientWelcome("player-red", "other", "hub", 0, 0, "t", "")
    return [
        *lies_to_nodes(system),
        *lies_to_the_hub(system),
        *lies_to_the_supervisor(system),
        *((who, channels.RECALL, SUPERVISOR, Recall("other")) for who in ("n1", VHUB)),
        *((who, channels.WANT, NOBODY, stranger) for who in ("n1", VHUB, SUPERVISOR)),
        *((who, channels.WANT, NOBODY, replace(stranger, sender="n1")) for who in ("n1", VHUB, SUPERVISOR)),
        ("player-red", channels.CLIENT_WELCOME, "player-red", welcome),
        ("player-red", channels.CLIENT_PIECE, "player-red", Piece("player-red", "boot", bytes(32), 0, 5, b"false")),
        ("player-red", channels.DOWN, "player-red", Go(0, FAR, 0, [])),
    ]


def test_lies_are_told_on_every_channel_that_somebody_reads(disturbed: Disturbed) -> None:
    text = with_nodes(disturbed.text, disturbed.name, 2, disturbed.sets)
    told = lies(System(RunSettings("run", disturbed.name, text, Pace("fast")), Settings()))
    assert all(who in disturbed.hearers(channel, name) for who, channel, name, _ in told)
    of_runs = {channel for channel in CHANNELS if channel.plane is not Plane.REPLAY}
    untold = of_runs - {channel for _, channel, _, _ in told}
    people = {channels.ANSWER, channels.VIEW}  # read by them alone, who are no process of a run
    assert untold == {*people, channels.END, channels.CLIENT_REFUSAL}, "an end is an end"


@pytest.mark.parametrize("tick", [0, 1, 35, 60])
def test_messages_that_lie_change_nothing(disturbed: Disturbed, tick: int) -> None:
    def tell() -> None:
        for _, channel, name, message in lies(disturbed.system):
            disturbed.put(channel, name, message)

    disturbed.at(tick, tell)
    disturbed.assert_untouched(disturbed.go())


SILENT: Final = {channels.WANT, channels.SAMPLES, channels.HEARTBEAT, channels.FAREWELL, channels.WATCHED}
"""Of these some are taken and lead to nothing: a want of what nobody has, samples of another frame, a look at a link
that nobody uses."""


def test_each_lie_is_counted_or_answered_by_who_hears_it(disturbed: Disturbed) -> None:
    """Told to the core itself, one at a time, at a tick in the middle."""
    uncounted: list[Lie] = []

    def account(core: Any) -> int:
        held = len(getattr(core, "_pending", ())) + getattr(getattr(core, "state", None), "repeated", 0)
        return held + sum(getattr(disturbed.counted(core), field, 0) for field in (*REFUSED, "repeated"))

    def tell() -> None:
        for lie in lies(disturbed.system):
            who, channel, name, message = lie
            core = disturbed.system.processes[who].core
            before, actions = account(core), len(core.actions)
            core.receive(channel, name, encode(message), disturbed.system.bus.now_ns)
            if account(core) == before and len(core.actions) == actions:
                uncounted.append(lie)
            del core.actions[actions:]

    disturbed.at(40, tell)
    disturbed.go()
    assert [lie for lie in uncounted if lie[1] not in SILENT] == []
    assert len(uncounted) <= 8, uncounted


def test_a_client_refuses_what_it_did_not_ask_for(disturbed: Disturbed) -> None:
    core = ClientCore("player-red", "boot", 0)
    welcome = ClientWelcome("player-blue", "boot", "hub", 0, 0, disturbed.name, disturbed.text)
    told: list[tuple[Channel, str, msgspec.Struct]] = [
        (channels.DOWN, "player-red", Go(1, 0, 0, [])),
        (channels.DOWN, "player-blue", Go(1, 0, 0, [])),
        (channels.CLIENT_WELCOME, "player-red", welcome),
        (channels.UP, "player-red", Up("player-red", "boot", [])),
    ]
    for channel, name, message in told:
        core.receive(channel, name, encode(message), 0)
    assert core.statistics().malformed == len(told) and core.go is None and core.welcome is None
