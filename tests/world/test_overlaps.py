"""What starts in something is refused when a deployment is loaded: with both names, how deep, and where in the file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.text.report import PROBLEMS_MAX
from foosim.world.clearance.overlaps import FOUND_MAX
from tests.deployed import DEPLOY
from tests.kinematic_yard import yard_text
from tests.world.test_mesh import CUBE

QUAD: Final = {"quad": {"model": "quadrotor", "at": {"y": "9 m", "z": "1 m"}}}
ARM: Final = {"model": "urdf", "file": "arm.urdf", "fixed": True}
TOUCHING: Final = "(up to 1 mm is touching)"


def crate(**settings: Any) -> dict[str, Any]:
    return {"model": "box", "size": ["20 cm"] * 3, "mass": "1 kg", "at": {"z": "10 cm"}, **settings}


def at(**place: str) -> dict[str, str]:
    return {"z": "10 cm", **place}


def text_of(objects: dict[str, Any], robots: dict[str, Any] | None = None, **sections: Any) -> str:
    return yard_text(robots or QUAD, engine="mujoco", substeps=4, objects=objects, **sections)


def problems(text: str, folder: Path | None = None) -> list[str]:
    """What is said of a deployment, without the place in its file; its files are read where a folder is given."""
    try:
        if folder is None:
            load_deployment(text, "yard.yaml")
        else:
            pin_assets(text, "yard.yaml", folder)
    except DeploymentError as error:
        for problem in error.problems:
            file, line, column, _ = problem.split(":", 3)
            assert file == "yard.yaml" and int(line) > 1 and int(column) > 1
        return [problem.split(": ", 1)[1] for problem in error.problems]
    return []


PAIRS: Final[dict[str, tuple[dict[str, Any], list[str]]]] = {
    "a stack": ({"a": crate(count=10, spacing={"z": "20 cm"})}, []),
    "a row": ({"a": crate(count=10, spacing={"x": "20 cm"})}, []),
    "nearly touching": ({"a": crate(at={"z": "99.1 mm"})}, []),
    "in the air": ({"a": crate(at={"z": "5 m"})}, []),
    "corners past each other": ({"a": crate(), "b": crate(at=at(x="23 cm", y="5 cm", yaw="45 deg"))}, [
        f"objects.b.at: b starts 11.4 mm deep in a {TOUCHING}, '0.23 m, 0.05 m, 0.1 m'"
    ]),
    "boxes that meet, not what is in them": ({"a": crate(), "b": crate(at=at(x="20 cm", y="20 cm", yaw="45 deg"))}, []),
    "in the floor": ({"a": crate(at={"z": "5 cm"})}, [
        f"objects.a.at: a starts 50 mm deep in the floor {TOUCHING}, '0 m, 0 m, 0.05 m'"
    ]),
    "in one another": ({"a": crate(), "b": crate(at=at(x="15 cm"))}, [
        f"objects.b.at: b starts 50 mm deep in a {TOUCHING}, '0.15 m, 0 m, 0.1 m'"
    ]),
    "the later one in the file": ({"b": crate(), "a": crate(at=at(x="15 cm"))}, [
        f"objects.a.at: a starts 50 mm deep in b {TOUCHING}, '0.15 m, 0 m, 0.1 m'"
    ]),
    "small ones": ({"a": {"model": "sphere", "radius": "2 mm", "mass": "1 g", "at": {"z": "1 m"}, "count": 2,
                          "spacing": {"x": "3.7 mm"}}}, [
        "objects.a-2.at: a-2 starts 0.3 mm deep in a-1 (up to 0.2 mm is touching), '0.0037 m, 0 m, 1 m'"
    ]),
    "all of a fleet": ({"a": crate(count=1000)}, [
        f"objects.a-2.at: a-2 starts 200 mm deep in a-1 {TOUCHING}, '0 m, 0 m, 0.1 m'"
    ]),
    "a hull": ({"a": crate(), "b": {"model": "hull", "mass": "1 kg", "at": {"x": "19 cm", "z": "1 cm"}, "corners": [
        [x, y, z] for x in ("-10 cm", "10 cm") for y in ("-10 cm", "10 cm") for z in ("0 cm", "20 cm")]}}, [
        f"objects.b.at: b starts 10 mm deep in a {TOUCHING}, '0.19 m, 0 m, 0.01 m'"
    ]),
}  # fmt: skip


@pytest.mark.parametrize("case", PAIRS)
def test_objects(case: str) -> None:
    objects, what = PAIRS[case]
    assert problems(text_of(objects)) == what


def test_so_many_are_named_at_most() -> None:
    with pytest.raises(DeploymentError) as refused:
        load_deployment(text_of({"a": crate(count=300, spacing={"x": "10 cm"})}), "yard.yaml")
    *found, more = refused.value.problems
    assert FOUND_MAX > len(found) == PROBLEMS_MAX and more.startswith("and more: ")
    assert "objects.a-10.at: a-10 starts 100 mm deep in a-9" in found[0]


def test_the_place_is_that_of_the_value_in_the_file() -> None:
    text = text_of({"a": crate(), "b": crate(at=at(x="15 cm"))})
    with pytest.raises(DeploymentError) as refused:
        load_deployment(text, "yard.yaml")
    written = [number for number, row in enumerate(text.splitlines(), 1) if row.strip().startswith("x: 15 cm")]
    (problem,) = refused.value.problems
    assert problem.startswith(f"yard.yaml:{written[0] - 1}:")


def test_robots_scenery_and_movers() -> None:
    path = [{"x": "5 cm"}, {"x": "3 m"}]
    sides = {"length": "50 cm", "width": "20 cm", "height": "1 m"}
    door = {"door": {"model": "mover", "path": path, **sides, "speed": "1 m/s"}}
    assert problems(text_of({"a": crate(at=at(y="25 cm"))}, door)) == []
    assert problems(text_of({"a": crate(at=at(y="15 cm"))}, door)) == [
        f"objects.a.at: a starts 50 mm deep in door {TOUCHING}, '0 m, 0.15 m, 0.1 m'"
    ]
    wall = {"shape": "box", "length": "4 m", "width": "10 cm", "height": "2 m", "y": "9.2 m", "z": "1 m"}
    assert problems(text_of({}, scenery={"wall": wall})) == [
        f"robots.quad.at: quad starts 147 mm deep in the wall {TOUCHING}, '0 m, 9 m, 1 m'"
    ]
    quads = {"quad": {"model": "quadrotor", "at": {"z": "1 m"}, "count": 2, "spacing": {"x": "60 cm"}}}
    assert problems(text_of({}, quads)) == []
    (found,) = problems(text_of({}, {"quad": {**quads["quad"], "spacing": {"x": "57 cm"}}}))
    assert found.startswith("robots.quad-2.at: quad-2 starts ") and "mm deep in quad-1" in found


def arms(*robots: dict[str, Any], objects: dict[str, Any] | None = None, **sections: Any) -> list[str]:
    named = {f"arm{number}": {**ARM, **robot} for number, robot in enumerate(robots)}
    return problems(text_of(objects or {}, named, assets="models", **sections), DEPLOY)


def test_robots_from_files() -> None:
    """Links of one robot are joined; a base that is fixed may stand in a floor, one that is free may not."""
    assert arms({}, {"at": {"x": "50 cm"}}, objects={"a": crate(at=at(x="25 cm"))}) == []
    assert arms({"at": {"z": "-5 cm"}}) == []
    assert arms({"fixed": False, "at": {"z": "-5 cm"}}) == [
        f"robots.arm0.at: arm0 starts 50 mm deep in the floor {TOUCHING}, '0 m, 0 m, -0.05 m'"
    ]
    (found,) = arms({}, {"at": {"x": "5 cm"}})
    assert found.startswith("robots.arm1.at: arm1 starts ") and "mm deep in arm0 (up to 1 mm" in found
    (found,) = arms({}, objects={"a": crate(at=at(x="5 cm", z="80 cm"))})
    assert found.startswith("objects.a.at: a starts ") and "mm deep in arm0 (up to 1 mm" in found


def test_meshes_when_their_files_are_there(tmp_path: Path) -> None:
    """A cube of 2 m: what stands in its side is in it. What is within it touches no triangle, as for Bullet."""
    (tmp_path / "cube.obj").write_text(CUBE)
    rock = {"rock": {"shape": "mesh", "file": "cube.obj", "z": "1 m", "radio": "concrete"}}
    for x, what in (("1.1 m", []), ("1.05 m", ["50 mm"]), ("0 m", []), ("2 m", [])):
        text = text_of({"a": crate(at=at(x=x, z="1 m"))}, scenery=rock)
        assert problems(text) == []
        place = f"{float(x.split()[0]):g} m, 0 m, 1 m"
        assert problems(text, tmp_path) == [
            f"objects.a.at: a starts {depth} deep in the rock {TOUCHING}, '{place}'" for depth in what
        ]
    text = yard_text({"one": {"model": "differential_drive", "at": {"x": "0.9 m"}}}, scenery=rock)
    assert problems(text, tmp_path) == ["robots.one.at: the robot starts in the rock, '0.9 m, 0 m, 0 m'"]


def test_bodies_of_any_kind_beside_rods_are_refused_at_both_places() -> None:
    """The engine of the one has none of the other."""
    box = {
        "model": "box",
        "size": ["4 cm"] * 3,
        "mass": "100 g",
        "speed_limit": "5 m/s",
        "at": {"x": "1 m", "z": "2 cm"},
    }
    text = (DEPLOY / "table.yaml").read_text()
    with pytest.raises(DeploymentError) as refused:
        apply_sets(text, "table.yaml", [f"objects.a={json.dumps(box)}"])
    found = [problem.split(":", 1)[1].split(": ", 1)[1] for problem in refused.value.problems]
    print(found)
    assert len(found) == 2
    assert any("a box, which no engine solves beside robots.red.goal, a rod" in problem for problem in found)
    assert any("a rod, which no engine solves beside objects.a, a box" in problem for problem in found)
