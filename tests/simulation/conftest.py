"""Captures of short runs that the tests of replays share, and the command as a person types it."""

from __future__ import annotations

import signal
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import msgspec
import pytest
from mcap import records
from mcap.reader import make_reader
from typer.testing import CliRunner

from foosim.capture import contents as capture_contents
from foosim.capture import writer as capture_writer
from foosim.capture.contents import declare_topics, write_all
from foosim.capture.mcap.checks import CHECKS
from foosim.capture.mcap.format import McapFile, Message
from foosim.capture.mcap.writer import McapWriter
from foosim.capture.parts import files_from
from foosim.capture.reader import open_capture
from foosim.capture.rows import FRAME, PROFILE, Fate, PacketRow
from foosim.cli.verbs import app
from foosim.common.errors import Refused
from foosim.console.report.collect import Report, gather
from foosim.simulation.run import rehearse
from foosim.simulation.system import System
from foosim.world.edits import Add
from tests.turns import BY_PERIOD

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TICKS: Final = 300
TICK_NS: Final = 2_000_000
ADDED_AT: Final = 60
SPARE: Final = "table.spare_balls=1"
SETS: Final = ("engine=pure", SPARE, *(text for text in BY_PERIOD if "player-blue" in text))
"""One player acts at arrival, the other at ticks of its own."""

NETWORK: Final = (
    "network={radios: {w: {preset: wifi_5_indoor, fading: {kind: rician}, loss: 4 %}}, robots: {'*': [w]},"
    " links: [{id: fast, from: 'player*', to: '*', delay: 2 ms, jitter: {shape: uniform, width: 1 ms}}],"
    " places: {player-red: [-20 m, 3 m, 1 m], player-blue: [3 m, 0 m, 1 m], camera: [0 m, 0 m, 2 m]},"
    " events: [{at: 100 ms, for: 60 ms, partition: [[player-red], [rest]]}, {at: 200 ms,"
    " set: {link: fast, loss: 30 %}}]}"
)
CLOG: Final = {"clog": {"from": "player-blue", "to": "*"}, "for": "50 ms"}


def disturb(system: System) -> None:
    system.at_tick(20, lambda: system.request("push", impulse=[0.03, 0.01, 0.0]))
    system.at_tick(ADDED_AT, lambda: system.request("add", name="ball", at="0.2,0.1,0.05"))


def capture_to(path: Path, ticks: int = TICKS) -> Path:
    rehearse(TABLE.read_text(), TABLE.name, ticks, 2, SETS, prepare=disturb, capture=path)
    return path


def added_tick(path: Path) -> int:
    """The tick of the first frame of a capture in which a ball is added."""
    ticks = open_capture(path).captured_ticks()
    return next(tick.tick for tick in ticks if any(isinstance(edit, Add) for edit in tick.edits))


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of 0.6 s with players and an added ball, in many small chunks; not to be changed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(capture_writer, "BATCH_ROWS", 100)
        patch.setattr(capture_contents, "CHUNK_BYTES", 1)
        return capture_to(tmp_path_factory.mktemp("replay") / "run.mcap")


@pytest.fixture(scope="session")
def again(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same run once more, in a large chunk."""
    return capture_to(tmp_path_factory.mktemp("replay") / "again.mcap")


def captured_in_files(path: Path, *sets: str) -> Path:
    sets = (*SETS, "capture.split_time=100 ms", *sets)
    rehearsed = rehearse(TABLE.read_text(), TABLE.name, TICKS, 2, sets, prepare=disturb, capture=path)
    assert rehearsed.json["capture"] == str(files_from(path)[0]), "a file that is there"
    return path


@pytest.fixture(scope="session")
def split_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run of `run`, in six files and one for its last frame."""
    return captured_in_files(tmp_path_factory.mktemp("split") / "run.mcap")


def disrupt(system: System) -> None:
    system.at_tick(20, lambda: system.request("push", impulse=[0.02, 0.0, -0.01]))
    system.at_tick(40, lambda: system.request("move", robot="red.goal", node="n2"))
    system.at_tick(60, lambda: system.request("network", event=CLOG))
    system.at_tick(70, lambda: system.request("add", name="ball", at="0.2,0.1,0.05"))
    system.at_tick(150, lambda: system.request("remove", name="ball-2"))


@pytest.fixture(scope="session")
def radio_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of 0.4 s over radio with places, a partition, changed settings and a clog that was asked for."""
    path = tmp_path_factory.mktemp("report") / "radio.mcap"
    rehearse(TABLE.read_text(), TABLE.name, 200, 2, ["engine=pure", SPARE, NETWORK], prepare=disrupt, capture=path)
    return path


@pytest.fixture(scope="session")
def found(radio_run: Path) -> Report:
    return gather(open_capture(radio_run), radio_run.name)


def packet(sent_ns: int, due_ns: int, cause: str = "", copy: int = 0) -> PacketRow:
    fate: Fate = "dropped" if cause else "delivered"
    times = sent_ns, sent_ns, due_ns, 0
    return PacketRow("a", sent_ns, copy, "b", "c", *times, fate, cause, "rule", "", "", 0, b"", 0)


def contents_of(path: Path) -> list[Any]:
    """Messages, metadata and attachments of a capture, in its order."""
    with path.open("rb") as stream:
        return list(McapFile(stream, path.stat().st_size, str(path)).contents())


def messages_of(path: Path) -> list[Message]:
    return [content for content in contents_of(path) if isinstance(content, Message)]


def rewritten(path: Path, out: Path, messages: Iterable[Message], chunk: int = 0) -> Path:
    """Write a capture with other messages, so many in a chunk; all of them for 0."""
    with out.open("xb", buffering=0) as stream:
        mcap = McapWriter(partial(write_all, stream.fileno()), PROFILE)
        channels = declare_topics(mcap)
        for content in contents_of(path):
            if isinstance(content, records.Attachment):
                mcap.add_attachment(content.name, content.media_type, content.data)
            elif isinstance(content, records.Metadata) and content.name == CHECKS:
                mcap.add_checks()
            elif isinstance(content, records.Metadata):
                mcap.add_metadata(content.name, content.metadata)
        for number, message in enumerate(messages, 1):
            stamps = message.log_ns, message.publish_ns, message.sequence
            mcap.add_message(channels[message.topic], *stamps, message.data)
            if chunk and number % chunk == 0:
                mcap.end_chunk()
        mcap.finish()
    return out


def with_row(message: Message, **fields: Any) -> Message:
    """A message whose row has other fields."""
    row = {**msgspec.json.decode(message.data), **fields}
    return Message(message.topic, message.log_ns, message.publish_ns, message.sequence, msgspec.json.encode(row))


def damaged(path: Path, out: Path) -> Path:
    """Write a capture with one wrong bit within the compressed data of a chunk with frames in the middle."""
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    (frames,) = (channel.id for channel in summary.channels.values() if channel.topic == FRAME)
    chunks = [chunk for chunk in summary.chunk_indexes if frames in chunk.message_index_offsets]
    content = bytearray(path.read_bytes())
    content[content.index(b"\x28\xb5\x2f\xfd", chunks[len(chunks) // 2].chunk_start_offset) + 40] ^= 1
    out.write_bytes(content)
    return out


@dataclass(frozen=True)
class Done:
    """What a command did: its exit code, and what it said to whom."""

    code: int
    out: str
    err: str


def replay(*arguments: str | Path) -> Done:
    """Run `foosim capture` as a person would."""
    return foosim("capture", *arguments)


def foosim(*words: str | Path) -> Done:
    """Run `foosim` as a person would: what is refused is told on standard error. The process keeps its signals."""
    kept = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    done = CliRunner().invoke(app, [str(word) for word in words])
    for number, handler in kept.items():
        signal.signal(number, handler)
    if isinstance(done.exception, Refused):
        return Done(done.exception.exit_code, done.stdout, f"{done.stderr}{done.exception}\n")
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return Done(done.exit_code, done.stdout, done.stderr)


@pytest.fixture
def bad_files(tmp_path: Path, run: Path) -> list[Path]:
    """Files that no command takes for a capture: absent, empty, of other people, of another format, with one wrong bit
    in what describes the run, a folder."""
    files = {"empty": b"", "text": b"not a capture\n", "magic": b"\x89MCAP0\r\n"}
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    other = tmp_path / "format.mcap"
    with other.open("xb", buffering=0) as stream:
        mcap = McapWriter(partial(write_all, stream.fileno()), PROFILE)
        declare_topics(mcap)
        mcap.add_metadata("foosim", {"format": "99", "deployment": "table.yaml"})
        mcap.finish()
    wrong = [tmp_path / f"wrong-{number}.mcap" for number in range(3)]
    for path, text in zip(wrong, (b"loss: 0.5 %", b'"numpy"', b"fingerprint"), strict=True):
        wrong_one = bytearray(run.read_bytes())
        wrong_one[wrong_one.index(text) + 6] ^= 2
        path.write_bytes(wrong_one)
    folder = tmp_path / "folder"
    folder.mkdir()
    return [tmp_path / "absent", *(tmp_path / name for name in files), other, *wrong, folder]
