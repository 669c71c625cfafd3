"""The ray caster: first hits are those of Bullet, clearances those of surfaces, and company changes nothing."""

from __future__ import annotations

from math import cos, inf, pi, sin, sqrt
from typing import Any, Final

import numpy as np
import pybullet as p
import pytest
from numpy.typing import NDArray

from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Declared, Layout
from foosim.world.matter.mesh import Mesh
from foosim.world.mesh_files import read_mesh
from foosim.world.rays.caster import Caster, Placement
from foosim.world.rays.kernels import box_spans, capsule_spans, cylinder_spans, sphere_spans
from foosim.world.rays.sorted_boxes import FEW, SortedBoxes
from foosim.world.rays.spans import box_span, capsule_span, cylinder_span, sphere_span
from foosim.world.rays.triangles import Triangles
from foosim.world.scene import (
    UPRIGHT,
    Body,
    Box,
    Capsule,
    Cylinder,
    Geometry,
    Hull,
    Link,
    Quaternion,
    Scene,
    Shape,
    Sphere,
    Vector,
    moved,
    multiply,
    rotate,
    turn,
)

Floats = NDArray[np.float64]
GREY: Final = (0.5, 0.5, 0.5, 1.0)
NOTHING: Final = Layout({}, Declared())
KINDS: Final = ("box", "sphere", "cylinder", "capsule", "hull", "ring", "sheet")
SURFACE_M: Final = 1e-9


def thing(geometry: Geometry, position: Vector = (0.0, 0.0, 0.0), orientation: Quaternion = UPRIGHT) -> Shape:
    return Shape(geometry, "walls", GREY, position, orientation, name="thing")


def among(*shapes: Shape) -> Placement:
    """The caster in a world of scenery alone."""
    return Caster(Scene({}, shapes), NOTHING).at([])


def mesh_of(corners: list[Vector], sides: list[tuple[int, ...]]) -> Mesh:
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in corners]
    return read_mesh(
        "a.obj", "\n".join([*lines, *("f " + " ".join(str(n + 1) for n in side) for side in sides)]).encode()
    )


def wedge(x: float, y: float, z: float) -> Mesh:
    """A closed convex body of five sides."""
    corners = [(-x, -y, -z), (x, -y, -z), (x, y, -z), (-x, y, -z), (-x, 0.0, z), (x, 0.0, z)]
    return mesh_of(corners, [(0, 3, 2, 1), (0, 1, 5, 4), (2, 3, 4, 5), (0, 4, 3), (1, 2, 5)])


def ring(around: int = 16, across: int = 8) -> Mesh:
    """A closed mesh with a hole."""
    corners = []
    for turned in (2 * pi * i / around for i in range(around)):
        for rolled in (2 * pi * j / across for j in range(across)):
            out = 1.0 + 0.35 * cos(rolled)
            corners.append((out * cos(turned), out * sin(turned), 0.35 * sin(rolled)))
    sides: list[tuple[int, ...]] = []
    for i in range(around):
        for j in range(across):
            near, far, after = i * across, (i + 1) % around * across, (j + 1) % across
            sides.append((near + j, far + j, far + after, near + after))
    return mesh_of(corners, sides)


RING: Final = ring()
SHEET: Final = mesh_of(
    [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.1), (1.0, 1.0, -0.2), (-1.0, 1.0, 0.3)], [(0, 1, 2), (0, 2, 3)]
)


def geometry_of(kind: str, rng: np.random.Generator) -> Geometry:
    x, y, z = rng.uniform(0.1, 1.0, 3).tolist()
    made: dict[str, Geometry] = {
        "box": Box((x, y, z)),
        "sphere": Sphere(x),
        "cylinder": Cylinder(x, 2 * z),
        "capsule": Capsule(x, 2 * z),
        "hull": Hull(wedge(x, y, z)),
        "ring": RING,
        "sheet": SHEET,
    }
    return made[kind]


def vectors(rng: np.random.Generator, count: int, reach: float) -> Floats:
    return rng.uniform(-reach, reach, (count, 3))


def ways(rng: np.random.Generator, count: int) -> Floats:
    """Unit directions."""
    found = rng.normal(size=(count, 3))
    x, y, z = found.T
    unit: Floats = found / np.sqrt(x * x + y * y + z * z)[:, None]
    return unit


def turned(rng: np.random.Generator) -> Quaternion:
    x, y, z, w = rng.normal(size=4).tolist()
    size = sqrt(x * x + y * y + z * z + w * w)
    return x / size, y / size, z / size, w / size


def somewhere(rng: np.random.Generator, reach: float = 1.0) -> Vector:
    x, y, z = rng.uniform(-reach, reach, 3).tolist()
    return x, y, z


def crowd(rng: np.random.Generator, count: int, reach: float) -> list[Shape]:
    """Shapes of all kinds, near each other."""
    return [
        thing(geometry_of(KINDS[number % len(KINDS)], rng), somewhere(rng, reach), turned(rng))
        for number in range(count)
    ]


# --- against Bullet --------------------------------------------------------------------------------------------------


def in_bullet(shape: Shape, client: int) -> None:
    geometry = shape.geometry
    form: dict[str, Any] = {"shapeType": p.GEOM_MESH}
    if isinstance(geometry, Box):
        form = {"shapeType": p.GEOM_BOX, "halfExtents": geometry.half}
    elif isinstance(geometry, Sphere):
        form = {"shapeType": p.GEOM_SPHERE, "radius": geometry.radius}
    elif isinstance(geometry, Cylinder | Capsule):
        kind = p.GEOM_CYLINDER if isinstance(geometry, Cylinder) else p.GEOM_CAPSULE
        form = {"shapeType": kind, "radius": geometry.radius, "height": geometry.length}
    else:
        mesh = geometry.mesh if isinstance(geometry, Hull) else geometry
        form |= {"vertices": mesh.vertices.tolist()}
        if isinstance(geometry, Mesh):
            form |= {"indices": mesh.triangles.ravel().tolist()}
    p.createMultiBody(
        baseCollisionShapeIndex=p.createCollisionShape(**form, physicsClientId=client),
        basePosition=shape.position,
        baseOrientation=shape.orientation,
        useMaximalCoordinates=True,
        physicsClientId=client,
    )


@pytest.mark.parametrize("kind", KINDS)
def test_a_ray_ends_where_bullets_does(kind: str) -> None:
    """And on the surface. Bullet finds convex things by an iteration that ends up to centimetres off at flat angles."""
    rng = np.random.default_rng(KINDS.index(kind))
    client = p.connect(p.DIRECT)
    errors, grazed = [], 0
    for _ in range(25):
        p.resetSimulation(physicsClientId=client)
        shape = thing(geometry_of(kind, rng), somewhere(rng), turned(rng))
        in_bullet(shape, client)
        world = among(shape)
        aims, directions = vectors(rng, 30, 1.5), ways(rng, 30)
        starts, ends = aims - 5.0 * directions, aims + 5.0 * directions
        ours, _ = world.cast(starts, directions, 10.0)
        for start, way, found, hit in zip(
            starts, directions, ours, p.rayTestBatch(starts, ends, physicsClientId=client), strict=True
        ):
            if (hit[0] < 0) == (found == inf):
                if found < inf:
                    errors.append(abs(hit[2] * 10.0 - found))
                continue
            grazed += 1
            along = start + np.linspace(0.0, 10.0, 2001)[:, None] * way
            assert abs(world.clearance(along, inf).min()) < 0.02, "only rays that graze differ"
        met = ours < inf
        on_surface = world.clearance(starts[met] + ours[met][:, None] * directions[met], inf)
        assert np.abs(on_surface).max(initial=0.0) < SURFACE_M
    p.disconnect(physicsClientId=client)
    assert len(errors) > 50 and grazed <= 5
    assert sorted(errors)[len(errors) * 9 // 10] < (1e-6 if kind in ("box", "ring", "sheet") else 0.005)
    assert max(errors) < 0.06


# --- bits ------------------------------------------------------------------------------------------------------------


def test_many_lines_have_the_bits_of_each_alone() -> None:
    """Also those along an axis, in a face, through an edge: the kernels for arrays are those of lines of sight."""
    rng = np.random.default_rng(20)
    starts, directions = vectors(rng, 600, 1.2).T.copy(), ways(rng, 600).T.copy()
    starts[:, :200] = np.round(starts[:, :200] * 4.0) / 4.0
    directions[:, :100] = np.eye(3)[rng.integers(0, 3, 100)].T * rng.choice((-1.0, 1.0), 100)
    half = np.abs(vectors(rng, 600, 1.0)).T + 0.1
    half[:, :200] = np.round(half[:, :200] * 4.0) / 4.0 + 0.25
    with np.errstate(all="ignore"):
        many = (
            box_spans(starts, directions, half),
            sphere_spans(starts, directions, half[0]),
            cylinder_spans(starts, directions, half[0], half[2]),
            capsule_spans(starts, directions, half[0], half[2]),
        )
    met = 0
    for number in range(600):
        start, way, (x, y, z) = (tuple(rows[:, number].tolist()) for rows in (starts, directions, half))
        alone = (
            box_span(start, way, (x, y, z)),
            sphere_span(start, way, x),
            cylinder_span(start, way, x, z),
            capsule_span(start, way, x, z),
        )
        for one, (enter, leave) in zip(alone, many, strict=True):
            assert (one or (inf, -inf)) == (enter[number], leave[number])
            met += one is not None
    assert 400 < met < 2200


@pytest.mark.parametrize("mesh", [RING, ring(60, 30), wedge(1.0, 0.75, 0.5), SHEET])
def test_many_lines_pass_triangles_where_each_alone_does(mesh: Mesh) -> None:
    rng = np.random.default_rng(21)
    starts, directions = vectors(rng, 200, 1.5).T.copy(), ways(rng, 200).T.copy()
    directions[:, :60] = np.eye(3)[rng.integers(0, 3, 60)].T
    directions[:, 60:120] = rng.choice((-1.0, 1.0), (3, 60)) / sqrt(3.0)  # no coordinate in which they go farthest
    directions[1, 80:120] *= 0.5
    starts[:, :60] = np.round(starts[:, :60] * 4.0) / 4.0
    triangles = Triangles(mesh)
    lines, places = triangles.hits_of_many(starts, directions)
    for number in range(200):
        alone = triangles.hits(tuple(starts[:, number].tolist()), tuple(directions[:, number].tolist()))
        assert places[lines == number].tolist() == alone
    assert len(lines) > 20


def test_neither_company_nor_order_changes_a_bit() -> None:
    rng = np.random.default_rng(22)
    shapes = crowd(rng, 60, 3.0)
    world = among(*shapes)
    starts, directions = vectors(rng, 300, 4.0), ways(rng, 300)
    starts[100:164], starts[164:230] = starts[100], starts[164]  # fans, longer than a bundle
    ranges, reach = rng.uniform(1.0, 12.0, 300), rng.uniform(0.5, 3.0, 300)
    all_hits, far = world.cast(starts, directions, ranges), world.clearance(starts, reach)
    assert 80 < np.isfinite(all_hits.distances).sum() < 280 and np.isfinite(far).sum() > 80
    assert (all_hits.distances == 0.0).any() and (far < 0.0).any()
    for number in range(0, 300, 3):
        one = slice(number, number + 1)
        hit = world.cast(starts[one], directions[one], ranges[one])
        assert (hit.distances[0], hit.things[0]) == (all_hits.distances[number], all_hits.things[number])
        assert world.clearance(starts[one], reach[one])[0] == far[number]
    order = rng.permutation(300)
    again = world.cast(starts[order], directions[order], ranges[order])
    assert (again.distances == all_hits.distances[order]).all()
    assert (world.clearance(starts[order], reach[order]) == far[order]).all()
    more = crowd(rng, 2 * FEW, 6.0)
    others = [among(*more[part : part + FEW]) for part in (0, FEW)]
    least = [one.cast(starts, directions, ranges).distances for one in (world, *others)]
    nearest = [one.clearance(starts, reach) for one in (world, *others)]
    every = among(*shapes, *more)
    assert (every.cast(starts, directions, ranges).distances == np.minimum.reduce(least)).all(), (
        "sorted boxes miss none"
    )
    assert (every.clearance(starts, reach) == np.minimum.reduce(nearest)).all()


def test_sorted_boxes_are_met_as_all_are_compared() -> None:
    rng = np.random.default_rng(23)
    low = rng.uniform(-20.0, 20.0, (3, 3 * FEW))
    high = low + np.exp(rng.uniform(-4.0, 3.0, (3, 3 * FEW)))
    asked_low = rng.uniform(-20.0, 20.0, (3, 50))
    asked_high = asked_low + rng.uniform(0.0, 12.0, (3, 50))
    asked, found = SortedBoxes(low, high).met(asked_low, asked_high)
    is_met = (low[:, None] <= asked_high[:, :, None]) & (high[:, None] >= asked_low[:, :, None])
    expected = np.nonzero(is_met.all(axis=0))
    assert (asked.tolist(), found.tolist()) == (expected[0].tolist(), expected[1].tolist()) and len(found) > 100


def test_a_mesh_beside_its_own_origin_is_met_there() -> None:
    corners = [(4.0, 0.0, 0.0), (4.0, 1.0, 0.0), (4.0, 0.0, 1.0), (5.0, 0.0, 0.0)]
    aside = Hull(mesh_of(corners, [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]))
    world = among(thing(aside, (1.0, 2.0, 3.0), turn((0.0, 0.0, 1.0), pi / 2)))
    start, way = np.array([[0.8, 0.0, 3.2], [-3.0, 6.3, 3.2]]), np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    assert world.cast(start, way, 9.0).distances == pytest.approx([6.0, 3.5])
    assert world.clearance(np.array([[0.8, 5.5, 3.2]]), 1.0) == pytest.approx([0.5])


def test_rays_from_one_place_pass_each_its_own_entity_and_others_begin_elsewhere() -> None:
    """Neighbours that share a place, or a coordinate of it, are no one ray."""
    layout = Layout({"one": "ball", "two": "ball"}, Declared())
    ball = Shape(Sphere(0.5), "walls", GREY)
    bodies = {
        name: Body(name, "ball", (x, 0.0, 0.0), (Link(name, "fixed", (ball,), 1.0, (1.0, 1.0, 1.0)),))
        for name, x in (("one", 2.0), ("two", 5.0))
    }
    world = Caster(Scene(bodies, ()), layout).at([])
    starts = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.3, 0.0]])
    ways_ahead = np.array([[1.0, 0.0, 0.0]] * 5)
    hits = world.cast(starts, ways_ahead, 9.0, np.array([-1, layout["one"].index, layout["two"].index, -1, -1]))
    assert hits.distances == pytest.approx([1.5, 4.5, 1.5, inf, 1.6])
    assert hits.things.tolist() == [0, 1, 0, -1, 0]


# --- where rays begin and end ----------------------------------------------------------------------------------------


SOLIDS: Final[tuple[Geometry, ...]] = (
    Box((1.0, 1.0, 1.0)),
    Sphere(1.0),
    Cylinder(1.0, 2.0),
    Capsule(1.0, 1.0),
    Hull(wedge(1.0, 1.0, 1.0)),
)


@pytest.mark.parametrize("geometry", SOLIDS)
def test_a_ray_from_inside_from_the_surface_and_past_it(geometry: Geometry) -> None:
    world = among(thing(geometry))

    def met(start: Vector, way: Vector, far: float = 10.0) -> float:
        return float(world.cast(np.array([start]), np.array([way]), far).distances[0])

    below = 1.5 if isinstance(geometry, Capsule) else 1.0
    up, down = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
    assert met((0.0, 0.0, -3.0), up) == 3.0 - below
    assert met((0.0, 0.0, -3.0), down) == inf, "behind it"
    assert met((0.0, 0.0, -3.0), up, 2.999 - below) == inf and met((0.0, 0.0, -3.0), up, 3.001 - below) == 3.0 - below
    assert met((0.0, 0.0, 0.1), up) == met((0.0, 0.0, 0.1), down) == 0.0, "inside"
    assert met((0.0, 0.0, -below), down) == inf, "away from the surface"
    assert met((0.0, 0.0, -below), up) == 0.0, "into it"
    if not isinstance(geometry, Hull):
        assert met((-3.0, 1.0, 0.0), (1.0, 0.0, 0.0)) == inf, "it touches"
        assert met((-3.0, 1.0 - 1e-6, 0.0), (1.0, 0.0, 0.0)) < inf


def test_a_wall_without_a_thickness_is_met_from_both_sides_and_a_ring_is_seen_through() -> None:
    flat = mesh_of([(0.0, -1.0, -1.0), (0.0, 1.0, -1.0), (0.0, 1.0, 1.0), (0.0, -1.0, 1.0)], [(0, 1, 2), (0, 2, 3)])
    starts, there = np.array([[-2.0, 0.3, 0.1], [2.0, 0.3, 0.1]]), np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    assert among(thing(flat)).cast(starts, there, 5.0).distances.tolist() == [2.0, 2.0]
    assert among(thing(flat)).cast(starts, -there, 5.0).distances.tolist() == [inf, inf]
    through = np.array([[0.0, 0.0, -2.0], [1.0, 0.01, -2.0]]), np.array([[0.0, 0.0, 1.0]] * 2)
    hole, rim = among(thing(RING)).cast(*through, 5.0).distances.tolist()
    assert hole == inf and rim == pytest.approx(1.65, abs=0.03)


def test_no_rays_meet_nothing() -> None:
    world = among(thing(Sphere(1.0)))
    hits = world.cast(np.zeros((0, 3)), np.zeros((0, 3)), 1.0)
    assert len(hits.distances) == len(hits.things) == len(world.clearance(np.zeros((0, 3)), 1.0)) == 0
    assert among().cast(np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]]), 1.0).distances.tolist() == [inf]


# --- clearance -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_clearance_is_the_distance_of_the_nearest_place_of_the_surface(kind: str) -> None:
    """Places of the surface are where rays end; inside it is negative, where rays end at once."""
    rng = np.random.default_rng(30 + KINDS.index(kind))
    for _ in range(3):
        shape = thing(geometry_of(kind, rng), somewhere(rng), turned(rng))
        world = among(shape)
        aims, directions = np.array(shape.position) + vectors(rng, 6000, 1.5), ways(rng, 6000)
        starts = aims - 6.0 * directions
        hits, _ = world.cast(starts, directions, 12.0)
        surface = (starts + hits[:, None] * directions)[hits < inf]
        points = np.array(shape.position) + vectors(rng, 60, 1.5)
        found = world.clearance(points, inf)
        x, y, z = (surface[None, :, :] - points[:, None, :]).transpose(2, 0, 1)
        sampled = np.sqrt(x * x + y * y + z * z).min(axis=1)
        if kind != "ring":  # of which rays from outside see half
            assert (np.abs(found) <= sampled + 1e-9).all() and (sampled - np.abs(found)).max() < 0.25
        if kind != "sheet":
            inside = world.cast(points, ways(rng, 60), 12.0).distances == 0.0
            assert ((found < 0.0) == inside).all()
        within = world.clearance(points, 0.4)
        assert (within == np.where(found <= 0.4, found, inf)).all()


def test_clearance_of_a_box_in_its_face_edge_corner_and_middle() -> None:
    points = np.array([[2.0, 0.0, 0.0], [2.0, 3.0, 0.0], [2.0, 3.0, 4.0], [0.5, 0.0, 0.0], [0.0, 0.0, 0.0]])
    found = among(thing(Box((1.0, 2.0, 3.0)))).clearance(points, inf)
    assert found.tolist() == pytest.approx([1.0, sqrt(2.0), sqrt(3.0), -0.5, -1.0])


# --- bodies ----------------------------------------------------------------------------------------------------------


def arm(name: str, base: Vector) -> Body:
    """A fixed arm of two links that turn, and a hand that is fixed to them."""
    bar = Shape(Box((0.4, 0.05, 0.05)), "walls", GREY, (0.4, 0.0, 0.0))
    ball = Shape(Sphere(0.1), "walls", GREY, (0.1, 0.0, 0.0))
    links = (
        Link("upper", "revolute", (bar,), 1.0, (1.0, 1.0, 1.0), axis=(0.0, 0.0, 1.0), limits=(-3.0, 3.0)),
        Link(
            "lower",
            "continuous",
            (bar,),
            1.0,
            (1.0, 1.0, 1.0),
            axis=(0.0, 1.0, 0.0),
            parent=0,
            position=(0.8, 0.0, 0.0),
        ),
        Link("hand", "fixed", (ball,), 1.0, (1.0, 1.0, 1.0), parent=1, position=(0.8, 0.0, 0.0)),
    )
    return Body(name, "rod", base, links)


def cart(name: str) -> Body:
    """A free body whose centre of mass is not at its origin, with a mast fixed to it."""
    hull = Shape(Cylinder(0.3, 0.4), "walls", GREY, (0.05, 0.0, 0.2))
    tip = Shape(Capsule(0.05, 0.3), "walls", GREY, (0.0, 0.0, 0.2), turn((1.0, 0.0, 0.0), 0.3))
    principal = turn((0.0, 0.0, 1.0), 0.7)
    first = Link("hull", "free", (hull,), 1.0, (1.0, 1.0, 1.0), centre_of_mass=(0.1, 0.05, 0.2), principal=principal)
    mast = Link(
        "mast",
        "fixed",
        (tip,),
        1.0,
        (1.0, 1.0, 1.0),
        parent=0,
        position=(0.0, 0.1, 0.4),
        orientation=turn((0.0, 1.0, 0.0), 0.4),
    )
    return Body(name, "ball", (0.0, 0.0, 0.0), (first, mast))


def test_bodies_are_met_where_scenery_in_their_place_is() -> None:
    """Fixed, free, and with joints; whoever is ignored is passed, and what is met is named."""
    rng = np.random.default_rng(40)
    layout = Layout({"arm": "rod", "cart1": "ball", "cart2": "ball"}, Declared())
    bodies = {"arm": arm("arm", (0.2, 0.1, 0.4)), "cart1": cart("cart1"), "cart2": cart("cart2")}
    caster, met = Caster(Scene(bodies, (thing(Box((3.0, 3.0, 0.1)), (0.0, 0.0, -0.1)),)), layout), 0
    for _ in range(8):
        numbers = [0.0] * layout.size
        joints = layout["arm"].offsets["joint_positions"]
        numbers[joints : joints + 2] = rng.uniform(-1.5, 1.5, 2).tolist()
        for name in ("cart1", "cart2"):
            at, its = layout[name].offsets["position"], layout[name].offsets["orientation"]
            numbers[at : at + 3], numbers[its : its + 4] = somewhere(rng), turned(rng)
        still: dict[str, list[Shape]] = {}
        for name, body in bodies.items():
            poses = forward_kinematics(body, layout[name], numbers)
            for link, (_, position, orientation) in zip(body.links, poses, strict=True):
                for shape in link.shapes:
                    place = moved(position, rotate(orientation, shape.position), 1.0)
                    still.setdefault(name, []).append(
                        thing(shape.geometry, place, multiply(orientation, shape.orientation))
                    )
        starts, directions = vectors(rng, 200, 2.0), ways(rng, 200)
        world = caster.at(numbers)
        assert (
            world.cast(starts, directions, 5.0).distances
            == caster.at(numbers, np.array(numbers)).cast(starts, directions, 5.0).distances
        ).all()
        alone = {name: among(*shapes).cast(starts, directions, 5.0).distances for name, shapes in still.items()}
        floor = among(thing(Box((3.0, 3.0, 0.1)), (0.0, 0.0, -0.1)))
        alone["thing"] = floor.cast(starts, directions, 5.0).distances
        for ignored in (None, "cart1", "arm"):
            hits = world.cast(starts, directions, 5.0, None if ignored is None else layout[ignored].index)
            least = np.minimum.reduce([alone[name] for name in alone if name != ignored])
            assert hits.distances == pytest.approx(least, abs=1e-9)
            for found, least_one, number in zip(hits.distances, hits.things, range(200), strict=True):
                if 0.0 < found < inf:
                    assert alone[caster.things[least_one]][number] == pytest.approx(found, abs=1e-9)
                    met += 1
                assert (least_one == -1) == (found == inf)
            clear = np.minimum.reduce(
                [
                    floor.clearance(starts, inf),
                    *(among(*shapes).clearance(starts, inf) for name, shapes in still.items() if name != ignored),
                ]
            )
            index = None if ignored is None else layout[ignored].index
            assert world.clearance(starts, inf, index) == pytest.approx(clear, abs=1e-9)
    assert met > 1000


def test_a_frame_that_differs_in_what_moves_is_placed_anew() -> None:
    layout = Layout({"cart": "ball"}, Declared())
    caster = Caster(Scene({"cart": cart("cart")}, ()), layout)
    numbers, at = [0.0] * layout.size, layout["cart"].offsets
    numbers[at["orientation"] + 3] = 1.0
    rays = np.array([[-3.0, 0.0, 0.0]]), np.array([[1.0, 0.0, 0.0]])
    first = caster.at(numbers).cast(*rays, 9.0).distances[0]
    numbers[at["position"]] = 1.0
    assert caster.at(numbers).cast(*rays, 9.0).distances[0] == pytest.approx(first + 1.0)
    numbers[at["position"]] = 0.0
    assert caster.at(numbers).cast(*rays, 9.0).distances[0] == first
