"""Replays over a real loopback session: who listens hears what was captured, and controls it; and the command."""

from __future__ import annotations

import io
import os
import pty
import re
import select
import signal
import subprocess
import sysconfig
import termios
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import pytest

from foosim.capture.reader import open_capture
from foosim.client.errors import ConnectionFailed
from foosim.client.replay_listener import Replay, ReplayGone, ReplayRefused, hear_replay
from foosim.common.errors import BadValue
from foosim.common.units import Pace
from foosim.launcher import pki as certificates
from foosim.library.table.ball import BallPosition
from foosim.protocol.replay_messages import (
    Played,
    PlayedLine,
    PlayedPacket,
    PlayedPoses,
    PlayedRow,
    PlayedScene,
    ReplayClock,
)
from foosim.runtime.transport.certificate_folder import CertificateError
from foosim.runtime.transport.certificates import load_credentials
from foosim.simulation.play.address_file import replays_folder
from foosim.simulation.play.main import PlayOptions, PlayResult, Stopper, play_capture
from foosim.simulation.play.terminal import Lines
from foosim.simulation.run import rehearse
from tests.simulation.conftest import TABLE, TICK_NS, TICKS, damaged, replay

MS = 1_000_000
LIMIT_S = 900.0
FAST = Pace("fast")


class Stage(Lines):
    """Takes the lines of a replay, and knows where it listens."""

    def __init__(self) -> None:
        self.text = io.StringIO()
        super().__init__(self.text)
        self.listening = threading.Event()
        self.address = ""

    def print(self, line: str) -> None:
        super().print(line)
        found = re.search(r"listening at (\S+)", line)
        if found:
            self.address = found[1]
            self.listening.set()


class Playing:
    """A replay in a thread of its own."""

    def __init__(self, path: Path, **options: Any) -> None:
        self.stage = Stage()
        self.stopper = Stopper()
        self.results: list[PlayResult] = []
        self._path = path
        self._options = PlayOptions(**options)
        self._thread = threading.Thread(target=self._run)
        self._thread.start()
        assert self.stage.listening.wait(LIMIT_S), self.stage.text.getvalue()
        self.address = self.stage.address

    def _run(self) -> None:
        self.results.append(play_capture(self._path, self._options, self.stage, self.stopper))

    def result(self) -> PlayResult:
        self._thread.join(LIMIT_S)
        return self.results[0]


@contextmanager
def playing(path: Path, **options: Any) -> Iterator[Playing]:
    made = Playing(path, **options)
    try:
        yield made
    finally:
        made.stopper.stop()
        made.result()


@pytest.fixture(autouse=True)
def own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


def packets_of(items: list[Played]) -> list[PlayedPacket]:
    return [item for item in items if isinstance(item, PlayedPacket)]


def test_a_listener_hears_all_that_was_delivered_in_order(run: Path) -> None:
    with playing(run, pace=FAST, paused=True) as play, hear_replay(play.address) as heard:
        assert heard.deployment.world == "table"
        heard.resume()
        items = list(heard)
        packets = packets_of(items)
        capture = open_capture(run)
        delivered = capture.packets.where(capture.packets.fate == "delivered")
        columns = delivered.source, delivered.sequence.tolist(), delivered.destination, delivered.payload
        expected = sorted(zip(*columns, strict=True))
        assert sorted((p.source, p.sequence, p.destination, p.payload) for p in packets) == expected
        times = [item.time_ns for item in items]
        assert times == sorted(times) and heard.dropped == heard.malformed == 0
        ball = [packet for packet in packets if packet.channel == "ball"]
        assert ball and all(isinstance(heard.value(packet), BallPosition) for packet in ball)
        poses = [item for item in items if isinstance(item, PlayedPoses)]
        assert poses[0].poses[0].link == "ball" and "ball-2" in {pose.link for pose in poses[-1].poses}
        scenes = [item for item in items if isinstance(item, PlayedScene)]
        assert len(scenes) == 2 and scenes[0].time_ns == 0 and b"ball-2" in scenes[1].update
        assert any(item.text.startswith("supervisor: ") for item in items if isinstance(item, PlayedLine))
        rows = [item for item in items if isinstance(item, PlayedRow)]
        assert {row.topic for row in rows} == {"ages", "clients", "epochs", "layout", "metrics"}
        assert msgspec.json.decode(rows[0].row)["tick"] == 0
        assert isinstance(items[-1], ReplayClock) and items[-1].state == "ended" and heard.ended
        result = play.result()
        assert (result.reason, result.failed, result.rounds, result.time_ns) == ("end", False, 1, TICKS * TICK_NS)
        assert result.published == len(items) - sum(isinstance(item, ReplayClock) for item in items)
        assert sum(result.topics.values()) == result.published
        with pytest.raises(ReplayGone, match="the replay has ended"):
            heard.pause()


def test_it_is_controlled_while_it_runs(run: Path) -> None:
    with playing(run, paused=True, remaps=("camera:=eye", "/ball:=/seen")) as play, hear_replay(play.address) as heard:
        status = heard.step(30)
        assert status["state"] == "paused" and status["time_ns"] == 60 * MS and status["names"] == {"camera": "eye"}
        first = until(heard, 60 * MS)
        assert max(packet.time_ns for packet in packets_of(first)) <= 60 * MS
        seen = [packet for packet in packets_of(first) if packet.source == "eye"]
        assert {packet.channel for packet in seen} == {"seen"} and isinstance(heard.value(seen[0]), BallPosition)
        assert heard.seek(300 * MS)["jumps"] == 1
        assert heard.set_rate("fast")["rate"] == "fast"
        heard.resume()
        rest = list(heard)
        assert min(packet.time_ns for packet in packets_of(rest)) >= 300 * MS
        for wrong, text in (({"verb": "seek", "time_ns": -1}, "not a time"), ({"verb": "x"}, "no request of a replay")):
            with playing(run, paused=True) as other, hear_replay(other.address, ()) as asking:
                with pytest.raises(ReplayRefused, match=text):
                    asking.request(**wrong)
                assert asking.stop()["state"] == "paused"
                assert other.result().reason == "stopped"


def until(heard: Replay, time_ns: int) -> list[Played]:
    """What comes until the replay says that it stands at a time."""
    items: list[Played] = []
    while not (heard.clock is not None and heard.clock.time_ns == time_ns):
        items += heard.take(LIMIT_S)
    return items


def test_streams_are_chosen_by_who_listens(run: Path) -> None:
    with playing(run, pace=FAST, paused=True, topics=("/packets", "/tf")) as play:
        with hear_replay(play.address, ("poses",)) as poses, hear_replay(play.address, ("clock",)) as clock:
            poses.resume()
            assert {type(item) for item in poses} == {PlayedPoses}
            assert {type(item) for item in clock} == {ReplayClock}
        with pytest.raises(BadValue, match=r"not a stream of a replay .*nearest is 'poses'"):
            hear_replay(play.address, ("pose",))


def test_a_damaged_one_plays_up_to_there_and_fails(run: Path, tmp_path: Path) -> None:
    damaged(run, tmp_path / "damaged.mcap")
    with playing(tmp_path / "damaged.mcap", pace=FAST, loop=True) as play:
        result = play.result()
        assert result.failed and "damaged.mcap: byte " in result.reason and result.published > 100


def test_a_loop_plays_its_part_again_until_it_is_stopped(run: Path) -> None:
    part: dict[str, Any] = {"from_ns": 100 * MS, "until_ns": 120 * MS, "loop": True, "topics": ("/tf",)}
    with playing(run, pace=FAST, paused=True, **part) as play, hear_replay(play.address) as heard:
        heard.resume()
        times: list[int] = []
        while len(times) < 9:
            times += [item.time_ns for item in heard.take(LIMIT_S) if isinstance(item, PlayedPoses)]
        assert times[:6] == [100 * MS, 120 * MS] * 3 and heard.clock is not None and heard.clock.jumps > 0


def test_the_command_controls_the_newest_replay(run: Path) -> None:
    none = replay("control", "pause")
    assert none.code == 1 and "no replay runs here" in none.err
    with playing(run, paused=True) as play:
        assert replay("control", "step", "5").out == "run.mcap: 0.010 s, paused realtime\n"
        assert replay("control", "seek", "12.5s").code == 3
        assert replay("control", "seek", "250 ms").out == "run.mcap: 0.250 s, paused realtime\n"
        assert replay("control", "rate", "4x", "--address", play.address).out == "run.mcap: 0.250 s, paused 4x\n"
        status = msgspec.json.decode(replay("control", "status", "--json").out)
        assert status["published"] > 0 and status["until_ns"] == TICKS * TICK_NS
        (folder,) = replays_folder().iterdir()
        assert sum(file.stat().st_size for file in folder.iterdir()) < 1000, "its address, no space for a result"
        assert replay("control", "stop").code == 0
        assert play.result().reason == "stopped"
    assert replay("control", "status").code == 1 and not [*replays_folder().iterdir()]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("paus",), "no request of a replay (there are: pause, rate, resume, seek, status, step, stop), 'paus'"),
        (("pause", "1"), "pause has no argument, '1'"),
        (("seek",), "seek needs a time"),
        (("seek", "12"), "not a time"),
        (("step", "1.5"), "not a number of ticks, '1.5'"),
        (("rate",), "rate needs a rate"),
        (("rate", "quick"), "not a pace"),
        (("pause", "--address", "nowhere:x"), "not an address"),
    ],
)
def test_bad_control_is_named(arguments: tuple[str, ...], text: str) -> None:
    done = replay("control", *arguments)
    assert done.code == 2 and text in done.err


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (("--from", "1"), 2, "--from: not a time"),
        (("--from", "1s"), 2, "--from: the capture has 0 s to 600 ms, '1 s'"),
        (("--until", "soon"), 2, "--until: not a time"),
        (("--rate", "0x"), 2, "out of range"),
        (("--remap", "x"), 2, "--remap: not OLD:=NEW"),
        (("--listen", "0.0.0.0"), 3, "reached by other machines"),
        (("--listen", "no host"), 2, "not an address"),
    ],
)
def test_bad_options_of_play_are_named(run: Path, arguments: tuple[str, ...], code: int, text: str) -> None:
    done = replay("play", run, *arguments)
    assert done.code == code and text in done.err and done.out == ""


def test_nobody_at_an_address_is_told(tmp_path: Path) -> None:
    with pytest.raises(ConnectionFailed, match="no router answers"):
        hear_replay("tcp/127.0.0.1:9", timeout_s=0.2)


def test_with_certificates_operators_listen_and_nobody_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, alone = tmp_path / "pki", tmp_path / "alone"
    certificates.init(folder)
    certificates.issue(folder, ["vhub", "operator.admin", "client.player-red"])
    alone.mkdir()
    for name in ("ca.pem", "client.player-red.pem", "client.player-red.key"):
        (alone / name).write_bytes((folder / name).read_bytes())
    path = tmp_path / "run.mcap"
    sets = ["engine=pure", "access={operators: [admin]}"]
    rehearse(TABLE.read_text(), TABLE.name, 20, 1, sets, capture=path)
    with playing(path, pace=FAST, paused=True, pki=folder) as play:
        assert play.address.startswith("tls/127.0.0.1:")
        with hear_replay(play.address, pki=folder) as heard:
            heard.resume()
            assert packets_of(list(heard))
    with playing(path, paused=True, pki=folder) as play:
        assert replay("control", "status").code == 0, "it knows where the certificates are"
        with pytest.raises(CertificateError, match=r"no operator's certificate"):
            hear_replay(play.address, pki=alone)
        with pytest.raises(BadValue, match="needs certificates"):
            hear_replay(play.address)
        player = partial(load_credentials, identity="client.player-red")
        monkeypatch.setattr("foosim.client.replay_listener.operator_credentials", player)
        with pytest.raises(ReplayGone, match="no answer to status"):
            hear_replay(play.address, pki=alone, answer_s=0.5)
        assert play.stage.text.getvalue().count("\n") < 10


def test_the_program_in_the_docs_listens(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = (TABLE.parents[1] / "docs" / "how-to" / "use_a_capture.md").read_text()
    (program,) = re.findall(r"^```py\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    assert "tcp/127.0.0.1:7470" in program
    with playing(run, pace=FAST, paused=True) as play:
        exec(compile(program.replace("tcp/127.0.0.1:7470", play.address), "use_a_capture.md", "exec"), {})
    shown = capsys.readouterr().out
    assert shown.startswith("table 600000000\n") and "player-red BallPosition(" in shown


# --- the command as a process ----------------------------------------------------------------------------------------

COMMAND = str(Path(sysconfig.get_path("scripts")) / "foosim"), "capture"


def test_without_a_terminal_it_says_plain_lines_and_ctrl_c_ends_it_in_order(run: Path) -> None:
    process = subprocess.Popen(
        [*COMMAND, "play", str(run), "--loop", "--json"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        process_group=0,
    )
    assert process.stderr is not None
    assert "listening at tcp/127.0.0.1:" in process.stderr.readline()
    assert "playing realtime" in process.stderr.readline()
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=LIMIT_S)
    result = msgspec.json.decode(out)
    assert process.returncode == 0 and result["reason"] == "stopped" and not result["failed"]
    assert "\x1b" not in err and "\r" not in err and "Traceback" not in err


def test_a_terminal_gives_keys_and_gets_its_mode_back(run: Path) -> None:
    master, slave = pty.openpty()
    before = termios.tcgetattr(slave)
    # In a session of its own, whose terminal this one is: as a shell starts it.
    command = ["setsid", "--ctty", *COMMAND, "play", str(run), "--loop"]
    process = subprocess.Popen(command, stdin=slave, stdout=slave, stderr=slave)
    read_until(master, b"space pause")
    assert not termios.tcgetattr(slave)[3] & termios.ICANON
    read_until(master, b"playing realtime")
    for key, shown in ((b" ", b"paused realtime"), (b"\x1b[A", b"paused 2x"), (b" ", b"playing 2x")):
        os.write(master, key)
        read_until(master, shown)
    os.write(master, b"q")
    read_until(master, b": stopped")
    assert process.wait(LIMIT_S) == 0
    assert termios.tcgetattr(slave) == before
    os.close(master)
    os.close(slave)


def read_until(master: int, text: bytes) -> bytes:
    """What the terminal shows, until a text has come."""
    content = b""
    deadline_s = time.monotonic() + LIMIT_S
    while text not in content:
        assert time.monotonic() < deadline_s, content
        if select.select([master], [], [], 1.0)[0]:
            content += os.read(master, 4096)
    return content
