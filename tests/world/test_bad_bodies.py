"""Bodies that cannot be, in whole deployments: each is refused with its place, its value and what is valid.

`test_urdf.py` has the files that are no robots one by one, `test_overlaps.py` what starts in something.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.common.errors import Refused
from foosim.deployment.assets import pin_assets
from tests.kinematic_yard import yard_text

ARM: Final = (Path(__file__).parents[2] / "deploy" / "models" / "arm.urdf").read_text()
JOINTS: Final = {"joints": {"kind": "joint_position", "gain": "20 Hz"}}
LOOP: Final = '<joint name="back" type="fixed"><parent link="grip"/><child link="base"/></joint></robot>'
MESH: Final = '<link name="grip"><collision><geometry><mesh filename="gripper.stl"/></geometry></collision></link>'


def said(arm: str = ARM, *, folder: Path, objects: Any = None, **robot: Any) -> str:
    """What is said of a world with an arm whose file this is; nothing if it is good."""
    (folder / "arm.urdf").write_text(arm)
    robots = {"arm": {"model": "urdf", "file": "arm.urdf", "fixed": True, "actuators": JOINTS, **robot}}
    try:
        pin_assets(yard_text(robots, engine="mujoco", objects=objects or {}), "yard.yaml", folder)
    except Refused as error:
        return str(error)
    return ""


def line_of(what: str) -> int:
    return ARM[: ARM.index(what)].count("\n") + 1


FIRST_JOINT: Final = ARM[ARM.index("<joint") :].partition(">")[0] + ">"
FIRST_MASS: Final = ARM[ARM.index("<mass") :].partition("/>")[0] + "/>"

FILES: Final[dict[str, tuple[str, str, str]]] = {
    "a loop": ("</robot>", LOOP, "a loop: "),
    "a mass of a mountain": (FIRST_MASS, '<mass value="1e8"/>', "a mass of 1e+08 kg, valid are 0 to 1e+06 kg"),
}


@pytest.mark.parametrize("case", FILES)
def test_files(case: str, tmp_path: Path) -> None:
    """Each names the file and the line: of a loop that of its first joint."""
    old, new, what = FILES[case]
    line = line_of(FIRST_JOINT if case == "a loop" else old)
    assert said(ARM.replace(old, new, 1), folder=tmp_path).startswith(f"arm.urdf:{line}: {what}")


def test_a_mesh_that_is_missing(tmp_path: Path) -> None:
    text = ARM.replace('<link name="grip"/>', MESH)
    assert text != ARM
    line, what = line_of('<link name="grip"/>'), "a mesh that cannot be read: gripper.stl: No such file or directory"
    assert said(text, folder=tmp_path) == f"arm.urdf:{line}: {what} in {tmp_path}"
    assert said(folder=tmp_path) == "", "the arm itself is good"


@pytest.mark.parametrize(
    ("robot", "what"),
    [
        (
            {"actuators": {"joints": {"kind": "joint_position", "gain": "101 Hz"}}},
            "robots.arm.actuators.joints: a gain that overshoots: "
            "at most the inverse of a tick, 100 Hz, is stable, 101.0",
        ),
    ],
)  # fmt: skip
def test_settings(robot: dict[str, Any], what: str, tmp_path: Path) -> None:
    found = said(folder=tmp_path, **robot)
    place, _, rest = found.partition(": ")
    assert rest.startswith(what), found
    assert place.startswith("yard.yaml:") and found.count("\n") == 0


@pytest.mark.parametrize(
    ("settings", "what"),
    [
        ({"size": ["1 m", "0 m", "1 m"]}, "objects.a.size[1]: out of range 0.1 mm to 1000 m, '0 m'"),
        ({"size": ["1 m", "1 m"]}, "objects.a.size: "),
    ],
)
def test_objects(settings: dict[str, Any], what: str, tmp_path: Path) -> None:
    box = {"model": "box", "size": ["20 cm"] * 3, "mass": "1 kg", "at": {"x": "3 m", "z": "10 cm"}, **settings}
    found = said(folder=tmp_path, objects={"a": box})
    assert found.partition(": ")[2].startswith(what), found


PART: Final = (
    '<link name="{name}"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>'
    '<collision><geometry><sphere radius="0.02"/></geometry></collision></link>'
    '<joint name="to_{name}" type="revolute"><parent link="{parent}"/><child link="{name}"/><origin xyz="0 0 0.2"/>'
    '<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="10" velocity="5"/></joint>'
)
THREE: Final = (
    '<robot name="r"><link name="foot"/>'
    + "".join(PART.format(name=name, parent=parent) for parent, name in pairwise(("foot", "upper", "fore", "hand")))
    + "</robot>"
)


CLASHES: Final[dict[str, tuple[Any, Any, str]]] = {
    "both name it": (
        ["to_upper", "to_fore"],
        ["to_hand", "to_fore"],
        "arm.joints: a joint that base commands already, 'to_fore'",
    ),
    "one commands all": (None, ["to_hand"], "arm.joints: a joint that base commands already, 'to_hand'"),
    "the other one does": (["to_hand"], None, "arm.joints: a joint that base commands already, 'to_hand'"),
    "both do": (None, None, "arm.joints: a joint that base commands already, 'to_upper'"),
    "patterns do": ("to_?[op]*", ["to_hand", "*r"], "arm.joints: a joint that base commands already, 'to_upper'"),
    "no one does": (["to_upper", "to_hand"], ["to_fore"], ""),
    "nor do patterns": ("*_[uh]*", "to_f*", ""),
}


@pytest.mark.parametrize("case", CLASHES)
def test_actuators_share_a_robot_but_no_joint(case: str, tmp_path: Path) -> None:
    theirs, own, what = CLASHES[case]
    kinds = {"base": ("joint_velocity", theirs), "arm": ("joint_position", own)}
    actuators = {name: {"kind": kind} | ({"joints": its} if its else {}) for name, (kind, its) in kinds.items()}
    found = said(THREE, folder=tmp_path, actuators=actuators)
    assert found.partition("actuators.")[2] == what, found


def test_an_engine_that_does_not_have_such_bodies(tmp_path: Path) -> None:
    box = {"model": "box", "size": ["20 cm"] * 3, "mass": "1 kg", "at": {"x": "2 m", "z": "10 cm"}}
    text = yard_text({"base": {"model": "differential_drive"}}, engine="pure", objects={"crate": box})
    with pytest.raises(Refused) as refused:
        pin_assets(text, "yard.yaml", tmp_path)
    what = (
        "engine: engine 'pure' supports only table rods and balls; objects.crate is a box: set engine: mujoco, 'pure'"
    )
    assert str(refused.value).endswith(what)
    pin_assets(text.replace("engine: pure", "engine: mujoco"), "yard.yaml", tmp_path)
