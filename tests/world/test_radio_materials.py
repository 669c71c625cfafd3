"""What radio waves lose in things: how it is written in a deployment, and what is refused, with its place."""

from __future__ import annotations

from pathlib import Path
from typing import Final, get_args

import numpy as np
import pytest
import yaml

from foosim.common.errors import DeploymentError
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.world.assembly.world import build_scene
from foosim.world.layout import build_layout
from foosim.world.matter.materials import MATERIALS, METAL, PLASTIC, UNKNOWN, WOOD, MaterialName, RadioMaterial
from foosim.world.mesh_files import is_closed, read_mesh
from foosim.world.scene import Cylinder
from tests.deployed import TEXT

POST: Final = "shape: cylinder, radius: 1 cm, length: 20 cm, z: 1 m, surface: walls"
NAMES: Final = "concrete, brick, plasterboard, wood, glass, chipboard, metal"
SIMPLEX: Final = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n"
LAST_FACE: Final = b"f 3 1 4\n"


def with_radio(radio: str) -> str:
    return f"{TEXT}\nscenery:\n  post: {{{POST}, radio: {radio}}}\n"


def radio_of(radio: str) -> RadioMaterial:
    (shape,) = load_deployment(with_radio(radio), "t").scenery_shapes()
    assert shape.name == "post" and shape.geometry == Cylinder(0.01, 0.2)
    return shape.radio


def test_a_material_is_a_name_a_shell_a_loss_or_nothing() -> None:
    for name in MATERIALS:
        assert radio_of(name) == radio_of(f"{{is: {name}}}") == RadioMaterial.model_validate({"is": name})
        assert radio_of(name).needs_chord and not radio_of(name).is_transparent
    shell = radio_of("{is: glass, thickness: 6 mm}")
    assert (shell.is_, shell.thickness_m, shell.loss_db) == ("glass", 0.006, None) and not shell.needs_chord
    loss = radio_of("{loss: 12.5 dB}")
    assert (loss.is_, loss.thickness_m, loss.loss_db) == (None, None, 12.5) and not loss.needs_chord
    assert radio_of("none").is_transparent and radio_of("none").loss_db == 0.0
    assert radio_of("null") == UNKNOWN and UNKNOWN.loss_db == 5.0, "where nothing is said"
    assert get_args(MaterialName) == MATERIALS


def test_a_setting_takes_what_a_file_takes() -> None:
    text = apply_sets(with_radio("metal"), "t", ["scenery.post.radio={is: brick, thickness: 10 cm}"])
    assert yaml.safe_load(text)["scenery"]["post"]["radio"] == {"is": "brick", "thickness": "10 cm"}


@pytest.mark.parametrize(
    ("radio", "problem"),
    [
        ("wod", f"radio: not one of {NAMES}, none, and no mapping with is or loss, 'wod', nearest is 'wood'"),
        ("5 dB", f"radio: not one of {NAMES}, none, and no mapping with is or loss, '5 dB'"),
        ("{is: glas}", f"radio.is: not one of {NAMES}, 'glas', nearest is 'glass'"),
        ("{is: glass, thick: 6 mm}", "radio: unknown key, 'thick', nearest is 'thickness'"),
        ("{is: glass, thickness: 6}", "radio.thickness: not a length (a number and one of m, cm, mm, um, km), 6"),
        ("{loss: 5}", "radio.loss: not a level (a number and one of dB), 5"),
        ("{loss: -1 dB}", "radio.loss: out of range 0 dB to 200 dB, '-1 dB'"),
        ("{thickness: 6 mm}", "radio: missing key of a material, unless it has a loss, 'is'"),
        ("{is: null}", "radio: missing key of a material, unless it has a loss, 'is'"),
        ("{is: wood, loss: 5 dB}", "radio: no effect beside loss, which holds for any material, 'is'"),
        ("{loss: 5 dB, thickness: 1 cm}", "radio: no effect beside loss, which holds for any material, 'thickness'"),
        ("[wood]", "radio: not a mapping, a list of 1"),
    ],
)  # fmt: skip
def test_an_invalid_material_is_refused_with_its_place(radio: str, problem: str) -> None:
    text = with_radio(radio)
    with pytest.raises(DeploymentError) as refusal:
        load_deployment(text, "t")
    (line,) = refusal.value.problems
    place, _, what = line.partition(": scenery.post.")
    assert what == problem
    name, number, column = place.split(":")
    assert name == "t" and text.split("\n")[int(number) - 1][int(column) - 1 :][0] in radio


def test_a_wall_without_a_thickness_is_refused_with_its_place(tmp_path: Path) -> None:
    """A mesh that is not closed has no inside: its material needs a thickness, or a loss stands in its place."""
    (tmp_path / "wall.obj").write_bytes(SIMPLEX)
    (tmp_path / "solid.obj").write_bytes(SIMPLEX + LAST_FACE)
    things = "scenery:\n  a: {shape: mesh, file: solid.obj, surface: walls, radio: brick}\n"
    for radio, refused in (("brick", True), ("{is: brick}", True), ("{is: brick, thickness: 1 cm}", False),
                           ("{loss: 3 dB}", False), ("none", False), ("null", False)):  # fmt: skip
        text = f"{TEXT}\n{things}  b: {{shape: mesh, file: wall.obj, surface: walls, radio: {radio}}}\n"
        if not refused:
            assert pin_assets(text, "t", tmp_path)[1].keys() == {"wall.obj", "solid.obj"}
            continue
        with pytest.raises(DeploymentError) as refusal:
            pin_assets(text, "t", tmp_path)
        lines = text.split("\n")
        place = f"t:{len(lines) - 1}:{lines[-2].index(radio) + 1}"
        what = "a wall without a thickness: the mesh is not closed, write {is: brick, thickness: 10 cm}, 'brick'"
        assert str(refusal.value) == f"{place}: scenery.b.radio: {what}"


def test_a_mesh_is_closed_when_every_edge_has_two_sides() -> None:
    assert not is_closed(read_mesh("a.obj", SIMPLEX)) and is_closed(read_mesh("a.obj", SIMPLEX + LAST_FACE))
    mesh = read_mesh("a.obj", SIMPLEX + LAST_FACE)
    corners = mesh.vertices[mesh.triangles].reshape(-1, 3)
    apart = "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "".join(
        f"f {n} {n + 1} {n + 2}\n" for n in (1, 4, 7, 10)
    )
    assert is_closed(read_mesh("a.obj", apart.encode())), "each triangle with corners of its own"
    assert len(np.unique(mesh.triangles)) == 4


def test_bodies_and_the_table_are_of_materials() -> None:
    deployment = load_deployment(TEXT, "t")
    scene = build_scene(deployment, build_layout(deployment))
    assert {(shape.radio, shape.name) for shape in scene.scenery} == {(WOOD, "table")}
    by_surface = {
        shape.surface: shape.radio for body in scene.bodies.values() for link in body.links for shape in link.shapes
    }
    assert by_surface == {"ball": PLASTIC, "rods": METAL, "figures": PLASTIC}
