"""Laws 5 and 6: every offered packet has one fate, and its luck depends on seed, link and number alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.network.rules import Network
from foosim.protocol.messages import Sent
from foosim.runtime.roles.bus import Weather
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings, System
from foosim.vhub.network.memory import Joining
from foosim.vhub.network.packet import Flight
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.records import Closing
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.frame import Frame
from foosim.world.robot_packets import RobotPacket

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
TEXT = TABLE.read_text()
TICKS = 400


def fates_of(closings: Sequence[Closing]) -> dict[tuple[str, str, int, int], tuple[str, int]]:
    """Return (cause, due) by (source, destination, sequence, copy); each packet must be there once."""
    fates: dict[tuple[str, str, int, int], tuple[str, int]] = {}
    for closing in closings:
        for flight in closing.fates:
            key = (flight.source, flight.destination, flight.sequence, flight.copy)
            assert key not in fates, f"two fates of {key}"
            fates[key] = (flight.cause, flight.due_ns)
    return fates


def rehearse_fates(
    nodes: int, sets: Sequence[str] = (), weather: Weather | None = None
) -> dict[tuple[str, str, int, int], tuple[str, int]]:
    closings: list[Closing] = []
    rehearsal = Settings(on_closing=closings.append)
    if weather is not None:
        rehearsal.weather = weather
    result = rehearse(TEXT, TABLE.name, TICKS, nodes, ["engine=pure", *sets], rehearsal)
    fates = fates_of(closings)
    packets = result.json["packets"]
    causes = Counter(cause for cause, _ in fates.values())
    assert len(fates) == packets["offered"] > 3 * TICKS
    assert causes.pop("") == packets["delivered"]
    assert causes.pop("in_flight", 0) == packets["in_flight"]
    assert sum(causes.values()) == packets["dropped"] > 0
    return fates


def test_fates_are_equal_whatever_the_nodes_and_the_order_of_arrival() -> None:
    alone = rehearse_fates(1)
    assert rehearse_fates(3) == alone
    assert rehearse_fates(2, weather=Weather(7, delay_ns=50_000, spread_ns=900_000)) == alone


def test_accounts_balance_on_every_link_at_every_tick() -> None:
    balances = []

    def watch(system: System) -> None:
        def check(closing: Closing) -> None:
            state = system.hub.state
            assert state is not None
            flying = Counter((flight.source, flight.destination) for flight in state.in_flight())
            for (source, destination, _), account in state.fabric.states.items():
                left = account.offered - account.delivered - account.dropped
                assert left == flying[source, destination], (closing.frame.tick, source, destination)
            totals = [
                sum(getattr(link, name) for link in state.fabric.states.values())
                for name in ("offered", "delivered", "dropped")
            ]
            packets = state.packets
            assert totals == [packets.offered, packets.delivered, packets.dropped]
            assert packets.in_flight == sum(flying.values())
            balances.append(closing.frame.tick)

        system.settings.on_closing = check

    rehearse(TEXT, TABLE.name, 400, 2, ["engine=pure"], Settings(), prepare=watch)
    assert balances == list(range(401))


LINK = "{id: one, from: '*', to: '*', delay: 1 ms, jitter: {shape: gamma, sd: 0.3 ms}, loss: 20 %}"


def state_with(links: str) -> tuple[HubState, Frame]:
    """A hub's state of the table with these links, both players joined free-running and hearing red.goal."""
    deployment = load_deployment(apply_sets(TEXT, TABLE.name, [f"network.links=[{links}]"]), TABLE.name)
    state = HubState(deployment)
    for name in ("player-red", "player-blue"):
        state.join(Joining(name, 0, [("red.goal", "encoder")]), 0)
    return state, initial_frame(deployment)


def close(state: HubState, frame: Frame, packets: Sequence[RobotPacket], sent: dict[str, list[Sent]]) -> list[Flight]:
    at_tick = Frame(state.closed + 1, frame.layout, frame.values)
    fates: list[Flight] = []
    state.close_world(at_tick, packets, fates)
    state.close_clients(at_tick, sent, fates)
    return fates


def luck(
    links: str, order: Sequence[int], skipped: frozenset[int] = frozenset()
) -> dict[tuple[str, int], tuple[int, ...]]:
    """Send 40 packets a tick to red.goal in some order of arrival; return the draws by (source, sequence)."""
    state, frame = state_with(links)
    draws: dict[tuple[str, int], tuple[int, ...]] = {}
    for tick in range(6):
        sent = [Sent(1 + tick * 40 + number, "red.goal", "echo", 0, bytes(8)) for number in order]
        sent = [packet for packet in sent if packet.sequence not in skipped]
        for flight in close(state, frame, [], {"player-red": sent}):
            draws[flight.source, flight.sequence] = flight.words
    for flight in state.in_flight():
        draws[flight.source, flight.sequence] = flight.words
    return draws


@cache
def usual_luck() -> dict[tuple[str, int], tuple[int, ...]]:
    return luck(LINK, range(40))


@settings(max_examples=20)
@given(order=st.permutations(list(range(40))), skipped=st.frozensets(st.integers(1, 240), max_size=100))
def test_draws_depend_on_seed_link_and_number_alone(order: list[int], skipped: frozenset[int]) -> None:
    usual = usual_luck()
    shuffled = luck(LINK, order, skipped)
    assert len(usual) == 240
    assert shuffled == {key: words for key, words in usual.items() if key[1] not in skipped}


def test_draws_do_not_change_when_an_impairment_is_switched_on() -> None:
    lossless = LINK.replace(", loss: 20 %", "")
    assert luck(lossless, range(40)) == luck(LINK, range(40))
    assert luck(LINK.replace("0.3 ms", "0.9 ms"), range(40)) == luck(LINK, range(40))


def test_another_seed_gives_another_luck() -> None:
    one = luck(LINK, range(40))
    assert one[("player-red", 1)] != one[("player-red", 2)]


def test_refused_packets_are_in_no_account() -> None:
    state, frame = state_with(LINK)
    sent = [Sent(1, "nobody", "echo", 0, b""), Sent(2, "red.goal", "echo", 0, b""), Sent(2, "red.goal", "echo", 0, b"")]
    close(state, frame, [], {"player-red": sent, "stranger": [Sent(1, "red.goal", "echo", 0, b"")]})
    assert state.refusals == {"no_route": 1, "duplicate": 1, "unknown_source": 1}
    assert (state.packets.offered, state.packets.refused) == (1, 3)


@pytest.mark.parametrize("loss", [0.001, 0.01, 0.1, 0.5])
def test_loss_is_what_is_configured(loss: float) -> None:
    """Binomial, 99.9 % interval, fixed seed: |k - n p| < 3.29 sqrt(n p (1 - p))."""
    links = LINK.replace("20 %", f"{loss * 100} %")
    state, frame = state_with(links)
    count, dropped = 200, 0
    ticks = 100
    for tick in range(ticks):
        sent = [Sent(1 + tick * count + number, "red.goal", "echo", 0, b"") for number in range(count)]
        dropped += sum(flight.cause == "random_loss" for flight in close(state, frame, [], {"player-red": sent}))
    total = count * ticks
    assert abs(dropped - total * loss) < 3.29 * (total * loss * (1 - loss)) ** 0.5


def test_a_perfect_network_neither_drops_nor_delays() -> None:
    state, frame = state_with("")
    assert state.deployment.network == Network()
    fates = close(state, frame, [RobotPacket("red.goal", 0, "", "encoder", b"x")], {})
    assert [(flight.destination, flight.cause, flight.due_ns) for flight in fates] == [
        ("player-blue", "", 0),
        ("player-red", "", 0),
    ]
