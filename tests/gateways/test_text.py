"""Text files: bytes as MORSE writes them, nothing lost at the end, and a full disk that ends one file alone."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from foosim.common.errors import Refused
from tests.gateways.serving import Served

ROBOT = """
    model: differential_drive
    at: {{x: -3 m, y: {y} m, yaw: 90 deg}}
    sensors:
      pose: {{kind: pose_3d, rate: 50 Hz}}
      eye: {{kind: semantic_camera, rate: 10 Hz, tag: vehicle, label: Eye.2, at: {{x: 30 cm, y: 40 cm}}}}"""
TEXT = f"""
format: 2
world: field
seed: 1
tick: 10 ms
substeps: 1
engine: pure
pace: fast
scene: {{kind: empty}}
robots:
  cat:
    label: Cat/1{ROBOT.format(y=0)}
  mouse:{ROBOT.format(y=3)}
nodes: {{n1: {{robots: [cat, mouse]}}}}
"""


def served(folder: Path, text: str = TEXT, robots: str = "[cat]") -> Served:
    def script(served: Served) -> Iterator[int]:
        yield 0

    return Served(
        f"{text}gateways: {{log: {{kind: text, robots: {robots}, folder: {json.dumps(str(folder))}}}}}", "log", script
    )


def test_files_have_the_bytes_of_morse_and_all_records(tmp_path: Path) -> None:
    for runs in (1, 2):
        one = served(tmp_path / "logs")
        one.rehearse(100)
        text, count = (tmp_path / "logs" / "Cat_1.Eye2.txt").read_text(), one.run.components["Cat/1.Eye.2"].count
        assert count > 5 and text.count("==> ") == runs * count, "a file that exists is continued"
        assert text.count("ROBOT") == 1
    pose = (tmp_path / "logs" / "Cat_1.pose.txt").read_text()
    at = "[-3.000000 0.000000 0.000000]yaw,pitch,roll: [1.570796 0.000000 0.000000]"
    times = re.findall(r"index 1 \| time (.*)\n\ttimestamp = (.*)\n", pose)
    assert pose.startswith(
        "ROBOT Cat/1 || SENSOR Cat/1.pose\n(distance, globalVector(3), localVector(3))\n"
        "(0.0, Vector((0.0, 0.0, 0.0)), Vector((0.0, 0.0, 0.0)))\n\n"
        f"==> Data at X,Y,Z: {at} | index 0 | time "
    )
    assert all(f"{float(exact):.2f}" == time for time, exact in times) and len(times) == 2
    assert pose.endswith(
        "\tx = -3.000000\n\ty = 0.000000\n\tz = 0.000000\n\tyaw = 1.570796\n\tpitch = 0.000000\n\troll = 0.000000\n"
    )
    mounting = re.fullmatch(r"\((.*), Vector\(\((.*)\)\), Vector\(\((.*)\)\)\)", text.split("\n")[2])
    assert mounting is not None
    numbers = [float(number) for group in mounting.groups() for number in group.split(", ")]
    assert numbers == pytest.approx([0.5, -0.8, 0.6, 0.0, 0.6, 0.8, 0.0])
    seen = one.run.components["Cat/1.Eye.2"].fields
    assert seen is not None and seen["visible_objects"][0]["name"] == "mouse"
    assert text.endswith(f"\tvisible_objects = {seen['visible_objects']!r}\n")


@pytest.mark.parametrize("ticks", [30, 400])
def test_a_full_disk_ends_one_file_and_is_reported_once(
    ticks: int, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """At the end, where all of it is in the buffer, or before."""
    (tmp_path / "mouse.pose.txt").symlink_to("/dev/full")
    one = served(tmp_path, robots="[cat, mouse]")
    one.rehearse(ticks)
    (message,) = [record.getMessage() for record in caplog.records if record.name == "log"]
    assert message == f"{tmp_path}/mouse.pose.txt is not written any more: No space left on device"
    counts = {full: its.count for full, its in one.run.components.items() if full in ("mouse.pose", "Cat/1.pose")}
    assert (tmp_path / "Cat_1.pose.txt").read_text().count("==> ") == counts["Cat/1.pose"] == counts["mouse.pose"]


def test_what_cannot_be_opened_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    text = TEXT.replace("pose: {kind: pose_3d, rate: 50 Hz}", "pose: {kind: pose_3d, rate: 50 Hz, label: Eye2}", 1)
    for one, reason in (
        (served(tmp_path / "file"), f"log: {tmp_path}/file: File exists"),
        (served(tmp_path, text), "log: Cat_1.Eye2.txt is the file of two sensors: change the label of one"),
    ):
        with pytest.raises(Refused) as refused:
            one.loop.run_until_complete(one.gateway.open())
        one.loop.close()
        assert str(refused.value) == reason
