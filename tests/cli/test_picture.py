"""Pictures of commands: files of the three kinds, and what is refused before anything is computed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from foosim.analysis import picture
from foosim.capture.new_file import Existing
from foosim.common.errors import BadValue, Failed
from tests.conftest import Typed


def drawn(out: Path) -> bytes:
    picture.check_picture(out)
    with picture.new_picture(out) as figure:
        figure.suptitle("a run of $x^$ & <y>")
        figure.subplots().plot([0.0, 1.0], [0.0, 2.0])
    return out.read_bytes()


@pytest.mark.parametrize(("name", "begins"), [("a.svg", b"<?xml"), ("a.PNG", b"\x89PNG"), ("a.pdf", b"%PDF")])
def test_a_picture_is_of_the_kind_that_its_name_says_and_the_same_each_time(
    tmp_path: Path, name: str, begins: bytes
) -> None:
    found = drawn(tmp_path / name)
    assert found.startswith(begins) and found == drawn(tmp_path / f"again-{name}")
    assert sorted(path.name for path in tmp_path.iterdir()) == [name, f"again-{name}"]
    if begins == b"<?xml":
        assert b"a run of $x^$ &amp; &lt;y&gt;" in found, "text stays text"


def test_what_cannot_be_drawn_is_refused_and_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there = tmp_path / "there.svg"
    there.write_text("")
    for out, kind, words in (
        (tmp_path / "a.jpg", BadValue, "--picture: the name of the picture ends with .svg or .png or .pdf, '"),
        (there, Existing, "exists already, and is not overwritten"),
        (tmp_path / "none" / "a.svg", Failed, "a.svg: cannot be written, No such file or directory"),
        (there / "a.svg", Failed, "a.svg: cannot be written, Not a directory"),
    ):
        with pytest.raises(kind) as refused:
            picture.check_picture(out)
        assert words in str(refused.value)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(Failed, match=r"needs matplotlib: pip install 'foosim\[plot\]'"):
        picture.check_picture(tmp_path / "a.svg")
    assert [*tmp_path.iterdir()] == [there]


def test_a_match_without_matplotlib_plays_no_game(
    typed: Typed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    table = Path(__file__).parents[2] / "deploy" / "table.yaml"
    words = ("--games", "1", "--minutes", "0.01", "--jobs", "1", "--delay", "1ms", "--deployment", table)
    done = typed("match")("team", "passive", *words, "--picture", tmp_path / "a.svg")
    assert done.code == 1 and "pip install 'foosim[plot]'" in done.err and "game 1" not in done.err
    assert [*tmp_path.iterdir()] == []


def test_commands_do_not_import_matplotlib() -> None:
    """It takes half a second, and may not be installed."""
    modules = ", ".join(f"foosim.cli.{name}" for name in ("match.command", "capture.command", "sweep_results"))
    program = f"import sys, {modules}\nassert 'matplotlib' not in sys.modules"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
