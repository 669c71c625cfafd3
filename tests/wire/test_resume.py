"""A run in the background, whose launcher is killed with everything: another one goes on with it, but not when the
vHub's journal has lost its end, as with a machine that loses its power."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from foosim.capture.reader import open_capture
from foosim.common.errors import Refused
from foosim.launcher.plan import make_plan
from foosim.launcher.resume import plan_again
from foosim.launcher.run_options import RunOptions
from foosim.protocol import channels
from foosim.runtime.journal import Records, journal_files
from foosim.runtime.run_folder import RunFolder, open_run
from foosim.simulation.run import rehearse
from foosim.simulation.verify import verify_capture
from tests.wire.conftest import LONG, SLOW, in_process
from tests.wire.test_run import NO_HUB, last_json

if TYPE_CHECKING:
    from tests.wire.conftest import House

SETS = (LONG, "players={}", "engine=pure", f"pace={SLOW}", "nodes.red.process=main")
BARE = tuple(word for setting in SETS for word in ("--set", setting))


def tear(folder: Path, stem: str, count: int) -> None:
    """Cut the last records off a journal, as a machine does that loses its power."""
    path = journal_files(folder, stem)[-1]
    records = Records(path)
    ends = [records.valid_bytes for _ in records]
    os.truncate(path, ends[-count])


def flip(folder: Path, stem: str) -> None:
    """Turn a bit in the midst of a journal."""
    path = journal_files(folder, stem)[0]
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def test_a_run_goes_on_after_the_death_of_its_launcher(house: House) -> None:
    options = ("--run", "far", "--capture", "far.mcap")
    code, out, err = house.run("foosim", "up", house.table, *BARE, *options, "--detach")
    assert (code, err) == (0, "") and "run far is up" in out
    code, _, err = house.ask("foosim", "up", "--resume", "far")
    assert code == 3 and "run far is alive" in err
    before = house.ticking(100)["ticks"]
    (launcher,) = [pid for pid, line in house.processes_with("--run far").items() if "foosim up" in line]
    os.kill(launcher, signal.SIGKILL)
    folder = open_run("far")
    house.wait_for("all to be gone with it", lambda: folder.is_left() and not house.processes_with("--run far"))
    assert folder.result() is None
    flip(folder.journals, channels.VHUB)
    with pytest.raises(
        Refused, match=r"run far cannot be resumed: .*vhub-0\d+\.journal: byte \d+: .* --from .*far.mcap@last"
    ):
        plan_again(folder)
    flip(folder.journals, channels.VHUB)
    (journal,) = journal_files(folder.journals, channels.VHUB)
    journal.rename(journal.with_suffix(".away"))
    code, out, err = house.ask("foosim", "up", "--resume", "far", "--json")
    why = f"run far cannot be resumed: the vHub's journal is gone from {folder.journals}. A new run begins with the "
    why += f"last captured frame: foosim up {house.table} "
    assert code == 3 and err.startswith(why) and last_json(out)["reason"] == err.strip()
    assert last_json(out)["capture"] == str(house.folder / "far.mcap")
    journal.with_suffix(".away").rename(journal)
    _ends_where_inputs_are_lost(house, folder)
    tear(folder.journals, channels.SUPERVISOR, 9)
    up = house.start("foosim", "up", "--resume", "far", "--json")
    house.ticking(before + 100)
    assert house.ask("foosim", "down")[0] == 0
    code, out, err = house.end(up)
    assert code == 0, err
    content = last_json(out)
    recovered = [entry["what"] for entry in content["recoveries"]]
    assert "supervisor" in recovered
    same = rehearse(house.table.read_text(), "table.yaml", content["ticks"], None, SETS).json
    assert content["digest"] == same["digest"]
    assert open_capture(house.folder / "far.mcap").about.finished
    verified = verify_capture(house.folder / "far.mcap")
    assert verified.ticks == content["ticks"]
    code, out, err = house.ask("foosim", "up", "--resume", "far", "--json")
    assert (code, last_json(out)) == (0, content) and "run far has ended: stopped" in err


def _ends_where_inputs_are_lost(house: House, folder: RunFolder) -> None:
    """Resume a run whose vHub lacks the end of its journal: it stays on the disk, and the capture begins a new one."""
    shutil.copytree(folder.journals, house.folder / "whole")
    tear(folder.journals, channels.VHUB, 60)
    code, out, err = house.run("foosim", "up", "--resume", "far", "--json")
    assert code == 1 and folder.result() is None and "resumes it" not in err
    told = re.fullmatch(
        r".*: vhub has lost the end of its journal: it ends at tick (\d+), deliveries are known up to tick (\d+)\. "
        r"A new run begins with the last captured frame: (.*)",
        last_json(out)["reason"],
    )
    assert told is not None, err
    words = shlex.split(told[3])
    assert words[:3] == ["foosim", "up", str(house.table)]
    assert words[-2:] == ["--from", f"{house.folder / 'far.mcap'}@last"]
    begun = make_plan(RunOptions(Path(words[2]), sets=SETS, branch=words[-1])).start
    captured = open_capture(house.folder / "far.mcap")
    assert begun is not None and begun.origin.tick == captured.frame_ticks[-1] and int(told[1]) < int(told[2])
    assert captured.ticks.tolist() == list(range(len(captured.ticks))), "what it has stays"
    shutil.rmtree(folder.journals)
    shutil.copytree(house.folder / "whole", folder.journals)


def test_a_run_that_does_not_come_up_says_why(house: House, monkeypatch: pytest.MonkeyPatch) -> None:
    (house.folder / "sitecustomize.py").write_text(NO_HUB)
    monkeypatch.setenv("PYTHONPATH", str(house.folder))
    alone = *in_process("null", "vhub"), *in_process("main", "nodes.blue")
    code, _, err = house.run("foosim", "up", house.table, *BARE, *alone, "--detach", "--run", "lame")
    assert code == 1 and "run lame has ended with exit code" in err and "no licence here" in err
