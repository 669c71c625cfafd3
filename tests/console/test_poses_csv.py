"""Tables of recorded poses: what is read, in which units, and what is refused at which line."""

from __future__ import annotations

from math import cos, pi, sin
from pathlib import Path

import numpy as np
import pytest

from foosim.console.recorded.poses_csv import BadPoses, read_tracks
from foosim.console.recorded.poses_source import load_tracks
from tests.simulation.conftest import replay


def read(text: str) -> dict[str, tuple[list[int], list[list[float]]]]:
    """The tracks of a text, as lists."""
    tracks = read_tracks(text.splitlines(keepends=True), "poses.csv")
    return {name: (track.times_ns.tolist(), track.poses.tolist()) for name, track in tracks.items()}


def test_units_stand_in_the_names_of_columns_and_yaw_turns_about_the_vertical() -> None:
    head = "# motion capture\nname;time_ms;x_mm;y_cm;yaw_deg;quality\n"
    times, poses = read(head + "rover1;1.5;250;-10;90;good\n\nrover1;2;251;0;0;\n")["rover1"]
    assert times == [1_500_000, 2_000_000]
    assert poses[0] == pytest.approx([0.25, -0.1, 0.0, 0.0, 0.0, sin(pi / 4), cos(pi / 4)])
    assert poses[1] == pytest.approx([0.251, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


def test_a_mark_of_the_byte_order_a_tab_and_no_orientation_are_taken() -> None:
    times, poses = read("\ufefftime\tentity\tx\ty\tz\n0.1\tball\t1\t2\t3\n")["ball"]
    assert times == [100_000_000] and poses == [[1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0]]


def test_nanoseconds_keep_all_their_digits() -> None:
    times, _ = read("time_ns,entity,x,y\n1234567890123456789,ball,0,0\n")["ball"]
    assert times == [1234567890123456789]


def test_an_exported_table_of_poses_is_one(run: Path, tmp_path: Path) -> None:
    table = tmp_path / "poses.csv"
    assert replay("export", run, "--what", "poses", "-o", table).code == 0
    tracks = load_tracks(table)
    assert {"ball", "red.goal/slide", "red.goal/spin"} <= tracks.keys()
    assert len(tracks["ball"].times_ns) == 32, "each 20 ms, and where a ball was added"
    assert np.all(np.diff(tracks["ball"].times_ns) > 0)


HEAD = "time_s,entity,x,y,qx,qy,qz,qw\n"
GOOD = "0,ball,0,0,0,0,0,1\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "poses.csv: the file is empty; the first line names the columns"),
        (HEAD, "poses.csv: no line after the header"),
        ("tme,entity,x,y\n", "poses.csv:1: no column for time (time, time_s, time_ms, time_us, time_ns) among "),
        ("time_s,time_ns,entity,x,y\n", "poses.csv:1: several columns for time; give one of time_s and time_ns"),
        ("time,x,y\n", "poses.csv:1: no column for what moves (entity, link, name, body) among time, x, y"),
        ("time,entity,x,y,yaw,qw,qx,qy,qz\n", "poses.csv:1: several orientations; give one of yaw, qx, qy, qz, qw"),
        ("time,entity,x,y,qx,qy,qz\n", "poses.csv:1: an orientation needs qx, qy, qz, qw; qw is missing"),
        ("time,entity,x,y,x\n", "poses.csv:1: column 'x' is there twice"),
        (HEAD + GOOD + "0.1,ball,1,2\n", "poses.csv:3: 4 values, the first line names 8 columns"),
        (HEAD + GOOD + "0.1,ball,1,b,0,0,0,1\n", "poses.csv:3: column 'y' is not a number, 'b'"),
        (HEAD + "0.1,ball,1,nan,0,0,0,1\n", "poses.csv:2: column 'y' is not a number, 'nan'"),
        (HEAD + "0.1,ball,1e9,0,0,0,0,1\n", "poses.csv:2: column 'x' is out of range (1e+06), '1e9'"),
        (HEAD + "1e30,ball,1,0,0,0,0,1\n", "poses.csv:2: column 'time_s' is out of range"),
        (HEAD + "0.1,,1,0,0,0,0,1\n", "poses.csv:2: column 'entity' is empty"),
        (HEAD + "0.1,ball,1,0,0,0,0,0.5\n", "poses.csv:2: a quaternion of length 0.5; expected 1"),
        (HEAD + GOOD + GOOD, "poses.csv:3: ball at 0 s is not later than 0 s; times ascend"),
        (HEAD + '0,"ball,0,0,0,0,0,1\n', "poses.csv:2: not a line of a table"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(text: str, said: str) -> None:
    with pytest.raises(BadPoses) as refused:
        read(text)
    assert str(refused.value).startswith(said), str(refused.value)


def test_files_that_are_no_text_are_refused(tmp_path: Path) -> None:
    binary = tmp_path / "binary.csv"
    binary.write_bytes(b"time,entity,x,y\n\xff\xfe,ball,0,0\n")
    for path, said in ((binary, "not a text in UTF-8"), (tmp_path, "cannot be read"), (tmp_path / "no", "cannot be")):
        with pytest.raises(BadPoses, match=said):
            load_tracks(path)
