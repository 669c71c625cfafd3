"""A run in several files: every command takes it as it takes the run in one."""

from __future__ import annotations

from pathlib import Path

import msgspec

from foosim.capture.diff import diff_captures
from foosim.capture.parts import files_from
from foosim.capture.reader import open_capture
from foosim.capture.start_frame import read_branch
from foosim.console.report.collect import gather
from foosim.deployment.loader import load_deployment
from foosim.simulation.play.main import read_span
from foosim.simulation.what_if import what_if
from tests.simulation.conftest import captured_in_files, replay


def test_it_is_the_run_in_one_file(run: Path, split_run: Path) -> None:
    assert len(files_from(split_run)) == 7
    found = diff_captures(run, split_run)
    assert found.equal and found.about == ("metadata part", "the deployment")
    assert all(channel.rows[0] == channel.rows[1] for channel in found.channels.values())


def test_commands_read_on(run: Path, split_run: Path, tmp_path: Path) -> None:
    info, whole = (msgspec.json.decode(replay("info", path, "--json").out) for path in (split_run, run))
    assert len(info["parts"]) == 7 and info["parts"][1] == "run_0001.mcap"
    for key in ("chain", "digest", "ticks", "packets", "causes", "topics", "finished", "clients", "end"):
        assert info[key] == whole[key], key
    assert "  7 files: run.mcap to run_0006.mcap\n" in replay("info", split_run).out
    assert replay("verify", split_run).out == replay("verify", run).out
    assert read_span(split_run)[0] == read_span(run)[0]
    outs = []
    for path in (split_run, run):
        outs.append(tmp_path / f"{path.parent.name}.csv")
        assert replay("export", path, "--what", "poses", "-o", outs[-1]).code == 0
    assert outs[0].read_bytes() == outs[1].read_bytes()
    assert what_if(open_capture(split_run)).changed == 0
    reports = [gather(open_capture(path), "run") for path in (split_run, run)]
    assert reports[0] | {"metadata": {}} == reports[1] | {"metadata": {}}


def test_a_run_begins_with_a_frame_of_any_file(run: Path, split_run: Path) -> None:
    deployment = load_deployment(open_capture(run).about.deployment_text, "table.yaml")
    for at in ("60 ms", "0.4 s", "0.6 s"):
        mine, theirs = (read_branch(f"{path}@{at}", deployment).start for path in (split_run, run))
        assert (mine.origin, mine.values) == (theirs.origin, theirs.values)
    third = split_run.with_name("run_0003.mcap")
    mine, theirs = (read_branch(f"{path}@0.4 s", deployment).start for path in (third, run))
    assert (mine.origin.chain, mine.values) == (theirs.origin.chain, theirs.values)


def test_a_file_that_is_missing_is_bad_input(tmp_path: Path, split_run: Path) -> None:
    for file in files_from(split_run):
        if not file.name.endswith("3.mcap"):
            (tmp_path / file.name).write_bytes(file.read_bytes())
    for command in ("info", "verify", "what-if", "play", "recover"):
        done = replay(command, tmp_path / "run.mcap")
        assert done.code in (1, 2) and "run_0003.mcap: is missing, run_0004.mcap follows it" in done.err, done
    (tmp_path / "run_0000.mcap").touch()
    for number in (4, 5, 6):
        (tmp_path / f"run_000{number}.mcap").unlink()
    assert "continues in run_0003.mcap, which is missing" in replay("info", tmp_path / "run.mcap").out


def test_the_last_seconds_are_played_cut_and_told(split_run: Path, run: Path, tmp_path: Path) -> None:
    path = captured_in_files(tmp_path / "run.mcap", "capture.last=150 ms")
    assert [file.name for file in files_from(path)] == ["run_0004.mcap", "run_0005.mcap", "run_0006.mcap"]
    span, about = read_span(path)
    assert span == read_span(split_run.with_name("run_0004.mcap"))[0] and about.metadata["cut_tick"] == "200"
    assert "  last: 150 ms\n" in replay("info", path).out
    for source, out in ((path, "a.mcap"), (run, "b.mcap")):
        assert replay("cut", source, "--from", "0.45 s", "--to", "0.55 s", "-o", tmp_path / out).code == 0
    assert diff_captures(tmp_path / "a.mcap", tmp_path / "b.mcap").equal
    done = replay("verify", path, "--from-first-frame")
    assert done.code == 0 and done.out.startswith("equal: 100 ticks after frame 200 simulated again")
    assert replay("report", path, "-o", tmp_path / "r.html").code == 0
