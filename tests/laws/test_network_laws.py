"""Law 5: every offered packet has one fate, on every link at every tick."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.protocol.messages import Sent
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


def test_refused_packets_are_in_no_account() -> None:
    state, frame = state_with(LINK)
    sent = [Sent(1, "nobody", "echo", 0, b""), Sent(2, "red.goal", "echo", 0, b""), Sent(2, "red.goal", "echo", 0, b"")]
    close(state, frame, [], {"player-red": sent, "stranger": [Sent(1, "red.goal", "echo", 0, b"")]})
    assert state.refusals == {"no_route": 1, "duplicate": 1, "unknown_source": 1}
    assert (state.packets.offered, state.packets.refused) == (1, 3)
