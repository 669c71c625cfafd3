"""Scenery from files in a whole run: on any number of nodes, through late comers, into the capture and out of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import open_capture
from foosim.common import limits
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings, System
from foosim.simulation.verify import verify, verify_capture
from foosim.world.matter.mesh import AssetError

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TEXT: Final = TABLE.read_text()
TICKS: Final = 100
WEDGE: Final = b"""# A wedge: a ball that rolls along x goes up.
v -2 -9 0
v 2 -9 0
v 2 9 0
v -2 9 0
v 2 -9 2
v 2 9 2
f 1 4 3 2
f 1 2 5
f 4 6 3
f 2 3 6 5
f 1 5 6 4
"""
SETS: Final = (
    "table.rules.kickoff_delay=2 ms",
    "table.rules.kickoff_speed=3 m/s",
    "players={}",
    "scenery={left: {shape: mesh, file: wedge.obj, scale: 0.007, x: -3.2 cm, yaw: 180 deg, surface: walls}, "
    "right: {shape: mesh, file: wedge.obj, scale: 0.007, x: 3.2 cm, surface: walls, material: {red: 1}}}",
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "wedge.obj").write_bytes(WEDGE)
    return tmp_path


def test_a_world_with_meshes_is_one_world_on_any_number_of_nodes(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A node is killed and comes back: it fetches the files again, in pieces."""
    monkeypatch.setattr(limits, "ASSET_PIECE_BYTES", 64)
    path = folder / "run.mcap"

    def prepare(system: System) -> None:
        system.at_tick(40, lambda: system.kill("n2"))
        system.at_tick(60, lambda: system.start("n2"))

    flat = rehearse(TEXT, "table.yaml", TICKS, 1, SETS[:-1])
    one = rehearse(TEXT, "table.yaml", TICKS, 1, SETS, folder=folder)
    three = rehearse(TEXT, "table.yaml", TICKS, 3, SETS, Settings(), prepare=prepare, capture=path, folder=folder)
    assert one.digests == three.digests and len(one.digests) == TICKS
    assert [lost["what"] for lost in three.json["recoveries"]][:1] == ["node"]
    assert flat.digests[0] == one.digests[0] and flat.digests[-1] != one.digests[-1], "the ball met a wedge"
    capture = open_capture(path)
    heights = capture.frames.column("ball", "position", 3)[:, 2]
    assert np.max(heights) > 0.02 and np.max(heights) < 0.5
    assert capture.about.files == {"wedge.obj": WEDGE} and len(capture.deployment.scenery_shapes()) == 2
    found = verify_capture(path, nodes=2)
    assert found.equal and found.ticks == TICKS
    other = replace(capture.about, files={"wedge.obj": WEDGE + b"\n"})
    with pytest.raises(CaptureError, match=r"wedge\.obj: another file than the digest names"):
        verify(other, capture.captured_ticks())
    assert sum(len(part.indices) // 3 for part in scenery_in(path).triangles) == 2 * 8


def scenery_in(path: Path) -> Any:
    """What a viewer is told of the scenery."""
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        _, _, _, scene = next(reader.iter_decoded_messages(topics=["/scene"]))
    (scenery,) = [entity for entity in scene.entities if entity.id == "scenery"]
    return scenery


def test_a_bad_file_ends_nothing_but_the_start(folder: Path) -> None:
    (folder / "wedge.obj").write_bytes(WEDGE.replace(b"f 4 6 3", b"f 4 6 7"))
    with pytest.raises(AssetError, match=r"^wedge\.obj:10: a face with vertex 7, there are 6$"):
        rehearse(TEXT, "table.yaml", TICKS, 1, SETS, folder=folder)


SOLIDS: Final = {
    "cubes": "shape: box, length: 2 cm, width: 40 cm, height: 6 cm, surface: walls",
    "cylinders": "shape: cylinder, radius: 3 cm, length: 40 cm, roll: 90 deg, surface: walls, radio: metal",
}


@pytest.mark.parametrize("drawn_as", SOLIDS)
def test_boxes_and_cylinders_are_scenery_on_both_engines(folder: Path, drawn_as: str) -> None:
    """A wall, or a tube that lies across, on either side; a viewer is told of both."""
    walls = f"scenery={{left: {{{SOLIDS[drawn_as]}, x: -15 cm}}, right: {{{SOLIDS[drawn_as]}, x: 15 cm}}}}"
    for engine in ("bullet", "pure"):
        path = folder / f"{engine}.mcap"
        rehearse(TEXT, "table.yaml", TICKS, 1, (*SETS[:-1], walls, f"engine={engine}"), capture=path)
        along = open_capture(path).frames.column("ball", "position", 3)[:, 0]
        assert np.max(np.abs(along)) < 0.2 and np.max(np.abs(along)) > 0.1, engine
        table = 5 if drawn_as == "cylinders" else 50
        assert len(getattr(scenery_in(path), drawn_as)) == table + 2
