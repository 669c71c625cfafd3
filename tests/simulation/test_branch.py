"""Runs that begin with a captured frame: with equal inputs they are the captured run, and captures say where from."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from foosim.capture.info import capture_info
from foosim.capture.reader import open_capture
from foosim.capture.start_frame import BadBranch, read_branch
from foosim.cli.capture.command import app as replay_app
from foosim.cli.rehearse import app as rehearse_app
from foosim.common.errors import BadValue
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.simulation.run import Rehearsed, rehearse, with_nodes
from foosim.simulation.system import Settings, System
from foosim.simulation.verify import verify_capture
from foosim.supervisor import records
from foosim.vhub.state.records import Fold
from foosim.world.assembly.initial_state import first_frame, start_with
from foosim.world.frame import Frame
from foosim.world.start import Start

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
SPARE = "table.spare_balls=1"
TEXT = apply_sets(TABLE.read_text(), TABLE.name, [SPARE])
TICKS = 300
PUSHED_AT, ADDED_AT, PUSHED_AGAIN_AT = 20, 60, 160


def push(system: System) -> None:
    system.request("push", impulse=[0.03, 0.01, 0.0])


def disturbed(system: System) -> None:
    """Ask for what changes the world, before and behind where the branch begins."""
    system.at_tick(PUSHED_AT, lambda: push(system))
    system.at_tick(ADDED_AT, lambda: system.request("add", name="ball", at="0.2,0.1,0.05"))
    system.at_tick(PUSHED_AGAIN_AT, lambda: push(system))


def disturbed_later(system: System) -> None:
    system.at_tick(PUSHED_AGAIN_AT, lambda: push(system))


class Captured:
    """A run without players, and one with them."""

    def __init__(self, folder: Path) -> None:
        self.alone, self.played = folder / "alone.mcap", folder / "played.mcap"
        sets = ["engine=pure", "players={}"]
        self.alone_run = rehearse(TEXT, TABLE.name, TICKS, 2, sets, prepare=disturbed, capture=self.alone)
        rehearse(TEXT, TABLE.name, TICKS, 2, sets[:1], prepare=disturbed, capture=self.played)


@pytest.fixture(scope="module")
def captured(tmp_path_factory: pytest.TempPathFactory) -> Captured:
    return Captured(tmp_path_factory.mktemp("branch"))


def start_of(path: Path, at: str, *sets: str) -> Start:
    return read_branch(f"{path}@{at}", load_deployment(apply_sets(TEXT, TABLE.name, sets), TABLE.name)).start


def test_a_branch_with_the_same_inputs_is_the_run_that_it_left(captured: Captured, tmp_path: Path) -> None:
    """Digests and chain, on another number of nodes, with an added ball in the world."""
    start = start_of(captured.alone, "0.215 s")
    tick = start.origin.tick
    frame = first_frame(load_deployment(TEXT, TABLE.name), start)
    assert tick == 100 and not frame.layout["ball-2"].is_absent(frame.numbers)
    branch = tmp_path / "branch.mcap"
    told: list[tuple[str, bytes]] = []
    settings = Settings(on_journal=lambda process, record: told.append((process, record)))
    sets = ["engine=pure", "players={}"]
    run = rehearse(
        TEXT, TABLE.name, TICKS - tick, 3, sets, settings, prepare=disturbed_later, capture=branch, start=start
    )
    assert run.digests == captured.alone_run.digests[tick:] and len(run.digests) == TICKS - tick
    assert run.json["digest"] == captured.alone_run.json["digest"]
    assert (run.json["first_tick"], run.json["ticks"]) == (tick, TICKS)
    assert run.json["from"] == {"capture": "alone.mcap", "tick": tick} and captured.alone_run.json["from"] is None
    capture = open_capture(branch)
    assert capture.ticks.tolist() == list(range(tick, TICKS + 1)) and capture.frames.ticks[0] == tick
    info = capture_info(branch)
    assert (info.first_tick, info.ticks, info.duration_ns) == (tick, TICKS, (TICKS - tick) * 2_000_000)
    assert info.chain == run.json["digest"]["chain"]
    for nodes in (1, 2):
        verified = verify_capture(branch, nodes)
        assert verified.equal and (verified.first_tick, verified.ticks) == (tick, TICKS)
        assert verified.chain.hex() == info.chain
    assert_journals(run, told, tick)
    again = rehearse(TEXT, TABLE.name, 50, 1, sets, start=start_of(branch, "0.46 s"))
    assert again.json["first_tick"] == 230 and again.digests == captured.alone_run.digests[230:280]


def assert_journals(run: Rehearsed, told: list[tuple[str, bytes]], tick: int) -> None:
    """Both journals know where the run began."""
    deployment = load_deployment(with_nodes(TEXT, TABLE.name, 3, ["engine=pure", "players={}"]), TABLE.name)
    history = records.fold(deployment, [record for process, record in told if process == "supervisor"])
    assert history.frame.digest == run.digests[-1] and history.frame.tick == TICKS
    closed = [folded.closing for folded in Fold(deployment, [record for process, record in told if process == "vhub"])]
    assert [closing.frame.tick for closing in closed] == list(range(tick, TICKS))
    assert [closing.digest for closing in closed[1:]] == run.digests[:-1]


def test_a_branch_with_players_goes_on_and_repeats(captured: Captured, tmp_path: Path) -> None:
    start = start_of(captured.played, "0.3 s")
    first, second = (
        rehearse(TEXT, TABLE.name, 100, nodes, ["engine=pure"], capture=tmp_path / f"{nodes}.mcap", start=start)
        for nodes in (1, 2)
    )
    assert first.digests == second.digests and first.json["packets"]["delivered"] > 100
    assert verify_capture(tmp_path / "1.mcap", 2).equal
    assert first.json["packets"]["offered"] == capture_info(tmp_path / "1.mcap").packets["offered"]


def test_the_frame_is_the_newest_at_or_before_the_time(captured: Captured) -> None:
    for at, tick in (("0 s", 0), ("19 ms", 0), ("20 ms", 10), ("0.599 s", 290), ("600 ms", 300)):
        assert start_of(captured.alone, at).origin.tick == tick
    deployment = load_deployment(TEXT, TABLE.name)
    last = read_branch(str(captured.alone), deployment)
    assert read_branch(f"{captured.alone}@last", deployment) == last
    assert last.text == f"the run begins with frame 300 of {captured.alone}, at 0.6 s"
    assert last.start.origin.chain.hex() == captured.alone_run.json["digest"]["chain"]


def refusals(captured: Captured, tmp_path: Path) -> Iterator[tuple[str, str, str]]:
    """What is asked for, changes of the deployment, and what is refused."""
    alone = str(captured.alone)
    camera = "robots.camera.sensors={eye: {kind: ball, rate: 100 Hz}}"
    yield f"{alone}@0.7s", "", "no frame of .* at that time, it has frames up to 0.6 s, '700 ms'"
    yield f"{alone}@soon", "", "--from: the time after @, not a time .*, 'soon'"
    yield str(tmp_path / "nowhere.mcap"), "", "nowhere.mcap: cannot be read, No such file"
    yield __file__, "", "no MCAP file"
    yield f"{alone}@0.1s", "tick=1 ms", "the capture has ticks of 2 ms, the deployment of 1 ms"
    yield f"{alone}@0.1s", camera, "does not fit the capture: components of camera are ball in the capture, eye in the"
    loop = "robots.red.goal.actuators={loop: {kind: rod_position}}"
    have, want = "encoder, position in the capture", "encoder, loop in the deployment"
    yield f"{alone}@0.1s", loop, f"does not fit the capture: components of red.goal are {have}, {want}"


def with_eye() -> Deployment:
    """The deployment with another name of its camera: its frames have as many numbers."""
    text = TABLE.read_text().replace("  camera:\n    model: camera", "  eye:\n    model: camera")
    text = text.replace("      - camera\n", "      - eye\n")
    return load_deployment(apply_sets(text, "other.yaml", ["players={}", SPARE]), "other.yaml")


def test_what_does_not_fit_is_refused_by_name(captured: Captured, tmp_path: Path) -> None:
    for what, changed, text in refusals(captured, tmp_path):
        sets = ["players={}", *([changed] if changed else [])]
        deployment = load_deployment(apply_sets(TEXT, TABLE.name, sets), TABLE.name)
        with pytest.raises((BadValue, BadBranch), match=text) as caught:
            read_branch(what, deployment)
        assert caught.value.exit_code == 2
    with pytest.raises(
        BadValue, match="does not fit the capture: it lacks camera camera; the capture has no camera eye"
    ):
        read_branch(f"{captured.alone}@0.1s", with_eye())


def test_a_start_that_does_not_fit_is_refused_where_it_is_used(captured: Captured) -> None:
    frame: Frame = open_capture(captured.alone).frames.frame(0)
    start = start_with(frame, "x.mcap", bytes(32))
    with pytest.raises(BadValue, match="does not fit the deployment"):
        first_frame(load_deployment(TABLE.read_text(), TABLE.name), start)
    with pytest.raises(BadValue, match="has another digest in this deployment's layout"):
        first_frame(with_eye(), start)


def test_the_commands_say_where_a_run_begins(captured: Captured, tmp_path: Path) -> None:
    runner = CliRunner()
    branch = tmp_path / "branch.mcap"
    arguments = [str(TABLE), "--set", SPARE, "--for", "40 ms", "--engine", "pure", "--from", f"{captured.alone}@0.39s"]
    done = runner.invoke(rehearse_app, [*arguments, "--capture", str(branch)])
    assert done.exit_code == 0, done.output
    assert done.output.startswith(f"the run begins with frame 190 of {captured.alone}, at 0.38 s\nnetwork everything: ")
    assert "\n0.04 s simulated" in done.output
    shown = runner.invoke(replay_app, ["info", str(branch)])
    assert "\n  from: alone.mcap\n" in shown.output and "\n  ticks 190 to 210 of 2 ms, 0.04 s" in shown.output
    shown = runner.invoke(replay_app, ["verify", str(branch)])
    assert shown.exit_code == 0 and shown.output.startswith("equal: 20 ticks after frame 190 simulated again")
