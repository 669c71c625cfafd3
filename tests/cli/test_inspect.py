"""The command `inspect`: what it shows of a URDF file, and of what is none."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Final

import pytest

from foosim.deployment.text.yaml import locate_in, plain, read_tree
from tests.conftest import Command, Typed

ROOT: Final = Path(__file__).parents[2]
ARM: Final = ROOT / "deploy" / "models" / "arm.urdf"
PAGE: Final = (ROOT / "docs" / "how-to" / "robot_from_urdf.md").read_text()


@pytest.fixture
def inspected(typed: Typed) -> Command:
    """Runs the command, in an empty folder."""
    return typed("urdf")


def block(language: str) -> str:
    (text,) = re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    assert isinstance(text, str)
    return text


def test_the_page_shows_what_the_command_prints(tmp_path: Path, inspected: Command) -> None:
    (tmp_path / "scout.urdf").write_text(block("xml"))
    assert inspected("scout.urdf") == (0, block("text"), "")


def test_json_has_the_tree_in_si_units(inspected: Command) -> None:
    done = inspected(ARM, "--assets", ROOT / "deploy", "--json")
    about = json.loads(done.out)
    assert about["file"] == "models/arm.urdf" and about["mass"] == pytest.approx(14.9) and about["free_base"] is None
    assert len(about["links"]) == 9 and len(about["moving"]) == 7
    elbow = about["links"][4]
    assert elbow["name"] == "forearm" and elbow["centre_of_mass"] == [0.0, -0.02, 0.13]
    joint = elbow["joint"]
    assert (joint["name"], joint["parent"], joint["axis"]) == ("elbow_pitch", "elbow", [0.0, 1.0, 0.0])
    assert (joint["limits"], joint["effort"], joint["speed"], joint["damping"]) == ([-2.3, 2.3], 60.0, 2.6, 0.5)
    assert about["links"][-1]["joint"]["axis"] is None, "a fixed joint has none"
    tree, problems = read_tree(about["deployment"], locate_in("page"))
    assert tree is not None and not problems
    said = plain(tree)["robots"]["arm"]
    assert (said["model"], said["file"], said["fixed"]) == ("urdf", "models/arm.urdf", True)


@pytest.mark.parametrize(
    ("name", "content", "what"),
    [
        ("none.urdf", None, "none.urdf: No such file or directory"),
        ("folder", b"", "folder: a folder, where a URDF file is needed"),
        ("empty.urdf", b"", "empty.urdf:1: an empty file"),
        ("text.urdf", b"hello\n", "text.urdf:1: no XML, syntax error"),
        ("mimic.urdf", ARM.read_bytes().replace(b"<axis", b'<mimic joint="x"/><axis', 1), "no joint of this name to "),
        (
            "up.urdf",
            ARM.read_bytes().replace(b'<cylinder radius="0.09"', b'<mesh filename="' + 40 * b"../" + b'a.stl"', 2),
            "a path inside the asset folder has no empty component, no . and no ..",
        ),
        (
            "mesh.urdf",
            ARM.read_bytes().replace(b'<cylinder radius="0.09" length="0.12"', b'<mesh filename="a.stl"', 2),
            "mesh.urdf:23: a mesh that cannot be read: a.stl: No such file",
        ),
    ],
)
def test_what_is_no_robot_is_bad_input(
    tmp_path: Path, inspected: Command, name: str, content: bytes | None, what: str
) -> None:
    if name == "folder":
        (tmp_path / name).mkdir()
    elif content is not None:
        (tmp_path / name).write_bytes(content)
    done = inspected(name)
    assert done.code == 2 and done.out == ""
    assert what in done.err.splitlines()[0], done.err


CASE: Final = """<robot name="g">
<gazebo><plugin name="p1" filename="liba.so"/></gazebo>
<gazebo><plugin name="p2" filename="libb.so"/></gazebo>
<link name="base"><inertial><mass value="0"/><inertia ixx="1" iyy="1" izz="1"/></inertial><collision><geometry><mesh \
filename="x.dae"/></geometry></collision></link>
<link name="tf/frame"/>
<link name="f1"><inertial><mass value="-1"/></inertial></link>
<link name="f2"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="1"/></inertial></link>
<joint name="a" type="fixed"><parent link="base"/><child link="tf/frame"/></joint>
<joint name="b" type="revolute"><parent link="base"/><child link="f1"/><mimic joint="a"/><limit lower="0" upper="1" \
effort="0" velocity="0"/></joint>
<joint name="c" type="hinge"><parent link="base"/><child link="f2"/></joint>
<link name="f3"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial></link>
<joint name="d" type="continuous"><parent link="base"/><child link="f3"/><limit effort="0" velocity="0"/></joint>
</robot>"""
FOUND: Final = """g.urdf:4: a mesh that cannot be read: x.dae: No such file or directory in {folder}
g.urdf:6: a mass of -1 kg, valid are 0 to 1e+06 kg; below 1e-06 kg it counts as none
g.urdf:10: an unknown type of joint, valid are fixed, revolute, continuous, prismatic, 'hinge'
passed over: gazebo (lines 2, 3): it is for another simulator
passed over: plugin (lines 2, 3): sensors, actuators and rules are the deployment's
a mass below 1 mg, of link base (line 4): it counts as none
inertia of link f2 (line 7): principal moments of 0.1, 0.1 and 1 kg m2: no body has one above the sum of both others, \
0.2; instead it has 0.4, 0.4, 0.4 kg m2, its sum spread evenly
joint b follows a (line 9): that does not move it, it is at 0
an effort of 0, of joint d (line 12): its motor applies no force
a velocity of 0, of joint d (line 12): its motor cannot move it
"""


def test_all_findings_of_a_file_are_shown_at_once(tmp_path: Path, inspected: Command) -> None:
    """Errors in the order of the file, then notes."""
    (tmp_path / "g.urdf").write_text(CASE)
    done = inspected("g.urdf")
    assert (done.code, done.out) == (2, "")
    assert done.err == FOUND.format(folder=tmp_path)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_without_permission_is_bad_input(tmp_path: Path, inspected: Command) -> None:
    (tmp_path / "a.urdf").write_bytes(ARM.read_bytes())
    (tmp_path / "a.urdf").chmod(0)
    done = inspected("a.urdf")
    assert done.code == 2 and "a.urdf: Permission denied" in done.err
