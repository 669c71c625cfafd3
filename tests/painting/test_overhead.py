"""Pictures from above: what is where, in its colour and size, and the higher before the lower."""

from __future__ import annotations

from math import pi, sqrt
from pathlib import Path
from typing import Final

import numpy as np
import pytest
from numpy.typing import NDArray

from foosim.painting.outlines import covered_by_corners, hull_of
from foosim.painting.overhead import BEYOND, OverheadPainter, Picture
from foosim.painting.shapes import Shapes, View
from foosim.rehearsal.simulation import read_for_stepping
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.assembly.world import build_scene
from foosim.world.frame import Frame
from foosim.world.matter.mesh import Mesh
from foosim.world.scene import (
    ORIGIN,
    UPRIGHT,
    Box,
    Capsule,
    Cylinder,
    Geometry,
    Hull,
    Quaternion,
    Shape,
    Sphere,
    Vector,
    from_rpy,
)

DEPLOY: Final = Path(__file__).parents[2] / "deploy"
ORANGE: Final = (255, 128, 0)
VIEW: Final = View(400, 400, 100.0, -2.0, 2.0)
"""Four metres of the world, 100 pixels to the metre."""


def covered(
    geometry: Geometry, at: Vector = ORIGIN, turned: Quaternion = UPRIGHT, view: View = VIEW
) -> NDArray[np.intp]:
    """Return the pixels that a shape covers whose link is at this pose."""
    found = Shapes([(0, Shape(geometry, "", (1.0, 0.0, 0.0, 1.0)))]).covered([("", at, turned)], view)
    assert (found.colours == (255, 0, 0)).all()
    return np.unique(found.places)


def painter_of(name: str, pixels: tuple[int, int] = (320, 180)) -> tuple[OverheadPainter, Frame]:
    deployment = read_for_stepping(DEPLOY / name)
    frame = initial_frame(deployment)
    return OverheadPainter(build_scene(deployment, frame.layout), frame.layout, pixels), frame


def moved(frame: Frame, entity: str, field: str, *values: float) -> Frame:
    numbers = frame.numbers.copy()
    at = frame.layout[entity].offsets[field]
    numbers[at : at + len(values)] = values
    return Frame(frame.tick, frame.layout, None, numbers=numbers)


def colour_at(painter: OverheadPainter, picture: Picture, x: float, y: float) -> tuple[int, ...]:
    column, row = painter.pixel(x, y)
    return tuple(picture[row, column].tolist())


TILTED: Final = from_rpy(0.7, 0.4, 0.3)
CUBE: Final = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
FACES: Final = np.array([(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5)], np.int32)


@pytest.mark.parametrize(
    ("geometry", "turned", "area"),
    [
        (Box((0.5, 0.3, 0.1)), UPRIGHT, 0.6),
        (Box((0.5, 0.3, 0.1)), from_rpy(0.0, 0.0, 0.6), 0.6),
        (Box((0.5, 0.3, 0.1)), from_rpy(pi / 2, 0.0, 0.0), 0.2),
        (Sphere(0.4), TILTED, pi * 0.16),
        (Cylinder(0.4, 1.0), UPRIGHT, pi * 0.16),
        (Cylinder(0.4, 1.0), from_rpy(pi / 2, 0.0, 0.4), 0.8),
        (Cylinder(0.4, 1.0), from_rpy(pi / 4, 0.0, 0.0), pi * 0.16 * sqrt(0.5) + 0.8 * sqrt(0.5)),
        (Capsule(0.3, 1.0), UPRIGHT, pi * 0.09),
        (Capsule(0.3, 1.0), from_rpy(0.0, pi / 2, 0.2), pi * 0.09 + 0.6),
        (Hull(Mesh(CUBE, FACES, b"cube")), from_rpy(0.0, 0.0, 0.5), 1.0),
        (Mesh(CUBE, FACES, b"cube"), UPRIGHT, 1.0),
    ],
)
def test_a_shape_covers_as_much_as_its_outline(geometry: Geometry, turned: Quaternion, area: float) -> None:
    """The area in pixels is right to the edge: half a pixel to either side of it."""
    assert len(covered(geometry, turned=turned)) / 100**2 == pytest.approx(area, abs=0.02)


def test_a_tilted_box_covers_what_its_corners_do() -> None:
    """The three pairs of parallel lines, against the convex hull of the corners."""
    half = (0.5, 0.3, 0.2)
    corners = CUBE * 2 * half
    found = covered(Box(half), turned=TILTED)
    assert found.tolist() == sorted(covered(Hull(Mesh(corners, FACES, b"box")), turned=TILTED).tolist())
    assert len(found) > 5000


def test_what_is_outside_of_the_picture_is_left_out() -> None:
    whole = covered(Box((0.5, 0.3, 0.1)))
    assert len(covered(Box((0.5, 0.3, 0.1)), (2.0, 2.0, 0.0))) == pytest.approx(len(whole) / 4, rel=0.05)
    assert len(covered(Sphere(0.4), (9.0, 0.0, 0.0))) == 0
    assert len(covered_by_corners(np.array([(500.0, 0.0), (600.0, 0.0), (550.0, 50.0)]), 400, 400)) == 0


def test_corners_in_a_line_have_no_inside() -> None:
    assert hull_of([(0.0, 0.0), (1.0, 1.0), (0.0, 0.0)]) == [(0.0, 0.0), (1.0, 1.0)]
    assert len(covered_by_corners(np.array([(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)]), 9, 9)) == 0


def test_the_table_looks_like_a_table() -> None:
    painter, frame = painter_of("table.yaml")
    picture = painter.paint(frame)
    assert picture.shape == (180, 320, 3) and picture.dtype == np.uint8
    assert colour_at(painter, picture, 0.0, 0.0) == ORANGE, "the ball"
    assert colour_at(painter, picture, 0.02, 0.03) == (41, 115, 61), "the field"
    assert colour_at(painter, picture, 0.3, 0.36) == (115, 76, 46), "a wall"
    assert colour_at(painter, picture, -0.522, 0.1) == (191, 191, 199), "a rod"
    assert colour_at(painter, picture, -0.522, 0.0) == (204, 26, 26), "red's keeper"
    assert colour_at(painter, picture, 0.522, 0.0) == (26, 51, 204), "blue's keeper"
    assert tuple(picture[0, 0].tolist()) == BEYOND


def test_what_moves_is_painted_where_it_is_and_what_is_higher_hides_it() -> None:
    painter, frame = painter_of("table.yaml")
    at = moved(frame, "ball", "position", 0.3, -0.2, 0.0175)
    picture = painter.paint(at)
    assert colour_at(painter, picture, 0.3, -0.2) == ORANGE and colour_at(painter, picture, 0.0, 0.0) != ORANGE
    under = painter.paint(moved(frame, "ball", "position", -0.522, 0.12, 0.0175))
    assert colour_at(painter, under, -0.522, 0.12) == (191, 191, 199), "the rod is above the ball"
    over = painter.paint(moved(frame, "ball", "position", -0.522, 0.12, 0.5))
    assert colour_at(painter, over, -0.522, 0.12) == ORANGE
    within = painter.paint(moved(frame, "ball", "position", 0.3, 0.36, 0.02))
    assert colour_at(painter, within, 0.3, 0.36) == (115, 76, 46), "scenery hides it, too"


def test_a_figure_swings_out_to_the_side() -> None:
    painter, frame = painter_of("table.yaml", (960, 540))
    swung = painter.paint(moved(frame, "red.goal", "joint_positions", 0.05, pi / 2))
    red = (204, 26, 26)
    columns = np.flatnonzero((swung == red).all(axis=2)[painter.pixel(0.0, 0.05)[1]])
    left, right = painter.pixel(-0.522 - 0.072, 0.0)[0], painter.pixel(-0.522 + 0.072, 0.0)[0]
    assert columns.min() in range(left, left + 3) or columns.max() in range(right - 3, right + 2)


@pytest.mark.parametrize("name", ["table.yaml", "warehouse.yaml", "yard.yaml"])
def test_equal_frames_give_equal_pictures(name: str) -> None:
    painter, frame = painter_of(name)
    first = painter.paint(frame).tobytes()
    if name == "table.yaml":
        painter.paint(moved(frame, "ball", "position", 0.3, -0.2, 0.0175))
    assert painter.paint(frame).tobytes() == first == painter_of(name)[0].paint(frame).tobytes()
    assert len(np.unique(np.frombuffer(first, np.uint8).reshape(-1, 3), axis=0)) >= 4, "ground, walls, robots, beyond"


def test_a_region_is_shown_whole() -> None:
    deployment = read_for_stepping(DEPLOY / "table.yaml")
    frame = initial_frame(deployment)
    scene = build_scene(deployment, frame.layout)
    painter = OverheadPainter(scene, frame.layout, (100, 50), (-0.1, -0.1, 0.1, 0.1))
    assert painter.pixel(-0.1, 0.1) == (25, 0) and painter.pixel(0.0999, -0.0999) == (74, 49)
