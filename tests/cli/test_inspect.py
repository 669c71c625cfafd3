"""The command `inspect`: what it shows of a URDF file, and of what is none."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Final

import pytest

from foosim.deployment.assets import read_robot
from foosim.deployment.text.yaml import locate_in, plain, read_tree
from foosim.world.bodies.urdf_text import snippet
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
    (tmp_path / "turret.urdf").write_text(block("xml"))
    assert inspected("turret.urdf") == (0, block("text"), "")


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
        ("folder", b"", "folder: no regular file"),
        ("empty.urdf", b"", "empty.urdf:1: an empty file"),
        ("text.urdf", b"hello\n", "text.urdf:1: no XML, syntax error"),
        ("mimic.urdf", ARM.read_bytes().replace(b"<axis", b'<mimic joint="x"/><axis', 1), "a mimic joint: "),
        (
            "mesh.urdf",
            ARM.read_bytes().replace(b"<cylinder", b'<mesh filename="a.stl"/><cylinder', 2),
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
    assert what in done.err and len(done.err.splitlines()) == 1, done.err


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_without_permission_is_bad_input(tmp_path: Path, inspected: Command) -> None:
    (tmp_path / "a.urdf").write_bytes(ARM.read_bytes())
    (tmp_path / "a.urdf").chmod(0)
    done = inspected("a.urdf")
    assert done.code == 2 and "a.urdf: Permission denied" in done.err


def test_what_has_wheels_is_not_proposed_to_be_fixed(tmp_path: Path) -> None:
    """A last joint that turns without end is that of an arm; two that end in nothing else are wheels."""
    inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    ball = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    links = "".join(f'<link name="{name}">{inertial}{ball}</link>' for name in "abc")
    for parents, fixed in (("aa", "false"), ("ab", "true")):
        joints = "".join(
            f'<joint name="j{child}" type="continuous"><parent link="{parent}"/><child link="{child}"/></joint>'
            for parent, child in zip(parents, "bc", strict=True)
        )
        (tmp_path / "r.urdf").write_text(f'<robot name="r">{links}{joints}</robot>')
        assert f"fixed: {fixed}, " in snippet(read_robot(tmp_path / "r.urdf", None))
