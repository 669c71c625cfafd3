"""Captures repeat: verified on any number of nodes, equal when run twice, and one flipped bit is found at its tick."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec
import pytest
from typer.testing import CliRunner

from foosim.capture.contents import library_versions
from foosim.capture.info import capture_info
from foosim.capture.mcap.format import McapFile, Message
from foosim.capture.reader import CapturedTick, open_capture
from foosim.capture.rows import OwnerRow
from foosim.cli.capture.command import app
from foosim.cli.capture.options import BadCapture
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.node.core import NodeCore
from foosim.node.physics.interface import Engine
from foosim.node.physics.pure_engine import PureEngine
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from foosim.simulation.verify import Verified, verify, verify_capture
from foosim.world.layout import Layout

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
TEXT = apply_sets(TABLE.read_text(), TABLE.name, ["table.spare_balls=1"])


def test_a_capture_says_who_had_which_robot_and_by_which_arithmetic(radio_run: Path) -> None:
    verified, capture = verify_capture(radio_run, 3), open_capture(radio_run)
    assert verified.equal and verified.other_arithmetic == ()
    first, second = capture.epochs
    assert first.arithmetic == second.arithmetic == verified.arithmetic != ""
    assert OwnerRow("red.goal", "n1") in first.owners and OwnerRow("red.goal", "n2") in second.owners
    assert first.roster == second.roster == ["n1", "n2"] and (first.tick, first.epoch, second.epoch) == (0, 1, 2)
    digests = {tick.tick: tick.digest.hex() for tick in capture.captured_ticks()}
    assert [epoch.digest for epoch in (first, second)] == [digests[epoch.tick] for epoch in (first, second)]


def messages_of(path: Path) -> dict[str, list[tuple[int, int, bytes]]]:
    """Return (log time, sequence, content) of every topic but the log; JSON without its wall-clock fields."""
    topics: dict[str, list[tuple[int, int, bytes]]] = {}
    with path.open("rb") as stream:
        for content in McapFile(stream, path.stat().st_size, str(path)).contents():
            if isinstance(content, Message) and content.topic != "/log":
                data = content.data
                if data[:1] == b"{":
                    row = {key: value for key, value in msgspec.json.decode(data).items() if not key.startswith("wall")}
                    data = msgspec.json.encode(row)
                topics.setdefault(content.topic, []).append((content.log_ns, content.sequence, data))
    return topics


def flipped(ticks: Sequence[CapturedTick], at: int) -> list[CapturedTick]:
    """Return the ticks with the lowest bit of one delivered command flipped, in the inputs of tick `at`'s frame."""
    changed = list(ticks)
    tick = changed[at]
    packet = tick.delivered[0]
    payload = bytes([packet.payload[0] ^ 1]) + packet.payload[1:]
    delivered = [msgspec.structs.replace(packet, payload=payload), *tick.delivered[1:]]
    changed[at] = CapturedTick(tick.tick, tick.digest, tick.entities, tick.edits, delivered)
    return changed


def test_one_flipped_bit_of_one_command_is_found_at_its_tick(run: Path) -> None:
    capture = open_capture(run)
    ticks = list(capture.captured_ticks())
    with_commands = [tick.tick for tick in ticks if tick.delivered]
    for at in (with_commands[0], with_commands[len(with_commands) // 2], with_commands[-1]):
        found = verify(capture.about, flipped(ticks, at), nodes=2)
        assert (found.tick, found.entities) == (at, (ticks[at].delivered[0].destination,))


def test_a_missing_tick_is_named(run: Path) -> None:
    capture = open_capture(run)
    ticks = [tick for tick in capture.captured_ticks() if tick.tick != 77]
    found = verify(capture.about, ticks)
    assert not found.equal and found.missing_tick == 77


class OtherNode(NodeCore):
    """A node that says another digest of its engine's small run than it has."""

    def engine_ready(self, fingerprint: bytes) -> None:
        super().engine_ready(bytes(31) + b"?")


def heavier(deployment: Deployment, layout: Layout) -> Engine:
    """An engine in which everything falls a little faster: another arithmetic, another world."""
    text = apply_sets(TEXT, TABLE.name, ["table.gravity=9.82 m/s2"])
    return PureEngine(load_deployment(text, TABLE.name), layout)


def test_where_ticks_differ_the_command_says_that_the_arithmetic_does(tmp_path: Path) -> None:
    runner = CliRunner()
    path = tmp_path / "run.mcap"
    rehearse(TEXT, TABLE.name, 300, 2, ["engine=pure"], Settings(factory=heavier), capture=path)
    (epoch,) = open_capture(path).epochs
    own = verify_capture(path).arithmetic
    assert len(own) == 64 and epoch.arithmetic != own
    done = runner.invoke(app, ["verify", str(path)])
    assert done.exit_code == 1 and done.stdout.startswith("differs at tick ")
    assert f"the capture's arithmetic is {epoch.arithmetic}, this machine's is {own}" in done.stderr
    shown = runner.invoke(app, ["info", str(path)])
    assert "\n  nodes n1, n2\n" in shown.stdout and f"\n  arithmetic {epoch.arithmetic}\n" in shown.stdout


def test_another_version_of_an_engine_is_named_where_worlds_differ(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the library that the capture was made with, and of the one here."""
    path = tmp_path / "run.mcap"
    rehearse(TEXT, TABLE.name, 30, 1, ["engine=pure"], Settings(), capture=path)
    there = library_versions()["mujoco-core"]
    monkeypatch.setattr(
        "foosim.simulation.verify.library_versions", lambda: {**library_versions(), "mujoco-core": "4.0.9"}
    )
    verified = verify_capture(path)
    assert verified.equal and verified.other_versions == (f"mujoco-core {there}, here 4.0.9",)
    monkeypatch.setattr("foosim.simulation.verify._compare", lambda *_: Verified(3, 1, b"", 3, ("ball",)))
    done = CliRunner().invoke(app, ["verify", str(path)])
    assert done.exit_code == 1 and f"the capture was made with mujoco-core {there}, here 4.0.9" in done.stderr


def test_where_no_tick_differs_another_arithmetic_is_no_news(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    rehearse(TEXT, TABLE.name, 100, 1, ["engine=pure"], Settings(node=OtherNode), capture=path)
    verified = verify_capture(path, 2)
    assert verified.equal and verified.other_arithmetic == ((bytes(31) + b"?").hex(),)
    done = CliRunner().invoke(app, ["verify", str(path)])
    assert done.exit_code == 0 and done.stderr == ""


def test_the_command_says_what_it_found(run: Path, tmp_path: Path) -> None:
    runner, info = CliRunner(), capture_info(run)
    done = runner.invoke(app, ["verify", str(run), "--nodes", "2"])
    assert done.exit_code == 0 and info.chain in done.output
    shown = runner.invoke(app, ["info", str(run), "--json"])
    assert shown.exit_code == 0 and msgspec.json.decode(shown.output)["chain"] == info.chain
    for bad in (["info", str(tmp_path / "nowhere.mcap")], ["verify", __file__]):
        shown = runner.invoke(app, bad)
        assert isinstance(shown.exception, BadCapture) and shown.exception.exit_code == 2
        assert str(shown.exception).startswith(f"{bad[1]}: ")


def test_a_capture_that_was_cut_off_is_equal_up_to_there(run: Path, tmp_path: Path) -> None:
    runner, cut = CliRunner(), tmp_path / "cut.mcap"
    content = run.read_bytes()
    for share in (content[: len(content) * 2 // 3], content[:-1]):
        cut.write_bytes(share)
        done = runner.invoke(app, ["verify", str(cut)])
        last = open_capture(cut).ticks[-1]
        assert done.exit_code == 4 and done.output.endswith(f"; the capture is unfinished, it ends at tick {last}\n")
        found = msgspec.json.decode(runner.invoke(app, ["verify", str(cut), "--json"]).output)
        assert found["equal"] and not found["finished"] and found["ticks"] == last
    for nothing in (b"", b"#!/bin/sh", content[:300]):
        cut.write_bytes(nothing)
        for command in ("verify", "recover"):
            assert isinstance(runner.invoke(app, [command, str(cut)]).exception, BadCapture)
