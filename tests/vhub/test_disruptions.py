"""Events that are asked for while the run goes on do what the same events do in a deployment, and outlive a restart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Final

from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.common.json_text import encode_json
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.network.rules import Event
from foosim.deployment.schema import Deployment
from foosim.protocol.messages import Sent
from foosim.vhub.network.memory import Joining
from foosim.vhub.network.packet import Flight
from foosim.vhub.state.hub_state import HubState
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.edits import Disrupt
from foosim.world.frame import Frame
from foosim.world.robot_packets import RobotPacket

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TICKS: Final = 60
TICK_NS: Final = 2_000_000
PLAYERS: Final = ("player-blue", "player-red")
LINKS: Final = (
    "{id: lan, between: ['*', '*'], delay: 1 ms, jitter: {shape: gamma, sd: 2 ms},"
    " reorder: {probability: 5 %, extra: 3 ms}, duplicate: 5 %, loss: 5 %}"
)
Script = Sequence[tuple[int, Mapping[str, Any]]]
"""Events by the tick at which they happen, in order."""
Fates = dict[tuple[str, str, int, int], tuple[str, int, int]]
"""Cause, due time and arrival tick by source, destination, sequence and copy."""


@cache
def deployment_with(links: str = LINKS) -> Deployment:
    return load_deployment(apply_sets(TABLE.read_text(), TABLE.name, [f"network.links=[{links}]"]), TABLE.name)


def planned(script: Script) -> Deployment:
    """The deployment with the events in it."""
    deployment = deployment_with()
    events = [Event.model_validate({"at": f"{tick * TICK_NS} ns", **event}) for tick, event in script]
    return deployment.model_copy(update={"network": deployment.network.model_copy(update={"events": events})})


def fates_of(
    deployment: Deployment, asked: Script = (), ticks: int = TICKS, restarts: frozenset[int] = frozenset()
) -> Fates:
    """Send over the table's network for some ticks; at `restarts` the state is written down and taken up again."""
    state, frame = HubState(deployment), initial_frame(deployment)
    for name in PLAYERS:
        state.join(Joining(name, 0, [("red.goal", "encoder")]), 0)
    fates: list[Flight] = []
    for tick in range(ticks):
        edits = [Disrupt(encode_json(event).decode()) for at, event in asked if at == tick]
        at_tick = Frame(tick, frame.layout, frame.values)
        state.close_world(at_tick, [RobotPacket("red.goal", 0, "", "encoder", bytes(16))], fates, edits)
        sent = [Sent(2 * tick + 1, "red.goal", "echo", 0, bytes(8)), Sent(2 * tick + 2, PLAYERS[0], "talk", 0, b"x")]
        state.close_clients(at_tick, {"player-red": sent}, fates)
        if tick in restarts:
            snapshot = state.snapshot()
            state = HubState.restore(deployment, snapshot)
            assert state.snapshot() == snapshot
    found = {
        (f.source, f.destination, f.sequence, f.copy): (f.cause, f.due_ns, f.arrival_tick)
        for f in [*fates, *state.in_flight()]
    }
    assert len(found) == len(fates) + len(state.in_flight()), "a packet has one fate"
    return found


TIMES = st.sampled_from(["3 ms", "10 ms", "31 ms"])
EVENTS = st.one_of(
    st.fixed_dictionaries({"partition": st.just([["player-*"], ["rest"]])}, optional={"for": TIMES}),
    st.builds(lambda: {"partition": [["player-red"], ["rest"]], "symmetric": False}),
    st.fixed_dictionaries(
        {"clog": st.sampled_from([{"from": "*", "to": "*"}, {"from": "player-red", "to": "red.*"}])},
        optional={"for": TIMES},
    ),
    st.builds(lambda loss: {"set": {"link": "lan", "loss": loss, "ttl": "8 ms"}}, st.sampled_from(["0 %", "50 %"])),
    st.builds(lambda what: {"heal": what}, st.sampled_from(["all", "clogs", "settings"])),
)
SCRIPTS = st.lists(st.tuples(st.integers(1, TICKS - 10), EVENTS), max_size=6).map(
    lambda script: sorted(script, key=lambda at: at[0])
)


@settings(max_examples=30)
@given(script=SCRIPTS)
def test_what_is_asked_for_does_what_it_does_in_a_deployment(script: Script) -> None:
    """But to what reaches robots at that very tick: that is said already."""
    usual, asked = fates_of(planned(script)), fates_of(deployment_with(), script)
    assert usual.keys() == asked.keys()
    ticks = {at for at, _ in script}
    for key, fate in usual.items():
        is_said = key[1] == "red.goal" and not ticks.isdisjoint({asked[key][2], -(-fate[1] // TICK_NS)})
        assert is_said or asked[key] == fate, key
