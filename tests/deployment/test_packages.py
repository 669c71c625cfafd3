"""Meshes of a robot's file: where those of packages are found, and which are drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import pytest

from foosim.common import limits
from foosim.deployment.assets import asset_folder, read_robot
from foosim.world.bodies.visual_meshes import drawn_content
from foosim.world.matter.mesh import AssetError
from foosim.world.scene import Hull

WIDTHS: Final = {"right": 1.0, "wrong": 2.0}


def shard(width: float) -> bytes:
    return f"v 0 0 0\nv {width} 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n".encode()


def robot(collision: str, visual: str = "") -> str:
    seen = f'<visual><geometry><mesh filename="{visual}"/></geometry></visual>' if visual else ""
    touched = f'<collision><geometry><mesh filename="{collision}"/></geometry></collision>'
    return f'<robot name="r">\n<link name="a">{seen}\n{touched}</link></robot>'


def write(folder: Path, files: dict[str, str | bytes]) -> None:
    for path, content in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(content.encode() if isinstance(content, str) else content)


def width(file: Path, assets: Path | None) -> float:
    """How wide the hull of the collision is."""
    ((geometry,),) = [[shape.geometry for shape in link.shapes] for link in read_robot(file, assets).links]
    assert isinstance(geometry, Hull)
    return geometry.mesh.box[1][0]


@pytest.mark.parametrize(
    ("asset_root", "right", "wrong"),
    [
        ("ws", "ws/arm/meshes/a.STL.obj", "arm/meshes/a.STL.obj"),
        ("ws/src/arm_repo", "ws/src/arm_repo/robots/arm/meshes/a.STL.obj", "ws/arm/meshes/a.STL.obj"),
        ("ws/src", "ws/src/arm/meshes/a.STL.obj", "ws/src/arm_repo/meshes/a.STL.obj"),
        ("ws/src/arm_repo/robots", "ws/src/arm/meshes/a.STL.obj", "ws/src/arm_repo/meshes/a.STL.obj"),
        ("ws/src/arm_repo", "ws/src/arm_repo/meshes/a.STL.obj", "meshes/a.STL.obj"),
        ("ws/src/arm_repo/robots", "ws/src/arm_repo/meshes/a.STL.obj", "other/meshes/a.STL.obj"),
    ],
    ids=["asset folder", "around the file", "asset folder first", "above", "own package inside", "own package above"],
)
def test_a_mesh_of_a_package_is_found_where_packages_are(
    tmp_path: Path, asset_root: str, right: str, wrong: str
) -> None:
    file = "ws/src/arm_repo/robots/arm.urdf"
    package = {"ws/src/arm_repo/package.xml": "<package/>", file: robot("package://arm/meshes/a.STL.obj")}
    write(tmp_path, {**package, right: shard(1.0), wrong: shard(2.0)})
    assert width(tmp_path / file, tmp_path / asset_root) == 1.0


@pytest.mark.parametrize("asset_root", [".", "arm_description", "arm_description/urdf"])
def test_a_part_of_a_package_that_was_copied_alone_has_its_meshes(tmp_path: Path, asset_root: str) -> None:
    file, inside = "arm_description/urdf/r.urdf", "arm_description/meshes/a.obj"
    written = robot("package://all/robots/" + inside.replace("a.obj", "&#97;.obj"))
    write(tmp_path, {file: written, inside: shard(1.0), "arm/meshes/a.obj": shard(2.0)})
    assert width(tmp_path / file, tmp_path / asset_root) == 1.0


def test_missing_meshes_of_a_file_are_one_error(tmp_path: Path) -> None:
    names = [f"m{number}.obj" for number in range(9)]
    links = [robot(f"package://arm/{name}").replace('"a"', f'"{name}"') for name in names]
    write(tmp_path, {"r.urdf": "".join(links).replace('</robot><robot name="r">', "")})
    with pytest.raises(AssetError) as refusal:
        read_robot(tmp_path / "r.urdf", tmp_path)
    shown, lines = ", ".join(f"arm/{name}" for name in names[:8]), ", ".join(str(line) for line in range(3, 19, 2))
    first, *others = str(refusal.value).splitlines()
    what = f"r.urdf:3: 9 meshes that cannot be read: {shown}, ... (lines {lines}, ...): "
    assert first.startswith(f"{what}No such file or directory in {tmp_path}, around r.urdf, ")
    assert len(others) == 1 and "hang on none" in others[0]


def test_places_too_deep_for_a_path_are_passed_over(tmp_path: Path) -> None:
    file, mesh = "a/b/c/d/robots/arm.urdf", "arm/meshes/visual/parts/a.obj"
    write(tmp_path, {f"ws/{file}": robot(f"package://{mesh}"), mesh: shard(1.0)})
    assert width(tmp_path / "ws" / file, tmp_path / "ws") == 1.0


def test_a_mesh_that_is_nowhere_is_an_error_with_its_places_beside_all_other_errors(tmp_path: Path) -> None:
    text = robot("package://arm/a.obj").replace("</link>", '</link><link name="a"/><joint name="j"/>')
    write(tmp_path, {"deep/robots/r.urdf": text, "deep/meshes/a.obj": shard(1.0)})
    with pytest.raises(AssetError) as refusal:
        read_robot(tmp_path / "deep/robots/r.urdf", tmp_path / "deep")
    *others, last = str(refusal.value).splitlines()
    assert last.startswith("robots/r.urdf:3: a mesh that cannot be read: arm/a.obj: No such file or directory in ")
    assert f"{tmp_path}/deep, around robots/r.urdf, and in the folders above up to /" in last
    assert len(others) >= 2 and not any("missing" in line for line in others), "each is said once"


def test_a_relative_path_is_found_where_it_leads_and_nowhere_else(tmp_path: Path) -> None:
    file = tmp_path / "arm/robots/r.urdf"
    write(tmp_path, {"arm/robots/r.urdf": robot("../meshes/a.OBJ"), "arm/meshes/a.OBJ": shard(1.0)})
    assert asset_folder(file) == tmp_path / "arm" and read_robot(file, None).file == "robots/r.urdf"
    assert width(file, None) == 1.0
    file.write_text(robot("meshes/a.OBJ"))
    assert asset_folder(file) == tmp_path / "arm/robots"
    with pytest.raises(AssetError, match=r"^r\.urdf:3: a mesh that cannot be read: meshes/a\.OBJ: No such file"):
        read_robot(file, None)


def test_the_meshes_of_an_mjcf_file_are_where_its_compiler_says(tmp_path: Path) -> None:
    mesh = '<compiler meshdir="../meshes"/><asset><mesh name="m" file="a.obj"/></asset>'
    body = '<body><inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/><geom type="mesh" mesh="m"/></body>'
    text = f"<mujoco>{mesh}<worldbody>{body}</worldbody></mujoco>"
    write(tmp_path, {"arm/robots/r.xml": text, "arm/meshes/a.obj": shard(1.0)})
    assert asset_folder(tmp_path / "arm/robots/r.xml") == tmp_path / "arm"
    assert width(tmp_path / "arm/robots/r.xml", None) == 1.0


def test_a_link_on_the_way_to_a_package_is_not_followed(tmp_path: Path) -> None:
    write(tmp_path, {"ws/r.urdf": robot("package://arm/a.obj"), "elsewhere/a.obj": shard(1.0)})
    (tmp_path / "ws/arm").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(AssetError, match="a symbolic link, or no folder, on the way"):
        read_robot(tmp_path / "ws/r.urdf", tmp_path / "ws")


def test_a_visual_that_cannot_be_drawn_is_noted_and_a_large_one_is_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file of a visual may be larger than one of a collision; only what is drawn of it is kept."""
    large = shard(1.0) + b"# " + b"x" * 3000
    write(tmp_path, {"r.urdf": robot("a.obj", "b.obj"), "a.obj": shard(1.0), "b.obj": large, "c.dae": b"<svg/>"})
    monkeypatch.setattr(limits, "ASSET_BYTES_MAX", 2000)
    assert len(drawn_content("b.obj", large)) < 200
    assert [len(link.visuals) for link in read_robot(tmp_path / "r.urdf", None).links] == [1]
    for visual, reason in {"c.dae": "c.dae (line 2): 0 scenes", "d.stl": "d.stl (line 2): No such file"}.items():
        (tmp_path / "r.urdf").write_text(robot("a.obj", visual))
        found = read_robot(tmp_path / "r.urdf", None)
        assert [link.visuals for link in found.links] == [()]
        assert any(reason in note for note in found.notes), found.notes
