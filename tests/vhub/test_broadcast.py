"""What a client says to nobody in particular: one offered packet for each who has subscribed to its channel."""

from __future__ import annotations

from pathlib import Path

import pytest

from foosim.common import limits
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.protocol.messages import Sent
from foosim.vhub.network.memory import Joining
from foosim.vhub.network.packet import Flight
from foosim.vhub.state.hub_state import HubState
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.frame import Frame

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
SETS = (
    "clients={ear: {}, base: {}}",
    "network.links=[{id: lossy, from: player-red, to: '*', loss: 50 %}]",
)


class Hall:
    """A hub's state where player-red may be heard: by the ear, the base and player-blue."""

    def __init__(self) -> None:
        self.deployment = load_deployment(apply_sets(TABLE.read_text(), TABLE.name, SETS), TABLE.name)
        self.state = HubState(self.deployment)
        self.frame = initial_frame(self.deployment)
        for name, channels in {"player-red": [], "ear": ["beacon"], "base": ["beacon", "log"]}.items():
            self.state.join(Joining(name, 0, [("player-red", channel) for channel in channels]), 0)

    def close(self, *sent: Sent) -> list[Flight]:
        """Close a tick at which player-red says this; return the fates up to the next one's arrivals."""
        fates: list[Flight] = []
        tick = self.state.closed + 1
        self.state.close_world(Frame(tick, self.frame.layout, self.frame.values), [], fates)
        self.state.close_clients(Frame(tick, self.frame.layout, self.frame.values), {"player-red": sent}, fates)
        return fates

    def say(self, numbers: range, channel: str, destination: str = "") -> list[tuple[str, int, str]]:
        """Log these packets at one tick; return (receiver, sequence, cause) of each that was offered."""
        fates = self.close(*[Sent(number, destination, channel, 0, b"here") for number in numbers])
        return sorted((f.destination, f.sequence, f.cause) for f in [*fates, *self.close()])


def test_each_subscriber_is_one_offered_packet_with_luck_of_its_own() -> None:
    hall = Hall()
    fates = hall.say(range(1, 65), "beacon")
    assert [(name, number) for name, number, _ in fates] == [(n, k) for n in ("base", "ear") for k in range(1, 65)]
    lost = {name: {number for n, number, cause in fates if n == name and cause} for name in ("base", "ear")}
    assert 20 < len(lost["base"]) < 44 and 20 < len(lost["ear"]) < 44 and lost["base"] != lost["ear"]
    packets = hall.state.packets
    assert (packets.offered, packets.in_flight, packets.refused) == (128, 0, 0)
    assert packets.dropped == len(lost["base"]) + len(lost["ear"])


def test_the_luck_of_a_receiver_does_not_depend_on_who_else_hears() -> None:
    alone, both = Hall(), Hall()
    alone.state.leave("ear")
    assert alone.say(range(1, 33), "beacon") == [fate for fate in both.say(range(1, 33), "beacon") if fate[0] == "base"]


def test_only_those_who_hear_the_channel_get_it() -> None:
    hall = Hall()
    assert {name for name, _, _ in hall.say(range(1, 3), "log")} == {"base"}
    assert hall.say(range(3, 5), "unheard") == []
    assert hall.state.packets.offered == 2 and hall.state.packets.refused == 0
    assert {name for name, _, _ in hall.say(range(5, 7), "beacon", "ear")} == {"ear"}


def test_the_state_goes_on_from_its_bytes_with_broadcasts_in_flight() -> None:
    hall, twin = Hall(), Hall()
    hall.close(*[Sent(number, "", "beacon", 0, b"here") for number in range(1, 9)])
    assert hall.state.packets.in_flight > 0
    twin.state = HubState.restore(hall.deployment, hall.state.snapshot())
    assert [(f.destination, f.sequence) for f in twin.close()] == [(f.destination, f.sequence) for f in hall.close()]
    assert twin.say(range(9, 17), "beacon") == hall.say(range(9, 17), "beacon")


def test_a_flood_of_broadcasts_is_refused_from_a_bound_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "PACKETS_PER_MESSAGE_MAX", 10)
    hall = Hall()
    assert len(hall.say(range(1, 9), "beacon")) == 10
    assert hall.state.refusals == {"broadcast_full": 3}
    assert len(hall.say(range(9, 13), "beacon")) == 8, "each tick begins anew"
