"""Packets that are longer than an mtu travel in frames: airtime, retries, delay and fate by closed forms (T26).

The rates of errors are those of `errors`, which `test_packet_errors` holds to its sources.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

import pytest

from foosim.analysis.explain import PacketName, explain_packet
from foosim.capture.reader import open_capture
from foosim.capture.rows import PACKETS, PacketRow
from foosim.common.keyed_random import UNIT
from foosim.deployment.network.presets import PRESETS
from foosim.simulation.run import rehearse
from foosim.simulation.what_if import what_if
from foosim.vhub.links.fabric import Fabric
from foosim.vhub.network.mtu import frames_of
from foosim.vhub.network.packet import Flight
from foosim.vhub.radio.airtime import (
    LRWPAN_OVERHEAD_BYTES,
    WIFI_OVERHEAD_BYTES,
    lora_airtime_ns,
    lrwpan_airtime_ns,
    wifi_ack_ns,
    wifi_airtime_ns,
)
from foosim.vhub.radio.errors import per_threshold
from foosim.vhub.radio.timings import CATEGORIES, WIFI_5, with_category
from tests.links.offered import MS, TABLE, S, deployment_of, fabric_of, fates, play
from tests.links.proof import Proof
from tests.links.statistics import binomial_z, mean_and_deviation

PICTURE: Final = 40_000
MTU: Final = 1500
MODE: Final = "ofdm_54"
TIMING: Final = with_category(WIFI_5, CATEGORIES["best_effort"])
STEADY: Final = "preset: wifi_5_indoor, shadowing: {on: false}, fading: null, loss: 0 %, delay: 0 ms"


def air(radio: str, metres: float = 3.0) -> Fabric:
    """Return the network of two stations with a radio."""
    return Fabric(
        deployment_of(
            f"network.radios={{air: {{{radio}}}}}",
            "network.robots={a: [air], b: [air]}",
            f"network.places={{a: [0 m, 0 m, 1 m], b: [{metres} m, 0 m, 1 m]}}",
        )
    )


def picture(number: int, sent_ns: int, size: int = PICTURE, *, published: bool = False) -> Flight:
    flight = Flight("a", "b", "data", number, sent_ns, 0, b"poses", published)
    flight.size = size
    return flight


def sent(fabric: Fabric, count: int, size: int = PICTURE, *, published: bool = False) -> list[Flight]:
    """Return pictures that are sent when the one before is through, or lost."""
    return play(fabric, [picture(number, number * S, size, published=published) for number in range(1, count + 1)])


def wifi(mtu: str, snr_cdb: int | None) -> Fabric:
    """Return a network at 54 Mbit/s whose signal is so strong, or as strong as it can be."""
    radio = f"{STEADY}, {mtu} rates: fixed, fixed_rate: 54 Mbit/s"
    if snr_cdb is None:
        return air(radio)
    (probe,) = sent(air(f"{radio}, tx_power: 0 dBm"), 1, 100)
    return air(f"{radio}, tx_power: {(snr_cdb - probe.snr_cdb) / 100.0} dBm")


def test_a_picture_is_lost_as_one_frame_and_arrives_as_27(proof: Proof) -> None:
    """At 22.5 dB: as one frame 0.983 an attempt, 0.87 after eight; 27 frames 27 x 0.144^8, some 4e-6."""
    n = proof.size(400, 4_000)
    whole, part = (per_threshold(MODE, 2250, size + WIFI_OVERHEAD_BYTES) / UNIT for size in (PICTURE, MTU))
    assert whole**8 == pytest.approx(0.87, abs=0.01) and 27 * part**8 == pytest.approx(5e-6, rel=0.1)
    one = sent(wifi("mtu: 60 kB,", 2250), n)
    assert {flight.snr_cdb for flight in one} == {2250}
    lost = sum(flight.cause == "snr" for flight in one)
    proof.normal("T26", "pictures lost as one frame after seven retries", binomial_z(lost, n, whole**8), n)
    many = sent(wifi(f"mtu: {MTU} B,", 2250), n)
    assert [flight.cause for flight in many] == [""] * n and {flight.frames for flight in many} == {27}
    retries = [flight.retries for flight in many]
    last = per_threshold(MODE, 2250, frames_of(PICTURE, MTU)[-1] + WIFI_OVERHEAD_BYTES) / UNIT
    odds = [part] * 26 + [last]
    expected = sum(p / (1.0 - p) for p in odds), sum(p / (1.0 - p) ** 2 for p in odds) ** 0.5
    mean, _ = mean_and_deviation(retries)
    proof.normal("T26", "retries of 27 frames", (mean - expected[0]) / expected[1] * n**0.5, n)


def test_airtime_and_delay_of_a_picture_follow_its_size(proof: Proof) -> None:
    """A strong signal has no retries: each frame waits AIFS and a backoff of 7.5 slots in the mean."""
    n = proof.size(100, 2_000)
    sizes = frames_of(PICTURE, MTU)
    airtime_ns = sum(wifi_airtime_ns(MODE, size, TIMING) for size in sizes)
    tails_ns = 26 * (TIMING.sifs_ns + wifi_ack_ns(MODE, TIMING)) + 27 * TIMING.difs_ns
    slots = []
    for flight in sent(wifi(f"mtu: {MTU} B,", None), n):
        assert (flight.cause, flight.airtime_ns, flight.retries) == ("", airtime_ns, 0)
        parts_ns = flight.access_ns + airtime_ns + flight.propagation_ns + flight.jitter_ns
        assert flight.due_ns - flight.sent_ns == parts_ns
        slots.append((flight.access_ns - tails_ns) / TIMING.slot_ns)
    mean, _ = mean_and_deviation(slots)
    deviation = (27 * (16**2 - 1) / 12) ** 0.5
    assert all(count == int(count) for count in slots)
    proof.normal("T26", "slots of backoff of 27 frames", (mean - 27 * 7.5) / deviation * n**0.5, n)


@pytest.mark.parametrize(
    ("radio", "mtu", "ns_of"),
    [("lora_eu868, duty_cycle: 100 %", 222, partial(lora_airtime_ns, 7)), ("zigbee", 102, lrwpan_airtime_ns)],
)
def test_frames_in_one_turn_are_as_long_as_all_of_them(radio: str, mtu: int, ns_of: Callable[[int], int]) -> None:
    """LoRa sends them in a row, and IEEE 802.15.4 those of a broadcast."""
    (flight,) = sent(air(f"preset: {radio}, shadowing: {{on: false}}, loss: 0 %", 2.0), 1, 1000, published=True)
    airtime_ns = sum(map(ns_of, frames_of(1000, mtu)))
    assert (flight.cause, flight.airtime_ns) == ("", airtime_ns)
    assert flight.air_end_ns - flight.air_start_ns == airtime_ns


def test_a_broadcast_is_lost_with_any_of_its_frames(proof: Proof) -> None:
    """It is sent once, and each frame meets the errors of its length: 802.15.4 near its limit."""
    n = proof.size(400, 4_000)
    radio = "preset: zigbee, shadowing: {on: false}, loss: 0 %"
    (probe,) = sent(air(f"{radio}, tx_power: 0 dBm"), 1, 10)
    fabric = air(f"{radio}, tx_power: {(20 - probe.snr_cdb) / 100.0} dBm")
    found = sent(fabric, n, 250, published=True)
    arrives = 1.0
    for size in frames_of(250, 102):
        arrives *= 1.0 - per_threshold("oqpsk_250", found[0].snr_cdb, size + LRWPAN_OVERHEAD_BYTES) / UNIT
    assert 0.2 < arrives < 0.8
    lost = sum(flight.cause == "snr" for flight in found)
    proof.normal("T26", "broadcasts of three frames lost", binomial_z(lost, n, 1.0 - arrives), n)


def test_a_wire_carries_the_overhead_of_each_frame() -> None:
    (flight,) = fates(fabric_of("rate: 10 Mbit/s, overhead: 38 B, mtu: 1500 B"), [0], 10_000)
    assert (flight.cause, flight.airtime_ns) == ("", (10_000 + 7 * 38) * 800)


def test_pictures_over_a_link_that_is_too_slow_are_late_and_then_dropped() -> None:
    """Ten a second of 20 kB at 1 Mbit/s: each takes 160 ms, so each waits 60 ms longer, until the queue is full."""
    flights = [picture(number, number * 100 * MS, 20_000) for number in range(20)]
    fabric = fabric_of("rate: 1 Mbit/s, mtu: 1500 B, queue: {bytes: 64 kB}")
    play(fabric, flights)
    on_time = [flight for flight in flights if not flight.cause]
    assert [flight.due_ns - flight.sent_ns for flight in on_time[:3]] == [160 * MS, 220 * MS, 280 * MS]
    causes = [flight.cause for flight in flights]
    assert causes[:3] == [""] * 3 and set(causes) == {"", "queue_full"}
    assert all(flight.queue_bytes > 64_000 - 20_000 for flight in flights if flight.cause)


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("rays", [360, 1081])
def test_a_scan_arrives_over_every_preset(preset: str, rays: int) -> None:
    fabric = air(f"preset: {preset}")
    flights = play(fabric, [picture(number, number * 60 * S, 8 * rays) for number in range(1, 6)])
    assert any(not flight.cause for flight in flights), {flight.cause for flight in flights}
    assert "too_big" not in {flight.cause for flight in flights}


def test_times_between_frames_belong_to_others() -> None:
    """A station that becomes ready during a picture has its turn after one of the frames, not after all."""
    fabric = Fabric(
        deployment_of(
            f"network.radios={{air: {{{STEADY}, rates: fixed, fixed_rate: 54 Mbit/s}}}}",
            "network.robots={'*': [air]}",
            "network.places={'*': [0 m, 0 m, 1 m]}",
        )
    )
    long, short = picture(1, 0), Flight("c", "d", "data", 1, MS, 0, bytes(100))
    play(fabric, [long, short])
    assert long.cause == short.cause == ""
    assert short.due_ns < 3 * MS < long.due_ns
    alone = picture(1, 0)
    play(wifi(f"mtu: {MTU} B,", None), [alone])
    assert long.due_ns > alone.due_ns, "its later frames wait for the other station"


def test_the_frames_of_a_captured_packet_are_explained_and_judged_again(tmp_path: Path) -> None:
    """Readings of 8 B a frame near the limit of IEEE 802.15.4: some get across with retries, some do not."""
    radio = "air: {preset: zigbee, published: unicast, mtu: 8 B, shadowing: {on: false}, tx_power: -50 dBm}"
    network = (
        f"network={{radios: {{{radio}}}, robots: {{'*': [air]}}, "
        "places: {camera: [0 m, 0 m, 2 m], 'player*': [3 m, 0 m, 1 m]}}"
    )
    path = tmp_path / "run.mcap"
    rehearse(TABLE.read_text(), "t", 60, 2, [network], capture=path, folder=TABLE.parent)
    capture = open_capture(path)
    judged = what_if(capture)
    assert (judged.changed, judged.inputs_changed) == (0, 0)
    rows = [row for row in capture.rows(PACKETS) if isinstance(row, PacketRow) and row.size > 8]
    lost = next(row for row in rows if row.cause == "snr" and row.decided_by.frame > 1)
    got = next(row for row in rows if row.fate == "delivered" and row.retries)
    for row, what in ((lost, f"number {lost.decided_by.frame} was lost"), (got, f"{got.retries} retries")):
        found = explain_packet(capture, PacketName(row.source, row.sequence, row.destination))
        steps = {step.stage: step for step in found.steps}
        assert steps["admission"].facts["frames"] == len(frames_of(row.size, 8))
        assert what in steps["medium"].text and found.agrees
