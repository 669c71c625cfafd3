"""Pictures: depth of the ray caster, things of Bullet's renderer, places of pinholes, bits that nothing changes."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from hashlib import blake2b
from itertools import product
from math import cos, pi, sin, tan
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from bench.rendering import TinyRenderer, poses_of
from foosim.common.errors import Malformed
from foosim.deployment.loader import load_deployment
from foosim.kernels import raster
from foosim.rendering.drawer import Drawer, Drawn
from foosim.rendering.model import Model
from foosim.world.assembly.world import build_scene, initial_numbers
from foosim.world.bodies.hull import convex_hull
from foosim.world.components.optics import Optics, moving_links
from foosim.world.layout import Declared, Layout, build_layout
from foosim.world.matter.mesh import Mesh
from foosim.world.rays.caster import Caster
from foosim.world.scene import (
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
    drawn,
    enclosing,
    from_rpy,
    looks_of,
    rotate,
    shape_box,
)
from foosim.world.scene import place as placed

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
NOTHING: Final = Layout({}, Declared())
OPTICS: Final = Optics(160, 120, 1.2, 0.05, 20.0)
DOWN: Final = from_rpy(0.0, pi / 2, pi / 2)
NO_LINKS: Final = np.zeros(0, np.intp), np.zeros((0, 7))
RING_OF_HULL: Final = np.array(
    [[cos(a) * r, sin(a) * r, z] for z, r in ((-0.2, 0.15), (0.0, 0.25), (0.15, 0.1)) for a in np.arange(9) * 0.7]
)


def shape(
    geometry: Geometry, position: Vector = (0.0, 0.0, 0.0), name: str = "thing", turned: Quaternion = UPRIGHT
) -> Shape:
    return Shape(geometry, "walls", (0.8, 0.4, 0.2, 1.0), position, turned, name=name)


def open_mesh() -> Mesh:
    vertices = np.array([[-0.3, -0.3, 0.0], [0.3, -0.3, 0.05], [0.3, 0.3, 0.0], [-0.3, 0.3, 0.1]])
    return Mesh(vertices, np.array([[0, 2, 1], [0, 3, 2]], np.int32), b"sheet")


def all_kinds() -> Scene:
    kinds: tuple[Geometry, ...] = (
        *(Box((0.2, 0.15, 0.1)), Sphere(0.17), Cylinder(0.12, 0.4), Capsule(0.1, 0.3)),
        *(Hull(convex_hull(RING_OF_HULL)), open_mesh()),
    )
    places = [(1.6 + 0.4 * (i % 2), 0.7 - 0.28 * i, 0.25 - 0.1 * (i % 3)) for i in range(len(kinds))]
    things = [
        shape(kind, at, str(i), from_rpy(0.3 * i, 0.5, 0.2 * i))
        for i, (kind, at) in enumerate(zip(kinds, places, strict=True))
    ]
    return Scene({}, (*things, shape(Box((3.0, 3.0, 0.05)), (2.0, 0.0, -0.5), "floor")))


def look(
    scene: Scene, optics: Optics = OPTICS, position: Vector = (0.0, 0.0, 0.0), turned: Quaternion = UPRIGHT
) -> Drawn:
    return Drawer(scene, NOTHING).draw(optics, position, turned, *NO_LINKS)


def centres(optics: Optics) -> tuple[Any, Any]:
    """Places of the centres of pixels, per focal length, to the right and down."""
    focal = optics.width / 2 / tan(optics.fov / 2)
    v, u = np.mgrid[: optics.height, : optics.width] + 0.5
    return (u - optics.width / 2) / focal, (v - optics.height / 2) / focal


def inner(segmentation: Any) -> Any:
    """Which pixels have all eight neighbours of the same thing."""
    found = np.zeros(segmentation.shape, bool)
    middle = segmentation[1:-1, 1:-1]
    rows, columns = segmentation.shape
    found[1:-1, 1:-1] = np.all(
        [segmentation[i : rows - 2 + i, j : columns - 2 + j] == middle for i in range(3) for j in range(3)], axis=0
    )
    return found


class Table:
    """The table with its moving links at random places, drawn by one camera."""

    def __init__(self) -> None:
        deployment = load_deployment(TABLE.read_text(), TABLE.name)
        self.layout = build_layout(deployment)
        self.scene = build_scene(deployment, self.layout)
        self.links = moving_links(self.scene.bodies)
        self.poses = poses_of(self.scene, self.layout, initial_numbers(deployment, self.layout))

    def moved(self, frame: int) -> Any:
        rng = np.random.default_rng(frame)
        poses = self.poses.copy()
        poses[:, :3] += rng.uniform(-0.05, 0.05, (len(poses), 3))
        return poses

    def draw(self, drawer: Drawer, frame: int, optics: Optics = OPTICS) -> Drawn:
        place = ((0.0, 0.3, 1.0), DOWN) if frame % 3 else ((0.9, 0.1 * frame, 0.7), from_rpy(0.0, 0.6, pi))
        return drawer.draw(optics, *place, np.arange(len(self.poses)), self.moved(frame), key=frame)


def digest(pictures: list[Drawn]) -> str:
    return blake2b(b"".join(part.tobytes() for drawn in pictures for part in drawn)).hexdigest()


RICH: Final = Optics(96, 72, 1.2, 0.05, 20.0, 2, True, 0.0, (-0.2, 0.05, 0.001, 0.002, 0.0), 3.0, 1.1)
FRAMES: Final = range(7)


def pictures_of_table(order: Any) -> str:
    """The digest of the table's pictures, drawn in this order by one drawer."""
    table = Table()
    drawer = Drawer(table.scene, table.layout)
    drawn = {frame: table.draw(drawer, frame, optics) for frame in order for optics in (RICH,)}
    return digest([drawn[frame] for frame in FRAMES])


def test_bits_do_not_depend_on_order_memory_process_or_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    table = Table()
    fresh = digest([table.draw(Drawer(table.scene, table.layout), frame, RICH) for frame in FRAMES])
    assert pictures_of_table([3, 1, 6, 0, 2, 2, 5, 4, 1]) == fresh
    path = f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})"
    code = f"{path}; import test_pictures as t; print(t.pictures_of_table(t.FRAMES))"
    there = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=TABLE.parents[1]
    )
    assert there.stdout.strip() == fresh
    monkeypatch.setattr(raster, "C", None)
    assert pictures_of_table(FRAMES) == fresh


def test_what_moves_looks_as_if_it_stood_there() -> None:
    table = Table()
    body = table.scene.bodies["red.goal"]
    link = next(link for link in body.links if any(isinstance(one.geometry, Box) for one in link.shapes))
    place = (0.1, -0.05, 0.2)
    drawer = Drawer(Scene({"red.goal": body}, ()), table.layout)
    number = [index for _, index in moving_links({"red.goal": body})].index(body.links.index(link))
    for turned in (from_rpy(0.3, 1.0, 0.4), from_rpy(0.3, -0.9, 2.4)):
        there = []
        for one in looks_of([link])[0][1]:
            position, orientation = placed(one, place, turned)
            there.append(replace(one, position=position, orientation=orientation, name="rod"))
        eye = (0.1, -0.05, 0.4)
        standing = look(Scene({}, tuple(there)), position=eye, turned=DOWN)
        poses = np.array([[*place, *turned]])
        moved = drawer.draw(OPTICS, eye, DOWN, np.array([number]), poses)
        assert (moved.depth > 0).sum() > 100
        assert (np.abs(moved.depth - standing.depth) < 1e-5).mean() > 0.999
        assert (np.abs(moved.colour.astype(int) - standing.colour).max(axis=2) <= 1).mean() > 0.999


def test_depth_is_that_of_rays() -> None:
    scene = all_kinds()
    drawn = look(scene)
    across, down = centres(OPTICS)
    ways = np.stack([np.ones_like(across), -across, -down], axis=-1).reshape(-1, 3)
    lengths = np.sqrt((ways**2).sum(axis=1))
    hits = Caster(scene, NOTHING).at([]).cast(np.zeros_like(ways), ways / lengths[:, None], 30.0)
    distances, things = np.asarray(hits[0]), np.asarray(hits[1])
    seen = np.where(np.isfinite(distances), things + 1, 0).reshape(drawn.segmentation.shape)
    off = inner(seen) & (seen > 0) & (drawn.depth < OPTICS.far)
    assert off.sum() > 5000 and len(np.unique(seen[off])) == 7
    assert (drawn.segmentation == seen)[off].all()
    assert np.abs(drawn.depth - (distances / lengths).reshape(off.shape))[off].max() < 1e-3


def test_things_are_those_of_bullet_s_renderer() -> None:
    table = Table()
    for scene, layout, poses, place in (
        (all_kinds(), NOTHING, NO_LINKS[1], ((0.0, 0.0, 0.0), UPRIGHT)),
        (table.scene, table.layout, table.moved(1), ((0.0, 0.0, 1.0), DOWN)),
    ):
        tiny = TinyRenderer(scene, layout)
        tiny.place(poses)
        _, there = tiny.draw(OPTICS, *place)
        tiny.close()
        here = Drawer(scene, layout).draw(OPTICS, *place, np.arange(len(poses)), poses).segmentation
        off = inner(here) & inner(there)
        assert off.mean() > 0.5
        assert (here == there)[off].mean() > 0.98


@pytest.mark.parametrize("samples", [1, 2, 3])
def test_corners_of_a_cube_are_where_a_pinhole_has_them(samples: int) -> None:
    optics = Optics(200, 150, 1.0, 0.05, 20.0, samples)
    focal = optics.width / 2 / tan(optics.fov / 2)
    for at in ((2.0, 0.3, -0.2), (1.5, -0.4, 0.3), (3.0, 0.0, 0.0)):
        drawn = look(Scene({}, (shape(Box((0.1, 0.1, 0.1)), at),)), optics)
        rows, columns = np.nonzero(drawn.segmentation)
        x, y, z = np.array(at)[:, None] + 0.1 * np.array(list(product((-1, 1), repeat=3))).T
        u, v = optics.width / 2 - focal * y / x, optics.height / 2 - focal * z / x
        found = (columns.min(), columns.max() + 1, rows.min(), rows.max() + 1)
        wanted = (u.min(), u.max(), v.min(), v.max())
        assert np.abs(np.subtract(found, wanted)).max() <= 0.5 + 0.25 * (samples > 1)
        assert drawn.depth[rows, columns].min() == pytest.approx(at[0] - 0.1, abs=1e-5)


def test_distortion_is_brown_s() -> None:
    """Small balls are where the closed form puts what a pinhole sees, also those that it brings into view."""
    k1, k2, p1, p2, k3 = -0.25, 0.06, 0.004, -0.003, -0.002
    optics = Optics(320, 240, 1.2, 0.05, 20.0, distortion=(k1, k2, p1, p2, k3))
    focal = optics.width / 2 / tan(optics.fov / 2)
    places = [(x, y) for x in (-0.7, -0.4, 0.0, 0.4, 0.7) for y in (-0.45, 0.0, 0.45)]
    balls = [shape(Sphere(0.04), (2.0, -2.0 * x, -2.0 * y), str(i)) for i, (x, y) in enumerate(places)]
    drawn = look(Scene({}, tuple(balls)), optics)
    outside = 0
    for number, (x, y) in enumerate(places, 1):
        r = x * x + y * y
        radial = 1 + k1 * r + k2 * r**2 + k3 * r**3
        u = optics.width / 2 + focal * (x * radial + 2 * p1 * x * y + p2 * (r + 2 * x * x))
        v = optics.height / 2 + focal * (y * radial + p1 * (r + 2 * y * y) + 2 * p2 * x * y)
        outside += abs(x) * focal > optics.width / 2 + 3
        rows, columns = np.nonzero(drawn.segmentation == number)
        assert (columns.mean() + 0.5, rows.mean() + 0.5) == pytest.approx((u, v), abs=0.7)
        assert np.abs(drawn.depth[rows, columns] - 2.0).max() < 0.05
    assert outside == 6


def test_an_exposure_smears_what_moves_by_its_way() -> None:
    table = Table()
    ball = table.links.index(("ball", 0))
    still, blurred = Optics(400, 120, 0.5, 0.05, 5.0), Optics(400, 120, 0.5, 0.05, 5.0, exposure=0.02)
    drawer = Drawer(Scene({"ball": table.scene.bodies["ball"]}, ()), table.layout)
    assert ball == 0
    poses, speeds = np.array([[0.0, 0.0, 0.0, *UPRIGHT]]), np.array([[3.0, 0.0, 0.0, 0.0, 0.0, 50.0]])
    turned = from_rpy(0.0, pi / 2, -pi / 2)
    drawn = [drawer.draw(o, (0.0, 0.0, 1.0), turned, np.array([0]), poses, speeds) for o in (still, blurred)]
    assert drawn[0].depth.tobytes() == drawn[1].depth.tobytes()
    focal = 200 / tan(0.25)
    ways = [np.nonzero(np.abs(d.colour.astype(int) - d.colour[0, 0]).sum(axis=(0, 2)))[0] for d in drawn]
    longer = np.ptp(ways[1]) - np.ptp(ways[0])
    assert longer == pytest.approx(3.0 * 0.02 * 8 / 9 * focal, abs=2.0)
    assert np.abs(ways[1].mean() - ways[0].mean()) == pytest.approx(longer / 2, abs=1.5)
    assert (ways[1].max() > ways[0].max()) == (rotate(turned, (0.0, 1.0, 0.0))[0] > 0.0)  # it comes from behind
    light = [(d.colour.astype(float) - d.colour[0, 0]).sum() for d in drawn]
    assert light[1] == pytest.approx(light[0], rel=0.06)


def test_a_shadow_lies_where_the_sun_s_rays_end() -> None:
    from foosim.rendering.model import SUN

    scene = Scene(
        {}, (shape(Box((1.5, 1.5, 0.05)), (0.0, 0.0, -0.05), "floor"), shape(Box((0.15, 0.15, 0.01)), (0.0, 0.0, 0.6)))
    )
    for scale in (1.0, 20.0):
        floor = shape(Box((1.5 * scale, 1.5 * scale, 0.05)), (0.0, 0.0, -0.05), "floor")
        scene = Scene({}, (floor, scene.scenery[1]))
        bright, dark = (
            look(scene, Optics(160, 120, 1.2, 0.05, 20.0, shadows=is_on), (0.0, 0.0, 2.0), DOWN)
            for is_on in (False, True)
        )
        rows, columns = np.nonzero(bright.colour.astype(int).sum(axis=2) - dark.colour.astype(int).sum(axis=2) > 60)
        focal = 80 / tan(0.6)
        x, y = -SUN[0] / SUN[2] * 0.6, -SUN[1] / SUN[2] * 0.6
        # The camera's top is towards +y... its left is -x.
        seen = np.array([80 + focal * x / 2.0, 60 - focal * y / 2.0])
        assert len(rows) == pytest.approx((0.3 * focal / 2.0) ** 2, rel=0.5)
        assert (columns.mean() + 0.5, rows.mean() + 0.5) == pytest.approx(tuple(seen), abs=6.0)


def test_noise_has_its_deviation_and_its_key_and_gain_its_factor() -> None:
    scene = Scene({}, (shape(Box((0.1, 5.0, 5.0)), (2.0, 0.0, 0.0)),))
    plain = look(scene).colour.astype(int)
    drawer = Drawer(scene, NOTHING)
    noisy = [
        drawer.draw(Optics(160, 120, 1.2, 0.05, 20.0, noise=8.0), (0.0, 0.0, 0.0), UPRIGHT, *NO_LINKS, key=key).colour
        for key in (5, 6, 5, 1 << 200)
    ]
    rest = noisy[0].astype(int) - plain
    assert abs(rest.mean()) < 0.1 and rest.std() == pytest.approx(8.0, rel=0.02)
    assert (noisy[0] == noisy[2]).all()
    for other in (noisy[1], noisy[3]):
        between = other.astype(int) - plain
        assert abs(np.corrcoef(rest.reshape(-1), between.reshape(-1))[0, 1]) < 0.02
    gained = look(scene, Optics(160, 120, 1.2, 0.05, 20.0, gain=0.5)).colour
    assert np.abs(gained - plain * 0.5).max() <= 0.5


def test_a_camera_inside_of_a_body_sees_out() -> None:
    around = shape(Sphere(0.3), (0.0, 0.0, 0.0), "housing")
    wall = shape(Box((0.1, 5.0, 5.0)), (2.0, 0.0, 0.0), "wall")
    drawn = look(Scene({}, (around, wall)))
    assert (drawn.segmentation == 2).all()
    assert np.abs(drawn.depth - 1.9).max() < 1e-5


def test_a_sheet_is_seen_from_both_sides_and_lit_from_one() -> None:
    scene = Scene({}, (shape(open_mesh()),))
    above = look(scene, position=(0.0, 0.0, 1.0), turned=DOWN)
    below = look(scene, position=(0.0, 0.0, -1.0), turned=from_rpy(0.0, -pi / 2, pi / 2))
    lit = [np.median(d.colour[d.segmentation == 1][:, 0]) for d in (above, below)]
    assert lit[0] > 1.5 * lit[1] > 0
    assert (above.segmentation == 1).sum() == pytest.approx((below.segmentation == 1).sum(), rel=0.2)


def test_what_is_no_pose_is_refused() -> None:
    table = Table()
    drawer, numbers = Drawer(table.scene, table.layout), np.arange(len(table.poses))
    for place, value in ((0, np.nan), (1, 1e30), (3, np.inf), (6, 3.0)):
        poses = table.poses.copy()
        poses[2, place] = value
        with pytest.raises(Malformed):
            drawer.draw(OPTICS, (0.0, 0.0, 1.0), DOWN, numbers, poses)
        with pytest.raises(Malformed):
            drawer.draw(OPTICS, tuple(poses[2, :3]), tuple(poses[2, 3:]), numbers, table.poses)
    with pytest.raises(Malformed):
        drawer.draw(OPTICS, (0.0, 0.0, 1.0), DOWN, numbers, table.poses, np.full((len(numbers), 6), np.nan))


@pytest.mark.parametrize("seed", range(4))
def test_any_lens_gives_a_picture(seed: int) -> None:
    """Where a lens has no inverse nothing is seen."""
    rng = np.random.default_rng(seed)
    k1, k2, p1, p2, k3 = rng.uniform(-10.0, 10.0, 5).tolist()
    optics = Optics(64, 48, float(rng.uniform(0.02, 2.96)), 0.001, 1e4, distortion=(k1, k2, p1, p2, k3))
    drawn = look(Scene({}, (shape(Box((0.1, 900.0, 900.0)), (2.0, 0.0, 0.0)),)), optics)
    seen = drawn.segmentation == 1
    assert np.abs(drawn.depth[seen] - 1.9).max(initial=0.0) < 1e-3
    assert (drawn.depth[~seen] == 0.0).all()


def test_nearer_than_near_and_farther_than_far_nothing_is_seen() -> None:
    scene = all_kinds()
    whole = look(scene)
    cut = look(scene, Optics(160, 120, 1.2, 1.7, 2.0))
    within = (whole.depth > 1.7) & (whole.depth < 2.0)
    assert within.any()
    assert np.abs(cut.depth - whole.depth)[within].max() < 1e-4
    assert ((cut.depth == 0.0) | ((cut.depth >= 1.7 - 1e-6) & (cut.depth <= 2.0 + 1e-6))).all()
    assert (look(scene, position=(0.0, 0.0, 50.0)).segmentation == 0).all()


def test_samples_are_the_mean_of_a_finer_picture() -> None:
    fine, coarse = (
        look(all_kinds(), Optics(320, 240, 1.2, 0.05, 20.0)).colour,
        look(all_kinds(), Optics(160, 120, 1.2, 0.05, 20.0, 2)).colour,
    )
    mean = fine.reshape(120, 2, 160, 2, 3).astype(float).mean(axis=(1, 3))
    assert np.abs(coarse - mean).max() <= 0.5


def test_round_things_are_shaded_smoothly() -> None:
    """Neighbouring pixels of a ball differ little; its side to the sun is brighter."""
    drawn = look(Scene({}, (shape(Sphere(0.5), (2.0, 0.0, 0.0)),)), Optics(200, 200, 0.6, 0.05, 20.0))
    red = drawn.colour[:, :, 0].astype(int)
    off = inner(drawn.segmentation)
    assert np.abs(np.diff(red, axis=1))[off[:, 1:] & off[:, :-1]].max() <= 6
    rows, _ = np.nonzero(off)
    assert red[rows.min()].max() > red[rows.max()].max() + 30


def test_rays_of_columns_are_those_of_axes() -> None:
    """A camera looks along x, with y to its left and z up, whatever its pose."""
    turned = from_rpy(0.2, 0.4, 2.0)
    at = (3.0, -2.0, 1.0)
    for way, (column, row) in (((2.0, 0.5, 0.0), (0, 0)), ((2.0, 0.0, 0.5), (0, 1))):
        x, y, z = rotate(turned, way)
        drawn = look(Scene({}, (shape(Sphere(0.05), (at[0] + x, at[1] + y, at[2] + z)),)), OPTICS, at, turned)
        rows, columns = np.nonzero(drawn.segmentation)
        focal = 80 / tan(0.6)
        wanted = (80 - focal * way[1] / 2, 60 - focal * way[2] / 2)
        assert (columns.mean() + 0.5, rows.mean() + 0.5) == pytest.approx(wanted, abs=0.5), (column, row)


def test_a_table_looks_like_a_cabinet_from_all_sides() -> None:
    """No floor, ramp or goal is visible from outside, and a picture of it stays quick."""
    table = Table()
    shapes = list(drawn(table.scene.scenery))
    low, high = enclosing([shape_box(one) for one in shapes if one.surface == "walls"])
    inner_low, inner_high = enclosing([shape_box(one) for one in shapes if one.surface != "walls"])
    assert all(low[axis] < inner_low[axis] and inner_high[axis] < high[axis] for axis in (0, 1))
    assert low[2] <= inner_low[2] and inner_high[2] <= high[2]
    assert 5_000 < len(Model(table.scene, table.layout).triangles) < 9_000
