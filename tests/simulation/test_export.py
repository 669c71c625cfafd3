"""Tables of captures: read back they are what `open_capture` gives, to the last bit, as CSV and as Parquet."""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import msgspec
import pyarrow.parquet as pq
import pytest

from foosim.capture import export as export_module
from foosim.capture.export import export_capture
from foosim.capture.mcap.format import Message
from foosim.capture.reader import open_capture
from foosim.capture.rows import PacketRow
from foosim.capture.tables import table_names, table_of
from foosim.common.errors import Failed
from foosim.common.json_text import encode_json
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.library.table.rod_position import Command
from foosim.world.component_types.per_field import codec_of
from foosim.world.component_types.registry import find_component
from tests.own_components import folder_on_path, written
from tests.simulation.conftest import TABLE, TICK_NS, messages_of, replay, rewritten, with_row

KINDS: Final = {
    "ball": ("sensor", "ball"),
    "encoder": ("sensor", "encoder"),
    "position": ("actuator", "rod_position"),
}
"""What the table's channels carry."""


def lines_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def test_packets_read_back_as_csv_are_those_of_the_capture(run: Path, tmp_path: Path) -> None:
    done = export_capture(run, "packets", tmp_path / "packets.csv")
    packets = open_capture(run).packets
    lines = lines_of(tmp_path / "packets.csv")
    assert done.rows == len(lines) == len(packets) > 500
    for name in ("sequence", "copy", "sent_ns", "stamp_ns", "due_ns", "arrival_tick", "size", "wall_released_ns"):
        assert [int(line[name]) for line in lines] == getattr(packets, name).tolist(), name
    for name in ("source", "destination", "channel", "fate", "cause", "rule"):
        assert [line[name] for line in lines] == getattr(packets, name).tolist(), name
    assert [bytes.fromhex(line["payload"]) for line in lines] == packets.payload.tolist()
    for line in lines:
        value = msgspec.json.decode(line["value"])
        codec = codec_of(find_component(*KINDS[line["channel"]]))
        decoded = codec.decode(bytes.fromhex(line["payload"]))
        assert list(value.values()) == codec.numbers(decoded) and tuple(value) == codec.names


def test_commands_have_their_numbers(run: Path, tmp_path: Path) -> None:
    export_capture(run, "commands", tmp_path / "commands.csv")
    packets = open_capture(run).packets
    commands = packets.where(packets.channel == "position")
    lines = lines_of(tmp_path / "commands.csv")
    assert 100 < len(lines) == len(commands) < len(packets)
    numbers = [codec_of(find_component(*KINDS["position"])).decode(payload) for payload in commands.payload]
    assert [Command(float(line["slide"]), float(line["spin"])) for line in lines] == numbers
    assert [int(line["due_ns"]) for line in lines] == commands.due_ns.tolist()
    assert "payload" not in lines[0]


OWN_ACTUATOR: Final = """
from foosim.world.component_types.quantities import Newtons


class Pull(Struct, frozen=True):
    slide: Newtons
    sequence: Metres
    several: tuple[float, ...]


@actuator("own", ActuatorSettings, Pull, needs=("joint_positions",))
class Actuator(Own):
    _rate = slot()

    def limits(self):
        return {}

    def accept(self, command, view):
        return True

    def hold(self, view):
        view.write(self._rate, 0.0)

    def excite(self, view):
        view.write(self._rate, 1.0)

    def command(self, view):
        return (0.0, 1.0), (view.read(self._rate)[0], 2.0)
"""


def test_commands_of_somebodys_own_have_their_numbers_units_and_names(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of several numbers JSON, of two units none, and a name of its own where packets have that column."""
    written(folder_on_path(tmp_path, monkeypatch), OWN_ACTUATOR)
    own_alone = "robots.red.goal.actuators={own: {kind: 'own_form:Actuator'}}"
    sets = ("players={}", "robots.red.goal.actuators=null", own_alone)
    deployment = load_deployment(apply_sets(TABLE.read_text(), TABLE.name, sets), TABLE.name)
    table = table_of("commands", deployment)
    columns = {column.name: (column.kind, column.unit) for column in table.columns}
    assert columns["sequence"] == ("integer", "") and columns["command_sequence"] == ("number", "m")
    assert (
        columns["several"] == ("json", "")
        and columns["slide"] == ("number", "")
        and columns["spin"] == ("number", "rad")
    )

    own = codec_of(find_component("actuator", "own_form:Actuator"))
    pull = own.encode(own.kind(1.5, 2.5, (3.0, 4.0)))
    rod = codec_of(find_component(*KINDS["position"])).encode(Command(0.25, 0.5))
    expected = {
        ("red.goal", "own", pull): (1.5, 2.5, "[3.0,4.0]", None),
        ("red.attack", "position", rod): (0.25, None, None, 0.5),
    }
    for (robot, channel, payload), cells in expected.items():
        packet = PacketRow("me", 7, 0, robot, channel, 0, 0, 0, 0, "delivered", "", "", "", "", 0, payload, 0)
        message = Message("/packets", 0, 0, 0, encode_json(packet))
        (row,) = table.rows(lambda decoder, told: decoder.decode(told.data), message)
        found = dict(zip(columns, row, strict=True))
        assert found["sequence"] == 7
        assert tuple(found[name] for name in ("slide", "command_sequence", "several", "spin")) == cells


def test_poses_are_those_of_the_frames(run: Path, tmp_path: Path) -> None:
    export_capture(run, "poses", tmp_path / "poses.csv")
    capture = open_capture(run)
    lines = lines_of(tmp_path / "poses.csv")
    assert {line["link"] for line in lines} > {"ball", "ball-2", "red.goal/slide", "red.goal/spin"}
    for link in ("ball", "ball-2", "red.goal/spin"):
        mine = [line for line in lines if line["link"] == link]
        poses = capture.poses(link)
        place = {int(tick): index for index, tick in enumerate(poses.ticks)}
        framed = [line for line in mine if int(line["time_ns"]) // TICK_NS in place]
        assert len(framed) > 20 and len(mine) - len(framed) <= 1, "poses also stand where the layout changed"
        for line in framed:
            index = place[int(line["time_ns"]) // TICK_NS]
            assert [float(line[name]) for name in "xyz"] == poses.positions[index].tolist()
            assert [float(line[f"q{name}"]) for name in "xyzw"] == poses.orientations[index].tolist()


@pytest.mark.parametrize("what", table_names())
def test_every_table_is_the_same_as_parquet(run: Path, tmp_path: Path, what: str) -> None:
    as_csv = export_capture(run, what, tmp_path / "table.csv")
    as_parquet = export_capture(run, what, tmp_path / "table.parquet")
    table = pq.read_table(tmp_path / "table.parquet")
    lines = lines_of(tmp_path / "table.csv")
    assert as_csv.rows == as_parquet.rows == table.num_rows == len(lines)
    assert table.column_names == [column.name for column in as_csv.columns]
    for column in as_csv.columns:
        field = table.schema.field(column.name)
        unit = (field.metadata or {}).get(b"unit", b"").decode()
        assert unit == column.unit and (unit == "ns") == column.name.endswith("_ns"), column
        values = table.column(column.name).to_pylist()
        texts = [line[column.name] for line in lines]
        assert [as_text(value) for value in values] == texts, column


def as_text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    return value.hex() if isinstance(value, bytes) else str(value)


def test_integers_are_never_rounded(run: Path, tmp_path: Path) -> None:
    """2^53 + 1 is no float64: a sequence number of a robot grows beyond it in a long run."""
    great = 2**53 + 1
    messages = [with_row(m, sequence=great) if m.topic == "/packets" else m for m in messages_of(run)]
    path = rewritten(run, tmp_path / "great.mcap", messages)
    for name in ("great.csv", "great.parquet"):
        export_capture(path, "packets", tmp_path / name)
    assert {line["sequence"] for line in lines_of(tmp_path / "great.csv")} == {str(great)}
    assert set(pq.read_table(tmp_path / "great.parquet").column("sequence").to_pylist()) == {great}


def test_a_table_is_written_in_batches(run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(export_module, "BATCH_ROWS", 100)
    sizes: list[int] = []
    write = export_module.CsvSink.write

    def counting(self: export_module.CsvSink, rows: list[tuple[Any, ...]]) -> None:
        sizes.append(len(rows))
        write(self, rows)

    monkeypatch.setattr(export_module.CsvSink, "write", counting)
    done = export_capture(run, "packets", tmp_path / "packets.csv")
    assert sum(sizes) == done.rows and max(sizes) == 100
    export_capture(run, "packets", tmp_path / "packets.parquet")
    file = pq.ParquetFile(tmp_path / "packets.parquet")
    assert file.num_row_groups == len(sizes) - (sizes[-1] == 0)


def test_the_command_writes_files_and_standard_output(run: Path, tmp_path: Path) -> None:
    out = tmp_path / "poses.csv"
    done = replay("export", run, "--what", "poses", "-o", out)
    assert done.code == 0 and done.out.startswith(f"{out}: ") and "rows of poses, 9 columns" in done.out
    shown = replay("export", run, "--what", "poses", "-o", "-")
    assert shown.code == 0 and shown.out == out.read_text()
    told = replay("export", run, "-o", tmp_path / "x.parquet", "--json")
    content = msgspec.json.decode(told.out)
    assert content["rows"] == len(open_capture(run).packets) and content["columns"][1]["kind"] == "integer"
    again = replay("export", run, "-o", out)
    assert again.code == 3 and "exists already" in again.err


def refusals(run: Path, tmp_path: Path) -> Iterator[tuple[tuple[str | Path, ...], int, str]]:
    out = tmp_path / "o.csv"
    yield (run, "--what", "packet", "-o", out), 2, "nearest is 'packets'"
    yield (run, "--format", "parqet", "-o", out), 2, "nearest is 'parquet'"
    yield (run, "--format", "parquet", "-o", "-"), 2, "not written to standard output"
    yield (run, "-o", tmp_path / "o.txt"), 2, "--out: the name of a table without --format ends with .csv or .parquet, "
    yield (run, "-o", tmp_path / "none" / "o.csv"), 1, "cannot be written, No such file"
    yield (run, "-o", tmp_path / "none" / "o.parquet"), 1, "cannot be written"


def test_bad_input_is_named_and_leaves_no_file(run: Path, tmp_path: Path) -> None:
    for arguments, code, text in refusals(run, tmp_path):
        done = replay("export", *arguments)
        assert done.code == code and text in done.err, done
    assert not list(tmp_path.iterdir())


def test_without_its_library_parquet_is_refused_with_what_to_install(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(Failed, match=r"pip install 'foosim\[parquet\]'"):
        export_capture(run, "packets", tmp_path / "o.parquet")
    assert not list(tmp_path.iterdir())
    export_capture(run, "packets", tmp_path / "o.csv")
