"""Robots' share of a closing is found first: fates, deliveries and state are those of judging all in their order."""

from __future__ import annotations

from typing import Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.protocol.messages import Sent
from foosim.vhub.network.memory import Joining
from foosim.vhub.network.packet import Flight, state_of
from foosim.vhub.state.hub_state import HubState
from foosim.world.frame import Frame
from tests.links.offered import ENDS, Hub, deployment_of

WIRED: Final = "{id: wired, from: d, to: red.goal, delay: 3 ms, jitter: {shape: gamma, sd: 2 ms}, loss: 20 %}"
PORT: Final = "{id: port, from: d, to: ['blue.goal', a], rate: 60 kbit/s, queue: {packets: 3}, duplicate: 30 %}"
SETS: Final = {
    "robots without radio": ("network.robots={a: [r], b: [r], c: [r]}", f"network.links=[{WIRED}, {PORT}]"),
    "a robot on the air": (
        "network.robots={'*': [r]}",
        f"network.links=[{WIRED}, {PORT.replace('rate: 60 kbit/s, ', '')}]",
    ),
}
SHARED: Final = (
    "network.radios={r: {preset: wifi_5_indoor}}",
    "network.places={a: [0 m, 0 m, 1 m], b: [40 m, 0 m, 1 m], '*': [4 m, 3 m, 1 m]}",
    "network.defaults={phase: 1 ms}",
)
TRAFFIC: Final = st.lists(
    st.lists(
        st.tuples(st.sampled_from(ENDS), st.sampled_from(("", *ENDS, "red.goal", "blue.goal")), st.integers(0, 60)),
        max_size=8,
    ),
    min_size=3,
    max_size=12,
)


def closed(state: HubState, said: list[list[tuple[str, str, int]]], *, in_halves: bool) -> list[object]:
    """Close ticks under this traffic; return all that comes of them."""
    hub = Hub(state.deployment, state)
    for name in ENDS:
        heard = [(source, "news") for source in ENDS if source != name]
        state.join(Joining(name, 0, heard), 0)
    seen: list[object] = []
    number = 0
    for packets in said:
        sent: dict[str, list[Sent]] = {}
        for source, to, size in packets:
            number += 1
            if to != source:
                sent.setdefault(source, []).append(Sent(number, to, "data" if to else "news", 0, bytes(size)))
        frame = Frame(state.closed + 1, hub.start.layout, hub.start.values)
        fates: list[Flight] = []
        state.close_world(frame, [], fates)
        if in_halves:
            seen.append(state.close_robots(frame, sent))
            fates += state.close_rest()
        else:
            seen.append(state.close_clients(frame, sent, fates))
        seen += [[state_of(flight) for flight in fates], state.snapshot()]
    return seen


@pytest.mark.parametrize("sets", SETS.values(), ids=SETS)
def test_what_robots_get_is_found_first_and_changes_nothing(sets: tuple[str, ...]) -> None:
    deployment = deployment_of(*SHARED, *sets)

    @settings(max_examples=25)
    @given(said=TRAFFIC, in_halves=st.booleans())
    def hold(said: list[list[tuple[str, str, int]]], in_halves: bool) -> None:
        found = closed(HubState(deployment), said, in_halves=in_halves)
        with pytest.MonkeyPatch.context() as patch:  # all is judged in the order of sending, before anything arrives
            patch.setattr(HubState, "_is_apart", lambda state, flight: False)
            assert found == closed(HubState(deployment), said, in_halves=False)

    hold()


def test_a_robots_packet_does_not_wait_for_a_broadcast_by_radio() -> None:
    deployment = deployment_of(*SHARED, *SETS["robots without radio"])
    state = HubState(deployment)
    hub = Hub(deployment, state)
    frame = Frame(0, hub.start.layout, hub.start.values)
    for name in ENDS:
        state.join(Joining(name, 0, [("a", "news")] if name != "a" else []), 0)
    state.close_world(frame, [], [])
    said = state.close_robots(frame, {"a": [Sent(1, "", "news", 0, b""), Sent(2, "red.goal", "position", 0, b"x")]})
    assert [packet.destination for packet in said.packets] == ["red.goal"]
    assert state.packets.offered == 1, "the broadcast is not judged yet"
    assert [(flight.destination, flight.cause) for flight in state.close_rest()][-1] == ("red.goal", "")
    assert state.packets.offered == 1 + 3
