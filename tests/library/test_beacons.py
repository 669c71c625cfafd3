"""What rovers say to each other: what was said is understood, and what a network made of it does no harm."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from foosim.library.mobile.players.beacons import (
    Beacon,
    Entry,
    Telemetry,
    decode_beacon,
    decode_fleet,
    decode_telemetry,
    encode_beacon,
    encode_fleet,
    encode_telemetry,
)

ROVERS, SPOTS = 20, 121
BEACON = Beacon(7, 1.5, -2.25, 0.5, 3, 4, 0.42, (2.5, -1.0), ((3, 0.4), (9, 12.5)))
singles = st.floats(-1000, 1000, width=32)
spots = st.integers(0, SPOTS - 1)
ages = st.integers(0, 65535).map(lambda tenths: tenths / 10)


@given(
    st.builds(
        Beacon,
        *(st.integers(0, ROVERS - 1), singles, singles, singles, spots, spots),
        st.integers(0, 100).map(lambda percent: percent / 100),
        st.none() | st.tuples(singles, singles),
        st.lists(st.tuples(spots, ages), max_size=4).map(tuple),
    )
)
def test_a_beacon_says_what_was_said(beacon: Beacon) -> None:
    payload = encode_beacon(beacon)
    assert decode_beacon(payload, ROVERS, SPOTS) == beacon
    assert len(payload) == 19 + 8 * (beacon.seen is not None) + 4 * len(beacon.visits) <= 43


def test_telemetry_and_fleet_say_what_was_said() -> None:
    told = Telemetry(19, 1.5, -2.25, 0.07, 123.5, 12, 3, 120)
    assert decode_telemetry(encode_telemetry(told), ROVERS, SPOTS) == told
    entries = [Entry(1, 5, 6, 0.3), Entry(2, 120, 0, 6553.5)]
    assert decode_fleet(encode_fleet(entries), ROVERS, SPOTS) == entries


@given(st.binary(max_size=60) | st.just(object()) | st.integers())
def test_whatever_comes_is_one_of_them_or_nothing(payload: object) -> None:
    beacon = decode_beacon(payload, ROVERS, SPOTS)
    if beacon is not None:
        assert beacon.number < ROVERS and max(beacon.here, beacon.goal, *(spot for spot, _ in beacon.visits)) < SPOTS
    told = decode_telemetry(payload, ROVERS, SPOTS)
    assert told is None or (told.number < ROVERS and max(told.here, told.goal) < SPOTS)
    assert all(entry.number < ROVERS for entry in decode_fleet(payload, ROVERS, SPOTS) or ())


@given(st.integers(0, len(encode_beacon(BEACON)) * 8 - 1))
def test_a_beacon_with_a_wrong_bit_is_another_one_or_none(bit: int) -> None:
    payload = bytearray(encode_beacon(BEACON))
    payload[bit // 8] ^= 1 << bit % 8
    beacon = decode_beacon(bytes(payload), ROVERS, SPOTS)
    assert beacon is None or beacon != BEACON
