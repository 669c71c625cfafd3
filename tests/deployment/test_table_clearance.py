"""Scenery that a table's rods, figures or kick-off spot are in is refused; what is beside them, or touches, is not."""

from pathlib import Path
from typing import Final

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.launcher.plan import make_plan
from foosim.launcher.run_options import RunOptions
from foosim.world.clearance.table_clearance import clearance_findings

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
CUBE: Final = "shape: box, length: 10 cm, width: 10 cm, height: 10 cm"
FIGURE: Final = "a figure of blue.goal passes through it: valid is a place outside of x 449.6 to 594.4 mm, "
WRONG: Final = {
    f"{CUBE}, z: 80 mm": "the ball at the kick-off spot passes through it: valid is a place outside of x -17.5 to ",
    f"{CUBE}, x: 522 mm, z: 200 mm": FIGURE,
    f"{CUBE}, x: 522 mm, y: 600 mm, z: 84 mm": "the rod blue.goal passes through it: valid is a place outside of ",
    "shape: cylinder, radius: 1 mm, length: 1 m, x: 1050 mm, z: 84 mm, pitch: 90 deg": FIGURE,
    # Corner ahead: turned by 45 degrees the cube reaches 70.7 mm, not 50 mm.
    f"{CUBE}, x: 660 mm, z: 84 mm, yaw: 45 deg": FIGURE,
}
RIGHT: Final = (
    "shape: cylinder, radius: 2 mm, length: 1 cm, z: 40 mm",  # on the ball, between the figures
    f"{CUBE}, x: 522 mm, z: 206.5 mm",
    # Midway between two lines, on the floor, as docs/reference/deployment.md has it.
    "shape: box, length: 3 cm, width: 3 cm, height: 3 cm, x: 15 cm, z: 15 mm, surface: walls, radio: wood",
    "shape: cylinder, radius: 1 cm, length: 4 cm, x: -15 cm, z: 2 cm, surface: walls, radio: metal",
    f"{CUBE}, x: 660 mm, z: 84 mm",
    f"{CUBE}, x: 666 mm, z: 84 mm, yaw: 45 deg",
    f"{CUBE}, x: 522 mm, y: 723.5 mm, z: 84 mm",  # beyond the end of the stroke
    "shape: cylinder, radius: 1 cm, length: 1 m, x: 445 mm, z: 225 mm, roll: 90 deg",  # in the box around it, not in it
)
PLATE: Final = b"""v -0.01 -0.01 0
v 0.01 -0.01 0
v 0.01 0.01 0
v -0.01 0.01 0
f 1 2 3
f 1 3 4
"""


@pytest.mark.parametrize("thing", WRONG)
def test_scenery_in_which_bodies_are_is_refused_with_its_place(thing: str) -> None:
    with pytest.raises(DeploymentError) as refusal:
        apply_sets(TABLE.read_text(), "t", [f"scenery={{post: {{{thing}}}}}"])
    (problem,) = refusal.value.problems
    assert problem.startswith("--set:1:") and f"scenery.post.x: {WRONG[thing]}" in problem
    assert problem.endswith(" m'"), "where it stands"


def test_what_is_beside_them_is_not() -> None:
    things = ", ".join(f"t{number}: {{{thing}}}" for number, thing in enumerate(RIGHT))
    apply_sets(TABLE.read_text(), "t", [f"scenery={{{things}}}"])


def test_a_mesh_counts_when_its_file_is_there(tmp_path: Path) -> None:
    """Two triangles inside of the ball; and the same beside it."""
    (tmp_path / "plate.obj").write_bytes(PLATE)
    (tmp_path / "table.yaml").write_text(
        apply_sets(
            TABLE.read_text(),
            "t",
            [
                "scenery={inside: {shape: mesh, file: plate.obj, z: 1 cm},"
                " beside: {shape: mesh, file: plate.obj, x: 3 cm, z: 1 cm}}",
                "assets=.",
            ],
        )
    )
    text, files = pin_assets((tmp_path / "table.yaml").read_text(), "t", tmp_path)
    (found,) = clearance_findings(load_deployment(text, "t").with_assets(files))
    assert found.location == ("scenery", "inside", "x") and "kick-off spot" in found.what
    with pytest.raises(
        DeploymentError, match=r"table.yaml:[0-9]+:[0-9]+: scenery\.inside\.x: the ball at the kick-off"
    ):
        make_plan(RunOptions(tmp_path / "table.yaml"))
