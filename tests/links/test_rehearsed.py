"""Fates of whole runs (T22): the same on one, two and three nodes, at another pace, with a node that is lost.

The football table, its camera and players on the air: Wi-Fi with fading, IEEE 802.15.4, LoRa; with events.
"""

from __future__ import annotations

from typing import Final

import msgspec
import pytest

from foosim.common.units import Pace
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings, System
from foosim.vhub.recording.rows_of_closing import packet_row
from foosim.vhub.state.records import Closing
from tests.links.offered import TABLE
from tests.links.proof import Proof

TICKS: Final = 60
RADIOS: Final = {
    "wifi": "w: {preset: wifi_5_indoor, fading: {kind: rician}, duplicate: 10 %, published: unicast}",
    "broadcast": "w: {preset: wifi_2_4_indoor, tx_power: -40 dBm, duplicate: 10 %}",
    "zigbee": "w: {preset: zigbee, retries: 1}",
    "lora": "w: {preset: lora_eu868, duty_cycle: 100 %, bandwidth: 500 kHz}",
}
PLACES: Final = "network.places={camera: [0 m, 0 m, 1.5 m], '*red*': [-3 m, 0 m, 1 m], '*': [3 m, 1 m, 1 m]}"
EVENTS: Final = (
    "network.events=[{at: 40 ms, for: 20 ms, partition: [[player-red], [rest]]}, "
    "{at: 70 ms, for: {exponential: 9 ms}, clog: {from: '*', to: red.goal}}]"
)
Row = bytes


def fates(radio: str, nodes: int, pace: Pace | None = None, disturbed: bool = False) -> tuple[list[Row], list[bytes]]:
    """All rows of a rehearsal but their wall time, and the world's digests."""
    rows: list[Row] = []

    def keep(closing: Closing) -> None:
        for flight in closing.fates:
            rows.append(msgspec.json.encode(msgspec.structs.replace(packet_row(flight), wall_released_ns=0)))

    def prepare(system: System) -> None:
        if disturbed:
            system.at_tick(20, lambda: system.kill("n2"))
            system.at_tick(35, lambda: system.start("n2"))

    sets = [f"network.radios={{{RADIOS[radio]}}}", "network.robots={'*': [w]}", PLACES, EVENTS, "network.links=[]"]
    found = rehearse(TABLE.read_text(), "table.yaml", TICKS, nodes, [*sets, "engine=pure"],
                     Settings(on_closing=keep), pace=pace, prepare=prepare)  # fmt: skip
    return rows, found.digests


@pytest.mark.parametrize("radio", RADIOS)
def test_fates_do_not_know_nodes_or_pace(proof: Proof, radio: str) -> None:
    once, digests = fates(radio, 1)
    assert len(once) > 100
    for nodes, pace, disturbed in ((2, None, False), (3, Pace("realtime"), True)):
        rows, world = fates(radio, nodes, pace, disturbed)
        assert rows == once, f"{nodes} nodes, {pace}"
        assert world == digests
    proof.exact("T22", f"{radio}: fates that differ on 2 and 3 nodes, one lost and back, in real time", 0, 0, len(once))
