"""Pictures from above: what is where, in its colour and size, and the higher before the lower."""

from __future__ import annotations

from math import floor, pi, sqrt
from pathlib import Path
from typing import Final

import numpy as np
import pytest
from numpy.typing import NDArray

from foosim.common.errors import BadValue
from foosim.painting.outlines import covered_by_corners, hull_of
from foosim.painting.overhead import BEYOND, OverheadPainter, Picture
from foosim.painting.shapes import Shapes, View, covered_by_surface
from foosim.simulation.simulation import read_for_stepping
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
    Scene,
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


def pixel(painter: OverheadPainter, x: float, y: float) -> tuple[int, int]:
    """Return column and row of the pixel that shows a place (m)."""
    view = painter.view
    return floor((x - view.left) * view.scale), floor((view.top - y) * view.scale)


def colour_at(painter: OverheadPainter, picture: Picture, x: float, y: float) -> tuple[int, ...]:
    column, row = pixel(painter, x, y)
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


@pytest.mark.parametrize("turned", [UPRIGHT, TILTED, from_rpy(0.0, pi / 2, 0.3)])
def test_what_moves_covers_as_much_as_what_stands_still(turned: Quaternion) -> None:
    """The outline of a box, against its faces, at many places within a pixel."""
    shape = Shape(Box((0.053, 0.031, 0.02)), "", (1.0, 0.0, 0.0, 1.0))
    for step in range(1, 40):
        at = (step * 0.000317, step * 0.000713, 0.0)
        faces = covered_by_surface(shape, ("", at, turned), VIEW)
        assert faces is not None and faces.places.tolist() == covered(shape.geometry, at, turned).tolist()


def test_what_is_outside_of_the_picture_is_left_out() -> None:
    whole = covered(Box((0.5, 0.3, 0.1)))
    assert len(covered(Box((0.5, 0.3, 0.1)), (2.0, 2.0, 0.0))) == pytest.approx(len(whole) / 4, rel=0.05)
    assert len(covered(Sphere(0.4), (9.0, 0.0, 0.0))) == len(covered(Box((0.4, 0.4, 0.4)), (0.0, -1e9, 0.0))) == 0
    assert len(covered_by_corners(np.array([(500.0, 0.0), (600.0, 0.0), (550.0, 50.0)]), 400, 400)) == 0


def test_a_picture_of_a_place_much_smaller_than_a_shape() -> None:
    """A micrometre of a table: what would be covered beyond the picture is not computed."""
    view = View(40, 30, 4e7, 0.0, 0.0)
    assert len(covered(Box((0.6, 0.3, 0.1)), turned=TILTED, view=view)) == 40 * 30
    assert len(covered(Cylinder(0.5, 1.0), turned=TILTED, view=view)) == 40 * 30


def test_of_many_shapes_the_highest_is_seen() -> None:
    count = 70_000
    shapes = [(0, Shape(Sphere(0.001), "", (1.0, 0.0, 0.0, 1.0), (0.0, 0.0, -one / count))) for one in range(count)]
    shapes[7] = (0, Shape(Sphere(0.001), "", (0.0, 1.0, 0.0, 1.0), (0.0, 0.0, 1.0)))
    found = Shapes(shapes).covered([("", ORIGIN, UPRIGHT)], View(2, 2, 2000.0, -0.0005, 0.0005))
    assert found.colours[-1].tolist() == [0, 255, 0]


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


VALLEY: Final = Mesh(
    np.array([(x, y, abs(x)) for x in (-1.0, 0.0, 1.0) for y in (-1.0, 1.0)]),
    np.array([(0, 2, 3), (0, 3, 1), (2, 4, 5), (2, 5, 3)], np.int32),
    b"valley",
)


@pytest.mark.parametrize(
    "slope",
    [
        Shape(VALLEY, "", (0.0, 0.0, 1.0, 1.0)),
        Shape(Box((1.0, 1.0, 0.01)), "", (0.0, 0.0, 1.0, 1.0), ORIGIN, from_rpy(0.0, -pi / 4, 0.0)),
    ],
    ids=["a mesh", "a box"],
)
def test_on_a_slope_counts_how_high_it_is_there(slope: Shape) -> None:
    """The ball is lower than the highest place of the slope, and within its hull."""
    deployment = read_for_stepping(DEPLOY / "table.yaml")
    frame = initial_frame(deployment)
    bodies = {"ball": build_scene(deployment, frame.layout).bodies["ball"]}
    painter = OverheadPainter(Scene(bodies, (slope,)), frame.layout, (200, 200), (-1.0, -1.0, 1.0, 1.0))
    for x, z, is_seen in ((0.0, 0.04, True), (0.5, 0.55, True), (0.5, 0.3, False)):
        picture = painter.paint(moved(frame, "ball", "position", x, 0.0, z))
        assert (colour_at(painter, picture, x, 0.0) == ORANGE) == is_seen
        assert colour_at(painter, picture, 0.25, 0.5) == (0, 0, 255)


def test_faces_at_one_level_are_those_of_the_later_shape() -> None:
    """At height 0, where sums of products that are not exact differ most."""
    deployment = read_for_stepping(DEPLOY / "table.yaml")
    layout = initial_frame(deployment).layout
    shapes = [
        Shape(Box((0.7, height, 0.6)), "", colour, (0.013, 0.007, -height), from_rpy(pi / 2, 0.0, yaw))
        for height, yaw, colour in ((0.1, 0.3, (1.0, 0.0, 0.0, 1.0)), (0.17, 1.1, (0.0, 1.0, 0.0, 1.0)))
    ]
    painter = OverheadPainter(Scene({}, tuple(shapes)), layout, (50, 50), (-0.3, -0.3, 0.3, 0.3))
    assert (painter.paint(initial_frame(deployment)) == (0, 255, 0)).all()


def test_a_figure_swings_out_to_the_side() -> None:
    painter, frame = painter_of("table.yaml", (960, 540))
    swung = painter.paint(moved(frame, "red.goal", "joint_positions", 0.05, pi / 2))
    red = (204, 26, 26)
    columns = np.flatnonzero((swung == red).all(axis=2)[pixel(painter, 0.0, 0.05)[1]])
    left, right = pixel(painter, -0.522 - 0.072, 0.0)[0], pixel(painter, -0.522 + 0.072, 0.0)[0]
    assert columns.min() in range(left, left + 3) or columns.max() in range(right - 3, right + 2)


@pytest.mark.parametrize("name", ["table.yaml", "warehouse.yaml", "yard.yaml", "workshop.yaml"])
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
    assert pixel(painter, -0.1, 0.1) == (25, 0) and pixel(painter, 0.0999, -0.0999) == (74, 49)


@pytest.mark.parametrize(
    ("pixels", "region", "told"),
    [
        ((0, 50), None, "pixels: width and height from 1 to 8192 are needed, '0 x 50'"),
        ((99, 50), (0.1, 0.0, 0.1, 1.0), "region: the least x and y, then greater ones are needed, '(0.1, 0.0, 0.1"),
        ((99, 50), (0.0, 0.0, 1.0, float("nan")), "region: the least x and y, then greater ones are needed"),
    ],
)
def test_what_is_no_picture_is_refused(
    pixels: tuple[int, int], region: tuple[float, float, float, float] | None, told: str
) -> None:
    deployment = read_for_stepping(DEPLOY / "table.yaml")
    frame = initial_frame(deployment)
    with pytest.raises(BadValue) as raised:
        OverheadPainter(build_scene(deployment, frame.layout), frame.layout, pixels, region)
    assert str(raised.value).startswith(told)
