"""Law 7, the hard part: what comes on the right key at the right time and is wrong inside, or who it comes from.

A spoiled copy of a true message, said just before it, is refused, and the true one counts. Strangers on the radio
plane, which is not trusted, change nothing whatever they say. On the simulation plane, which is trusted, a well-formed
message is believed, whoever forged it; then the run may end, in order and with a reason, but no process breaks.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pytest
from msgspec.structs import replace

from foosim.protocol import channels
from foosim.protocol.channels import CHANNELS, SUPERVISOR, VHUB, Channel, Plane
from foosim.protocol.codec import decode, decode_any, encode
from foosim.protocol.messages import Part
from foosim.simulation.settings import Traced
from foosim.world.edits import Add, Push
from foosim.world.robot_packets import Outbox

if TYPE_CHECKING:
    from tests.laws.conftest import Disturbed

NOBODY: Final = "nobody"
PLAYERS: Final = ("player-blue", "player-red")
NAN: Final = float("nan")
INFINITE: Final = float("inf")


def with_number(raw: bytes, at: int, number: float) -> bytes:
    numbers = np.frombuffer(raw).copy()
    numbers[at] = number
    return numbers.tobytes()


def flipped(raw: bytes, bit: int) -> bytes:
    content = bytearray(raw)
    content[bit // 8] ^= 1 << bit % 8
    return bytes(content)


PARTS: Final[dict[str, Callable[[Any], Any]]] = {
    "not finite": lambda part: replace(part, solver_values=with_number(part.solver_values, -1, NAN)),
    "infinite": lambda part: replace(part, solver_values=with_number(part.solver_values, 0, INFINITE)),
    "short": lambda part: replace(part, owner_values=part.owner_values[:-8]),
    "long": lambda part: replace(part, solver_values=part.solver_values + bytes(8)),
    "solves nothing": lambda part: replace(part, solved=[], solver_values=b""),
    "solves twice": lambda part: replace(part, solved=part.solved * 2),
    "solves what is not there": lambda part: replace(part, solved=[*part.solved, 99]),
    "an outbox that is none": lambda part: replace(part, outboxes=[Outbox(part.solved[0], b"\xc1")]),
    "another epoch": lambda part: replace(part, epoch=0),
}
ORDERS: Final[dict[str, Callable[[Any], Any]]] = {
    "a push that is not finite": lambda order: replace(order, edits=[Push("ball", (NAN, 0.0, 0.0))]),
    "an addition at infinity": lambda order: replace(order, edits=[Add("ball-2", [0.0, INFINITE])]),
    "another epoch": lambda order: replace(order, epoch=0),
}
COMMITS: Final[dict[str, Callable[[Any], Any]]] = {
    "another bit": lambda commit: replace(commit, values=flipped(commit.values, 777)),
    "short": lambda commit: replace(commit, values=commit.values[:-8]),
    "an outbox": lambda commit: replace(commit, outboxes=[Outbox(0, b"x")]),
}
OTHERS: Final[dict[str, tuple[Channel, Callable[[Any], Any]]]] = {
    "samples of another frame": (channels.SAMPLES, lambda samples: replace(samples, digest=flipped(samples.digest, 3))),
    "samples of another node": (channels.SAMPLES, lambda samples: replace(samples, node=NOBODY)),
    "a Done of another start": (channels.UP, lambda up: replace(up, boot="other")),
    "a Done of another client": (channels.UP, lambda up: replace(up, name="player-red" if "blue" in up.name else "x")),
}
SPOILED: Final = {
    **{f"part: {what}": (channels.PART, spoil) for what, spoil in PARTS.items()},
    **{f"order: {what}": (channels.ORDER, spoil) for what, spoil in ORDERS.items()},
    **{f"commit: {what}": (channels.COMMIT, spoil) for what, spoil in COMMITS.items()},
    **OTHERS,
}


@pytest.mark.parametrize("what", SPOILED)
def test_a_spoiled_copy_that_comes_first_is_refused_and_the_true_one_counts(disturbed: Disturbed, what: str) -> None:
    """The copy is said, on the same key, at the moment at which the true message is: every reader has it before."""
    channel, spoil = SPOILED[what]
    said: list[tuple[str, int]] = []

    def speak_first(traced: Traced) -> None:
        plane = Plane.RADIO if traced.process in PLAYERS else Plane.SIMULATION
        if (traced.what, traced.channel, plane) != ("publish", channel.name, channel.plane):
            return
        message = decode_any(channel.message, traced.payload)
        at = traced.process, getattr(message, "tick", 0)
        if 20 <= at[1] < 70 and at not in said:
            said.append(at)
            name = {channels.COMMIT: VHUB, channels.ORDER: SUPERVISOR}.get(channel, traced.process)
            disturbed.system.bus.put(NOBODY, channel, name, encode(spoil(message)), traced.now_ns)

    disturbed.settings.observer = speak_first
    result = disturbed.go()
    assert len(said) >= 10
    disturbed.assert_untouched(result)
    counted = disturbed.counts("refused", "malformed", "repeated")
    assert sum(counted.values()) >= len(said) or what == "samples of another frame", "that one leads to nothing"


def test_a_part_with_another_input_digest_is_a_node_that_has_diverged_and_is_lost(disturbed: Disturbed) -> None:
    """It is a bug, never repaired silently: the run goes on without the node, which comes back as a newcomer."""

    def speak_first(traced: Traced) -> None:
        if (traced.what, traced.channel, traced.process) == ("publish", channels.PART.name, "n2"):
            part = decode(Part, traced.payload)
            if part.tick == 50:
                forged = encode(replace(part, input_digest=bytes(32)))
                disturbed.system.bus.put(NOBODY, channels.PART, "n2", forged, traced.now_ns)

    disturbed.settings.observer = speak_first
    result = disturbed.go()
    assert result.digests == disturbed.undisturbed()[0].digests and not result.json["failed"]
    lost, *_ = result.json["recoveries"]
    assert (lost["what"], lost["name"], lost["tick"], lost["epoch"]) == ("node", "n2", 49, 2)
    assert lost["reason"] == "has diverged: its part 50 has another input digest"


# --- well-formed messages --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_strangers_on_the_radio_plane_change_nothing(disturbed: Disturbed, seed: int) -> None:
    """Well-formed messages from who is not let in, or who pretends to be a player without its boot."""
    talk = disturbed.talk(seed)

    def speak() -> None:
        channel = talk.rng.choice((channels.UP, channels.CLIENT_HELLO))
        name = talk.rng.choice((*PLAYERS, "n1", "camera", NOBODY))
        message = talk.about(channel, disturbed.system.supervisor.state.frame.tick)
        disturbed.put(channel, name, replace(message, name=name, boot=talk.rng.choice(("other", "b", "x" * 32))))

    for _ in range(200):
        disturbed.at(1 + talk.rng.randrange(disturbed.ticks - 20), speak)
    disturbed.assert_untouched(disturbed.go())
    assert disturbed.counts("repeated")[VHUB] > 50


@pytest.mark.parametrize("seed", range(8))
def test_whatever_well_formed_messages_come_the_run_ends_in_order(disturbed: Disturbed, seed: int) -> None:
    talk = disturbed.talk(seed)

    def speak() -> None:
        supervisor = disturbed.system.supervisor
        of_runs = [channel for channel in CHANNELS if channel.plane is not Plane.REPLAY]
        channel = talk.rng.choice([channel for channel in of_runs if channel is not channels.END])
        message = talk.about(channel, supervisor.state.frame.tick)
        name = talk.rng.choice((*disturbed.system.processes, "operator", NOBODY))
        truths = {"sender": name, "node": name, "name": name, "epoch": supervisor.state.epoch}
        for field, truth in truths.items():
            if field in message.__struct_fields__ and talk.rng.random() < 0.8:
                message = replace(message, **{field: truth})
        disturbed.put(channel, name, message)

    for _ in range(40):
        disturbed.at(talk.rng.randrange(disturbed.ticks - 20), speak)
    result = disturbed.go()
    assert disturbed.system.supervisor.state.finished and result.json["reason"]
    ticks = [frame.tick for frame in disturbed.frames]
    assert all(later == earlier + 1 for earlier, later in pairwise(ticks)), "history is written once"
