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
PLATE: Final = b"""v -0.01 -0.01 0
v 0.01 -0.01 0
v 0.01 0.01 0
v -0.01 0.01 0
f 1 2 3
f 1 3 4
"""


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
