"""The guide to one's own robot, as a reader follows it: its files in an empty folder, its commands in their order.

What starts processes is a process itself; the others are called here.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from runpy import run_path
from typing import Final

import pytest

from foosim.cli import main

ROOT: Final = Path(__file__).parents[2]
PAGE: Final = (ROOT / "docs" / "how-to" / "robot_from_urdf.md").read_text()
DIFFERS: Final = 1
"""Exit code of `foosim capture diff`: on two nodes others took part."""


def files() -> dict[str, str]:
    """The files that the guide has, by name."""
    named = dict(re.findall(r"^```(?:yaml|python)\n# ([\w.]+)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL))
    (urdf,) = re.findall(r"^```xml\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    return {"scout.urdf": urdf, **named}


def commands() -> list[list[str]]:
    """The lines that are typed, in their order."""
    blocks = re.findall(r"^```sh\n(.*?)^```$|^    ((?:foosim |python )[^\n]*)$", PAGE, re.MULTILINE | re.DOTALL)
    lines = [line for sh, one in blocks for line in (sh or one).splitlines()]
    return [shlex.split(line) for line in lines if not line.startswith("export ")]


def run(words: list[str], folder: Path) -> tuple[object, str]:
    """Run a command in this process; return its exit code and all that it printed."""
    if words[:2] == ["foosim", "up"]:
        return run_here(words, folder)
    with StringIO() as printed, pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr(sys, "argv", words)
        with redirect_stdout(printed), redirect_stderr(printed):
            if words[0] == "python":
                run_path(words[1])
                return 0, printed.getvalue()
            with pytest.raises(SystemExit) as ended:
                main()
        return ended.value.code, printed.getvalue()


def run_here(words: list[str], folder: Path) -> tuple[int, str]:
    """Run a command as it is installed here; return its exit code and all that it printed."""
    command = [str(Path(sys.executable).parent / words[0]), *words[1:]]
    environment = {**os.environ, "PYTHONPATH": "", "XDG_STATE_HOME": str(folder / "state")}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """What each command printed."""
    folder = tmp_path_factory.mktemp("robot")
    for name, text in files().items():
        (folder / name).write_text(text)
    found = {}
    for words in commands():
        code, text = run(words, folder)
        line = " ".join(words)
        assert code == (DIFFERS if words[:3] == ["foosim", "capture", "diff"] else 0), f"{line}:\n{text}"
        found[line] = text
    assert {"live.mcap", "scout.mcap", "two.mcap", "commands.csv", "scout.html"} <= {p.name for p in folder.iterdir()}
    yield found
    del sys.modules["driver"]


def test_the_guide_goes_from_the_file_to_the_capture(printed: dict[str, str]) -> None:
    begins = [
        "foosim urdf",
        "foosim check",
        "foosim up",
        "foosim rehearse scout.yaml",
        "foosim capture info",
        "foosim capture verify",
        "foosim capture export",
        "foosim capture report",
        "python look.py",
        "foosim rehearse scout.yaml",
        "foosim capture diff",
    ]
    assert len(begins) == len(printed)
    assert all(line.startswith(words) for line, words in zip(printed, begins, strict=True)), printed.keys()
    assert sorted(files()) == ["driver.py", "look.py", "scout.urdf", "scout.yaml"]


def test_the_robot_rolls_as_far_as_its_wheels_turn(printed: dict[str, str]) -> None:
    numbers = [float(number) for number in re.findall(r"-?[0-9]+\.[0-9]+", printed["python look.py"])]
    turned, driven, elbow = numbers
    assert 1.2 < driven < 1.4, "it stops before the crate, whose front is 1.57 m before the eye"
    assert abs(driven / (0.1 * turned) - 1.0) < 0.01
    assert abs(elbow - 0.8) < 0.01


def test_one_and_two_nodes_compute_the_same_world(printed: dict[str, str]) -> None:
    digests = {
        digest
        for line, text in printed.items()
        for digest in re.findall(r"digest of all ticks ([0-9a-f]{64})", text)
        if line.startswith(("foosim rehearse", "foosim capture"))
    }
    assert len(digests) == 1
    (said,) = [text for line, text in printed.items() if line.startswith("foosim capture diff")]
    assert all(
        re.search(rf"^  /{topic}: \d+ rows, equal$", said, re.MULTILINE) for topic in ("frame", "tick", "packets")
    )
