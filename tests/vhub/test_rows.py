"""Rows of a capture: one for each thing that happened, valid by their own schema, readable by viewers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import fields
from typing import TYPE_CHECKING, Any, Final, get_type_hints

import msgspec
import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from foosim.capture.columns import Packets, frames_of, word_of
from foosim.capture.file import Entry, epoch_row
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.rows import (
    AGES,
    METRICS,
    NOTHING_MORE,
    PACKETS,
    ROW_TYPES,
    ClientRow,
    EditRow,
    FrameRow,
    LayoutRow,
    PacketRow,
    TickRow,
    edit_of,
    json_schema,
)
from foosim.common.keyed_random import Slot, chance_threshold, draw_key, draw_words
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import load_deployment
from foosim.vhub.network.memory import FlightState
from foosim.vhub.network.packet import Flight, flight_of, level_cdbm, state_of
from foosim.vhub.recording.rows_of_closing import (
    edit_row,
    packet_entry,
    packet_row,
    world_rows,
)
from foosim.world.assembly.world import build_scene
from foosim.world.edits import Add, Edit, Push, Remove
from foosim.world.frame import Frame
from foosim.world.kinematics import CENTRE_OF_SLOT, forward_kinematics, twist
from foosim.world.layout import build_layout
from tests.components.worlds import DEPLOY
from tests.vhub.conftest import DOWN_FROM, DOWN_TO
from tests.whole_worlds import assets, written, yard

if TYPE_CHECKING:
    from foosim.deployment.schema import Deployment
    from tests.vhub.conftest import HubRun


@pytest.fixture(scope="module")
def entries(hub_run: HubRun) -> list[Entry]:
    """All rows of the run, in the order in which a writer writes them."""
    known: Frame | None = None
    made: list[Entry] = []
    for epoch in hub_run.epochs:
        at_ns = epoch.tick * hub_run.deployment.tick_ns
        made.append(("/epochs", at_ns, at_ns, epoch.tick, epoch_row(epoch)))
    for closing in hub_run.closings:
        made += [*world_rows(closing, hub_run.deployment, known), *map(packet_entry, closing.fates)]
        known = closing.frame
    return made


def rows(entries: list[Entry], kind: type[Any]) -> list[Any]:
    return [entry[4] for entry in entries if type(entry[4]) is kind]


def test_each_thing_that_happened_has_one_row(hub_run: HubRun, entries: list[Entry]) -> None:
    account = hub_run.state.packets
    assert [row.tick for row in rows(entries, TickRow)] == list(range(65))
    assert [row.tick for row in rows(entries, LayoutRow)] == [0]
    assert [row.tick for row in rows(entries, FrameRow)] == [0, 10, 20, 30, 40, 50, 60]
    events = [(row.tick, row.client, row.event, row.period) for row in rows(entries, ClientRow)]
    assert events == [
        (0, "player-blue", "joins", 5),
        (0, "player-red", "joins", 5),
        (3, "watcher", "joins", 0),
        (35, "watcher", "leaves", 0),
        (50, "watcher", "joins", 0),
    ]
    packets = rows(entries, PacketRow)
    fates = Counter(row.fate for row in packets)
    assert len(packets) == account.offered
    assert fates == {"delivered": account.delivered, "dropped": account.dropped, "in_flight": account.in_flight}
    keys = Counter((row.source, row.destination, row.sequence, row.copy) for row in packets)
    assert set(keys.values()) == {1}


def test_a_run_that_ends_within_a_tick_has_the_fates_of_the_half_that_was_closed(half_closed_run: HubRun) -> None:
    """Packets that robots sent at tick 15 are judged, and some have arrived, before the players are asked."""
    account = half_closed_run.state.packets
    assert half_closed_run.state.closed == 14 and half_closed_run.closings[-1].frame.tick == 15
    fates = Counter(flight.cause for closing in half_closed_run.closings for flight in closing.fates)
    assert (fates.total(), fates[""], fates["in_flight"]) == (account.offered, account.delivered, account.in_flight)
    assert any(not flight.cause for flight in half_closed_run.closings[-1].fates)


def test_a_frame_that_is_known_brings_its_packets_alone(hub_run: HubRun) -> None:
    last = hub_run.closings[-1]
    rest = world_rows(last, hub_run.deployment, last.frame)
    assert last.fates and {topic for topic, *_ in rest} == {AGES, METRICS}, "and ages at use since the last second"


def test_rows_stand_at_their_simulated_times(hub_run: HubRun, entries: list[Entry]) -> None:
    row: Any
    for topic, log_ns, publish_ns, sequence, row in entries:
        if topic == PACKETS:
            assert (log_ns, publish_ns) == (row.sent_ns, row.stamp_ns or row.sent_ns)
            assert sequence == row.sequence % 2**32
        else:
            assert log_ns == publish_ns == row.tick * hub_run.deployment.tick_ns
            assert sequence == row.tick


def parse_as_viewers_do(schema: Any, place: str) -> None:
    """What Lichtblick's and Foxglove's reader of JSON schemas accepts (`parseJsonSchema.ts`); it throws at the rest."""
    assert schema["type"] == "object", place
    for name, field in schema["properties"].items():
        at = f"{place}.{name}"
        if field["type"] == "object":
            parse_as_viewers_do(field, at)
        elif field["type"] == "array":
            items = field["items"]
            if items["type"] == "object":
                parse_as_viewers_do(items, at)
            else:
                assert items["type"] in {"boolean", "string", "number", "integer"}, at
                assert "contentEncoding" not in items, at
        else:
            assert field["type"] in {"boolean", "string", "number", "integer"}, at
            assert field.get("contentEncoding") in {None, "base64"}, at


@pytest.mark.parametrize("topic", sorted(ROW_TYPES))
def test_viewers_can_parse_the_schema(topic: str) -> None:
    parse_as_viewers_do(json_schema(ROW_TYPES[topic]), topic)


def words_of(row: PacketRow, deployment: Deployment) -> tuple[int, ...]:
    """The draws of a packet, by the address that its row has."""
    ends = row.source, row.destination
    if row.source not in deployment.robots:
        return draw_words(draw_key(deployment.seed, "link", *ends), row.sequence)
    key = draw_key(deployment.seed, "link", *ends, "channel", row.channel)
    return draw_words(key, (row.sent_ns // deployment.tick_ns << 16) + row.count)


def test_a_verdict_can_be_told_from_the_inputs_in_its_row(hub_run: HubRun, entries: list[Entry]) -> None:
    """The words are the packet's own keyed draws; that of loss decides the loss, and is there when it was asked."""
    threshold = chance_threshold(0.2)
    seen = set()
    for row in rows(entries, PacketRow):
        words = words_of(row, hub_run.deployment)
        lost, early = row.cause == "random_loss", row.cause in ("random_loss", "node_down")
        seen.add((row.rule, row.fate, row.cause))
        assert row.size == len(row.payload)
        assert (row.fate == "dropped") == (row.cause != "")
        assert (row.due_ns == -1) == (row.arrival_tick == -1) == early
        if row.cause == "node_down":
            assert row.source == "red.attack" and DOWN_FROM <= row.sent_ns // hub_run.deployment.tick_ns < DOWN_TO
        elif row.rule == "slow":
            assert row.loss_word == row.jitter_word == ""
            assert row.due_ns >= row.sent_ns + 7_000_000
        elif row.rule == "steady":
            assert (row.loss_word, row.jitter_word) == ("", f"{words[Slot.JITTER]:016x}")
        else:
            assert row.loss_word == f"{words[Slot.LOSS]:016x}"
            assert (words[Slot.LOSS] < threshold) == lost
            assert row.jitter_word == ("" if lost else f"{words[Slot.JITTER]:016x}")
    assert {fate for _, fate, _ in seen} == {"delivered", "dropped", "in_flight"}
    assert {rule for rule, _, _ in seen} == {"slow", "steady", "wild"}
    assert {cause for rule, _, cause in seen if rule == "slow"} == {"", "rx_down"}
    assert "node_down" in {cause for _, _, cause in seen}


numbers = st.floats(allow_nan=False, allow_infinity=False)
vectors = st.tuples(numbers, numbers, numbers)
names = st.text(min_size=1, max_size=32)
edits = st.one_of(
    st.builds(Add, names, st.lists(numbers, max_size=30)),
    st.builds(Remove, names),
    st.builds(Push, names, vectors),
)


@given(edits)
def test_an_edit_comes_back_to_the_last_bit(edit: Edit) -> None:
    raw = msgspec.json.encode(edit_row(edit))
    back = edit_of(msgspec.json.decode(raw, type=EditRow))
    assert repr(back) == repr(edit)  # tells -0.0 from 0.0


def test_an_edit_of_a_wrong_shape_is_refused() -> None:
    with pytest.raises(CaptureError, match="a vector of 2 numbers, it has 3"):
        edit_of(EditRow("push", "ball", impulse=[0.0, 1.0]))


def test_a_draw_is_read_or_refused() -> None:
    assert (word_of(""), word_of("00000000000000ff")) == (None, 255)
    for text in ("ff", "0x000000000000ff", "00000000000000FF", "00000000000000ff\n", "00000000000000f_f"):
        with pytest.raises(CaptureError, match="it has 16 hex digits"):
            word_of(text)


def distinct_flight() -> Flight:
    """Return a delivered radio packet whose every field has a value of its own."""
    types = get_type_hints(FlightState)
    kinds: dict[type, Callable[[str], Any]] = {str: str, bytes: str.encode, bool: "published".__eq__}
    values: dict[str, Any] = {
        name: kinds[types[name]](name) if types[name] in kinds else 1000 + place
        for place, name in enumerate(FlightState.__struct_fields__)
    }
    lists = {"walls": ("wall",), "by_factor": (), "decided_by": (), "words": tuple(range(5000, 5008))}
    return flight_of(FlightState(**{**values, **lists, "cause": "", "slots": 1 << Slot.LOSS | 1 << Slot.JITTER}))


def test_a_packet_begins_as_its_state_does_and_comes_back_whole() -> None:
    addressed = Flight("camera", "controller", "ball", 1, 2, 3, b"payload")
    assert state_of(addressed) == FlightState("camera", "controller", "ball", 1, 2, 3, b"payload", draw=1, size=7)
    copied = Flight("camera", "controller", "ball", 1, 2, 3, b"payload", True, 1)
    assert state_of(copied) == FlightState("camera", "controller", "ball", 1, 2, 3, b"payload", True, 1, draw=1, size=7)
    state = state_of(distinct_flight())
    assert state_of(flight_of(state)) == state


def test_a_row_has_each_column_of_its_packet_in_its_place() -> None:
    flight = distinct_flight()
    row = packet_row(flight)
    same = set(PacketRow.__struct_fields__) & set(FlightState.__struct_fields__) - {"walls", "decided_by"}
    assert {name: getattr(row, name) for name in same} == {name: getattr(flight, name) for name in same}
    derived = {
        "walls": ["wall"],
        "decided_by": NOTHING_MORE,
        "fate": "delivered",
        "loss_word": flight.words[Slot.LOSS].to_bytes(8).hex(),
        "jitter_word": flight.words[Slot.JITTER].to_bytes(8).hex(),
        "wall_released_ns": flight.released_wall_ns,
        "interference_cdbm": level_cdbm(flight.interference),
        "error_ppm": flight.error_threshold * 1_000_000 >> 64,
        "error_word": flight.words[Slot.ERROR].to_bytes(8).hex(),
    }
    assert {name: getattr(row, name) for name in derived} == derived
    assert same | derived.keys() == set(PacketRow.__struct_fields__)


def test_the_columns_of_a_capture_are_the_first_of_its_rows() -> None:
    names = tuple(field.name for field in fields(Packets))
    assert names == PacketRow.__struct_fields__[: len(names)]


# --- columns of frames -----------------------------------------------------------------------------------------------

ARM: Final = {"model": "urdf", "file": "arm.urdf", "fixed": False, "at": {"x": "5 m", "z": "1 m"}, "sensors": {}}
FREE_SLOTS: Final = (*CENTRE_OF_SLOT, "angular_velocity")


def test_columns_are_of_the_origins_of_links_as_on_tf_and_in_sensors() -> None:
    data = yaml.safe_load(yard())
    data["robots"]["free-arm"] = ARM
    text, files = pin_assets(written(data), "yard.yaml", assets())
    drives = load_deployment(text, "yard.yaml").with_assets(files)
    apart = set()
    for deployment in (drives, load_deployment((DEPLOY / "table.yaml").read_text(), "table.yaml")):
        layout = build_layout(deployment)
        bodies = build_scene(deployment, layout).bodies
        values = np.random.default_rng(1).normal(size=(3, layout.size))
        values[:, [entity.offsets["absent"] for entity in layout.entities if entity.can_leave]] = 0.0
        frames = frames_of(
            "run", layout, bodies, [FrameRow(tick, row.tobytes(), []) for tick, row in enumerate(values)]
        )
        for name, body in bodies.items():
            entity, link = layout[name], body.links[0]
            if not body.is_free:
                assert not {*CENTRE_OF_SLOT, *CENTRE_OF_SLOT.values()} & {*frames.fields(name)}
                continue
            if not link.is_centred:
                apart.add(name)
            columns = {field: frames.column(name, field, 4 if field == "orientation" else 3) for field in FREE_SLOTS}
            centres = [frames.column(name, field, 3) for field in CENTRE_OF_SLOT.values()]
            for index, numbers in enumerate(values.tolist()):
                _, position, orientation = forward_kinematics(body, entity, numbers)[0]
                assert columns["position"][index].tolist() == [*position]
                assert columns["orientation"][index].tolist() == [*orientation]
                moves = twist(body, entity, numbers, 0)
                assert columns["linear_velocity"][index].tolist() == [*moves.linear]
                assert columns["angular_velocity"][index].tolist() == [*moves.angular]
                slots = [numbers[at : at + 3] for at in map(entity.offsets.__getitem__, CENTRE_OF_SLOT)]
                assert [centre[index].tolist() for centre in centres] == slots
            with pytest.raises(CaptureError, match=f"{name}: position has 1 to 3 numbers, not 7"):
                frames.column(name, "position", 7)
    assert apart == {"free-arm", "hull", "scout"}
