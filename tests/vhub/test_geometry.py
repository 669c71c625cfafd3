"""Lines of sight: what they cross is what Bullet's rays hit, the same both ways, alone or in company, in any order."""

from __future__ import annotations

import random
from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import cos, dist, pi, sin, sqrt
from pathlib import Path
from typing import Any, Final

import numpy as np
import pybullet as p
import pytest

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.library.table.settings import table_of
from foosim.vhub.line_of_sight.occlusion import Crossing, Geometry, Sight, Trace
from foosim.vhub.line_of_sight.placement import World
from foosim.world.assembly.world import initial_numbers
from foosim.world.frame import Frame
from foosim.world.layout import Declared, Layout, build_layout
from foosim.world.matter.materials import METAL, PLASTIC, UNKNOWN, WOOD, RadioMaterial
from foosim.world.matter.mesh import Mesh
from foosim.world.mesh_files import read_mesh
from foosim.world.scene import (
    UPRIGHT,
    Body,
    Box,
    Cylinder,
    Link,
    Quaternion,
    Scene,
    Shape,
    Sphere,
    Vector,
    place,
    rotate,
)
from tests.placing import place_ball

TEXT: Final = (Path(__file__).parents[2] / "deploy" / "table.yaml").read_text()
GREY: Final = (0.5, 0.5, 0.5, 1.0)
CONCRETE: Final = RadioMaterial.model_validate({"is": "concrete"})
SHELL: Final = RadioMaterial.model_validate({"is": "glass", "thickness": "6 mm"})
NOTHING: Final = RadioMaterial.model_validate({"loss": "0 dB"})
Any3D = Box | Sphere | Cylinder | Mesh


def thing(
    geometry: Any3D,
    position: Vector = (0.0, 0.0, 0.0),
    orientation: Quaternion = UPRIGHT,
    radio: RadioMaterial = CONCRETE,
    name: str = "thing",
) -> Shape:
    return Shape(geometry, "walls", GREY, position, orientation, radio, name)


def sight_of(*things: Shape) -> Sight:
    """The sight in a world of scenery alone."""
    return Sight(Geometry(Scene({}, things)), Layout({}, Declared()), ())


def crossed(sight: Sight, a: Vector, b: Vector, ignoring: Iterable[str] = ()) -> tuple[Crossing, ...]:
    return sight.crossings((a, b) if a <= b else (b, a), frozenset(ignoring), Trace())


def faces(*statements: str) -> Mesh:
    return read_mesh("a.obj", "\n".join(statements).encode())


def box_mesh(half: Vector, lid: bool = True, split: bool = False) -> Mesh:
    """A box of triangles, closed or without its upper face; `split`: every face with corners of its own."""
    corners = [(x * half[0], y * half[1], z * half[2]) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)][: 6 if lid else 5]
    if split:
        lines = [f"v {x} {y} {z}" for side in sides for x, y, z in (corners[index] for index in side)]
        return faces(*lines, *(f"f {4 * n + 1} {4 * n + 2} {4 * n + 3} {4 * n + 4}" for n in range(len(sides))))
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    return faces(*lines, *(f"f {a + 1} {b + 1} {c + 1} {d + 1}" for a, b, c, d in sides))


def ring(around: int = 24, across: int = 12) -> Mesh:
    """A closed mesh that is not convex: a line may enter it twice."""
    lines = []
    for turned in (2 * pi * i / around for i in range(around)):
        for rolled in (2 * pi * j / across for j in range(across)):
            out = 1.0 + 0.35 * cos(rolled)
            lines.append(f"v {out * cos(turned):.6f} {out * sin(turned):.6f} {0.35 * sin(rolled):.6f}")
    for i in range(around):
        for j in range(across):
            near, far = i * across, (i + 1) % around * across
            after = (j + 1) % across
            lines.append(f"f {near + j + 1} {far + j + 1} {far + after + 1} {near + after + 1}")
    return faces(*lines)


# --- against Bullet --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Kind:
    """A kind of shape, and how far Bullet's rays are from it (m). Bullet computes with float64.

    Triangles it intersects exactly. Everything convex it finds by an iteration (GJK) that ends when it is close enough:
    exact for most rays through boxes, up to centimetres off for round shapes and rays at a flat angle.
    """

    tolerance: float
    tolerance_of_most: float


KINDS: Final = {
    "box": Kind(0.01, 1e-9),
    "sphere": Kind(0.04, 0.004),
    "cylinder": Kind(0.04, 0.004),
    "convex": Kind(1e-6, 1e-9),
    "ring": Kind(1e-6, 1e-9),
}
RING: Final = ring()
GRAZE_M: Final = 0.02


def anything(kind: str, rng: random.Random) -> Any3D:
    match kind:
        case "box":
            return Box((rng.uniform(0.05, 1), rng.uniform(0.05, 1), rng.uniform(0.05, 1)))
        case "sphere":
            return Sphere(rng.uniform(0.1, 1))
        case "cylinder":
            return Cylinder(rng.uniform(0.05, 1), rng.uniform(0.1, 2))
        case "convex":
            return box_mesh((rng.uniform(0.05, 1), rng.uniform(0.05, 1), rng.uniform(0.05, 1)))
    return RING


def turned(rng: random.Random) -> Quaternion:
    x, y, z, w = (rng.gauss(0, 1) for _ in range(4))
    length = sqrt(x * x + y * y + z * z + w * w)
    return x / length, y / length, z / length, w / length


def in_bullet(shape: Shape, mask: int, client: int) -> None:
    geometry = shape.geometry
    form: dict[str, Any] = {"shapeType": p.GEOM_MESH}
    if isinstance(geometry, Box):
        form = {"shapeType": p.GEOM_BOX, "halfExtents": geometry.half}
    elif isinstance(geometry, Sphere):
        form = {"shapeType": p.GEOM_SPHERE, "radius": geometry.radius}
    elif isinstance(geometry, Cylinder):
        form = {"shapeType": p.GEOM_CYLINDER, "radius": geometry.radius, "height": geometry.length}
    else:
        assert isinstance(geometry, Mesh)
        form |= {"vertices": geometry.vertices.tolist(), "indices": geometry.triangles.ravel().tolist()}
    body = p.createMultiBody(
        baseCollisionShapeIndex=p.createCollisionShape(**form, physicsClientId=client),
        basePosition=shape.position,
        baseOrientation=shape.orientation,
        useMaximalCoordinates=True,
        physicsClientId=client,
    )
    p.setCollisionFilterGroupMask(body, -1, mask, -1, physicsClientId=client)


def moved(line: tuple[Vector, Vector], way: Vector) -> tuple[Vector, Vector]:
    (ax, ay, az), (bx, by, bz) = line
    return (ax + way[0], ay + way[1], az + way[2]), (bx + way[0], by + way[1], bz + way[2])


def grazes(sight: Sight, name: str, line: tuple[Vector, Vector]) -> bool:
    """True if lines beside this one disagree on whether they cross a thing."""
    found = set()
    for axis in range(3):
        for step in (-GRAZE_M, 0.0, GRAZE_M):
            way = (step, 0.0, 0.0) if axis == 0 else (0.0, step, 0.0) if axis == 1 else (0.0, 0.0, step)
            a, b = moved(line, way)
            found.add(name in [crossing.name for crossing in crossed(sight, a, b)])
    return len(found) == 2


def line_through(rng: random.Random, reach: float = 8.0, aim: float = 2.0) -> tuple[Vector, Vector]:
    """A line of twice the reach, whose middle is in a box of half `aim` around the origin."""
    x, y, z = (rng.gauss(0, 1) for _ in range(3))
    far = reach / sqrt(x * x + y * y + z * z)
    ends = moved(((-far * x, -far * y, -far * z), (far * x, far * y, far * z)), at_random(rng, aim))
    return min(ends), max(ends)


def at_random(rng: random.Random, reach: float) -> Vector:
    return rng.uniform(-reach, reach), rng.uniform(-reach, reach), rng.uniform(-reach, reach)


def test_what_is_crossed_is_what_bullet_hits_from_both_ends() -> None:
    """Apart from rays that graze, which are few."""
    rng = random.Random(20)
    client = p.connect(p.DIRECT)
    errors: dict[str, list[float]] = {kind: [] for kind in KINDS}
    disagreements = far_off = 0
    for _ in range(250):
        p.resetSimulation(physicsClientId=client)
        things = [thing(anything(kind, rng), at_random(rng, 1.5), turned(rng), name=kind) for kind in KINDS]
        for number, shape in enumerate(things):
            in_bullet(shape, 1 << number, client)
        sight = sight_of(*things)
        lines = [line_through(rng) for _ in range(8)]
        ours = [crossed(sight, a, b) for a, b in lines]
        for number, shape in enumerate(things):
            mask = {"collisionFilterMask": 1 << number, "physicsClientId": client}
            there = p.rayTestBatch([a for a, _ in lines], [b for _, b in lines], **mask)
            back = p.rayTestBatch([b for _, b in lines], [a for a, _ in lines], **mask)
            for line, hit, hit_back, crossings in zip(lines, there, back, ours, strict=True):
                found = [crossing for crossing in crossings if crossing.name == shape.name]
                if not len(found) == (hit[0] >= 0) == (hit_back[0] >= 0):
                    disagreements += 1
                    assert grazes(sight, shape.name, line), (shape, line)
                elif found:
                    length = dist(*line)
                    entry, leave = hit[2] * length, length - hit_back[2] * length
                    error = max(abs(entry - found[0].entry_m), abs(leave - found[0].exit_m))
                    errors[shape.name].append(error)
                    if error > KINDS[shape.name].tolerance:
                        far_off += 1
                        assert grazes(sight, shape.name, line), (shape, line, error)
    p.disconnect(physicsClientId=client)
    assert disagreements <= 10 and far_off <= 10, (disagreements, far_off)
    for kind, found_errors in errors.items():
        assert len(found_errors) > 100, kind
        assert sorted(found_errors)[len(found_errors) * 9 // 10] < KINDS[kind].tolerance_of_most, kind


def test_round_things_begin_and_end_on_their_surface() -> None:
    """Where Bullet is not exact enough to tell: at entry and exit the distance from the surface is 0."""
    rng = random.Random(21)
    count = 0
    for _ in range(600):
        shape = thing(anything(rng.choice(("sphere", "cylinder")), rng), (0.4, -0.3, 0.2), turned(rng))
        a, b = line_through(rng, 3.0, 0.5)
        for crossing in crossed(sight_of(shape), a, b):
            count += 1
            assert crossing.chord_m == crossing.exit_m - crossing.entry_m > 0.0
            for way in (crossing.entry_m, crossing.exit_m):
                share = way / dist(a, b)
                x, y, z, w = shape.orientation
                spot = tuple(
                    one + share * (other - one) - at for one, other, at in zip(a, b, shape.position, strict=True)
                )
                x, y, z = rotate((-x, -y, -z, w), spot)  # type: ignore[arg-type]
                if isinstance(shape.geometry, Sphere):
                    off = sqrt(x * x + y * y + z * z) - shape.geometry.radius
                else:
                    assert isinstance(shape.geometry, Cylinder)
                    off = max(sqrt(x * x + y * y) - shape.geometry.radius, abs(z) - shape.geometry.length / 2)
                assert abs(off) < 1e-12
    assert count > 100


# --- obstacles -------------------------------------------------------------------------------------------------------

LEFT: Final = (-5.0, 0.3, 1.0)
RIGHT: Final = (5.0, 0.3, 1.0)
WALL: Final = Box((0.1, 3.0, 2.0))


def test_a_wall_between_is_crossed_and_one_that_moved_away_is_not() -> None:
    (crossing,) = crossed(sight_of(thing(WALL)), LEFT, RIGHT)
    assert crossing[:2] == ("thing", CONCRETE) and crossing.chord_m == pytest.approx(0.2, abs=1e-15)
    assert crossing[3:] == pytest.approx((4.9, 5.1))
    assert crossed(sight_of(thing(WALL, (0.0, 4.0, 0.0))), LEFT, RIGHT) == ()
    assert crossed(sight_of(thing(WALL, (6.0, 0.0, 0.0))), LEFT, RIGHT) == (), "behind an end"
    assert crossed(sight_of(thing(WALL, radio=NOTHING)), LEFT, RIGHT) == (), "transparent"


def test_things_come_in_the_order_of_their_distance_and_then_of_their_names() -> None:
    things = [thing(WALL, (x, 0.0, 0.0), name=name) for name, x in (("d", 3.0), ("c", 0.0), ("b", 0.0), ("a", 1.0))]
    expected = ["b", "c", "a", "d"]
    assert [crossing.name for crossing in crossed(sight_of(*things), LEFT, RIGHT)] == expected
    assert [crossing.name for crossing in crossed(sight_of(*reversed(things)), RIGHT, LEFT)] == expected


def test_what_overlaps_counts_once_if_it_is_of_one_thing_and_material() -> None:
    one, other, third = (thing(WALL, (x, 0.0, 0.0)) for x in (0.0, 0.15, 1.0))
    found = crossed(sight_of(third, other, one), LEFT, RIGHT)
    assert [crossing.chord_m for crossing in found] == [pytest.approx(0.35), pytest.approx(0.2)]
    assert len(crossed(sight_of(one, thing(WALL, (0.2, 0.0, 0.0))), LEFT, RIGHT)) == 1, "side by side"
    assert len(crossed(sight_of(one, thing(WALL, (0.15, 0.0, 0.0), radio=WOOD)), LEFT, RIGHT)) == 2
    assert len(crossed(sight_of(one, thing(WALL, (0.15, 0.0, 0.0), name="else")), LEFT, RIGHT)) == 2


def test_an_end_inside_is_where_the_chord_begins() -> None:
    sight = sight_of(thing(Box((1.0, 1.0, 1.0))), thing(box_mesh((1.0, 1.0, 1.0)), name="mesh"))
    inside = (0.25, 0.0, 0.0)
    assert [c.chord_m for c in crossed(sight, inside, (9.0, 0.0, 0.0))] == [0.75, 0.75]
    assert [c.chord_m for c in crossed(sight, inside, (-9.0, 0.0, 0.0))] == [1.25, 1.25]
    assert [c.chord_m for c in crossed(sight, inside, (0.25, 0.5, 0.0))] == [0.5, 0.5], "both ends"
    assert crossed(sight, inside, inside) == ()


def test_lines_along_a_face_through_an_edge_or_of_no_length_cross_nothing() -> None:
    for shape in (Box((1.0, 1.0, 1.0)), Cylinder(1.0, 2.0)):
        sight = sight_of(thing(shape))
        assert crossed(sight, (-5.0, 0.0, 1.0), (5.0, 0.0, 1.0)) == (), "along the upper face"
        assert crossed(sight, (-5.0, 0.0, 1.0 - 1e-6), (5.0, 0.0, 1.0 - 1e-6)) != ()
        assert crossed(sight, (0.0, 1.0, -5.0), (0.0, 1.0, 5.0)) == (), "along a side"
        assert crossed(sight, (0.0, 0.0, -5.0), (0.0, 0.0, 5.0))[0].chord_m == 2.0, "along the axis"
        assert crossed(sight, (-2.0, 0.0, 0.0), (0.0, 0.0, 2.0)) == (), "through an edge"
        assert crossed(sight, (5.0, 5.0, 5.0), (5.0, 5.0, 5.0)) == ()
    assert crossed(sight_of(thing(Sphere(1.0))), (-5.0, 0.0, 1.0), (5.0, 0.0, 1.0)) == ()


def test_a_line_along_a_face_of_a_mesh_is_inside_or_outside_and_not_half() -> None:
    """Where it touches, it is taken for one that lies a little beside it: always for the same."""
    sight = sight_of(thing(box_mesh((1.0, 1.0, 1.0))))
    for axis, other in ((0, 1), (1, 2), (2, 0), (0, 2), (1, 0), (2, 1)):
        for side in (-1.0, 1.0):
            ends = [[0.25, 0.25, 0.25], [0.25, 0.25, 0.25]]
            for end, way in zip(ends, (-5.0, 5.0), strict=True):
                end[other], end[axis] = side, way
            a, b = ((end[0], end[1], end[2]) for end in ends)
            assert sum(c.chord_m for c in crossed(sight, a, b)) in (0.0, 2.0)


def test_a_line_through_edges_and_corners_of_a_mesh_passes_each_side_once() -> None:
    """Through the common edges of triangles, and the corner of six: as many walls as there are."""
    exact = sight_of(thing(Box((1.0, 2.0, 0.5))))
    for mesh in (box_mesh((1.0, 2.0, 0.5)), box_mesh((1.0, 2.0, 0.5), split=True)):
        sight = sight_of(thing(mesh))
        for a in ((-3.0, y, z) for y in (-1.0, 0.0, 1.0) for z in (-0.25, 0.0, 0.25)):
            for b in ((3.0, -a[1], -a[2]), (3.0, a[1], a[2]), (3.0, -a[1], a[2]), (1.0, 2.0, 0.5), (3.0, 0.5, 0.125)):
                chord = sum(crossing.chord_m for crossing in crossed(exact, a, b))
                assert chord > 1.0
                assert sum(crossing.chord_m for crossing in crossed(sight, a, b)) == pytest.approx(chord, abs=1e-9)
    fan = ["v 0 0 0", *(f"v 0 {cos(pi * n / 3):.3f} {sin(pi * n / 3):.3f}" for n in range(6))]
    sheet = faces(*fan, *(f"f 1 {n + 2} {(n + 1) % 6 + 2}" for n in range(6)))
    for a, b in ((LEFT, RIGHT), ((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)), ((-1.0, -0.5, 0.1), (1.0, 0.5, -0.1))):
        assert len(crossed(sight_of(thing(sheet, radio=SHELL)), a, b)) == (0 if a == LEFT else 1)


def test_chords_of_a_closed_mesh_add_up_and_walls_of_an_open_one_count_each() -> None:
    (crossing,) = crossed(sight_of(thing(RING)), (-5.0, 0.01, 0.01), (5.0, 0.01, 0.01))
    assert crossing.chord_m == pytest.approx(1.4, abs=0.02) and crossing.exit_m - crossing.entry_m > 2.6
    tray = thing(box_mesh((1.0, 1.0, 1.0), lid=False), radio=SHELL)
    sight = sight_of(tray)
    across = crossed(sight, (-5.0, 0.1, 0.2), (5.0, 0.1, 0.2))
    assert [c[:3] for c in across] == [("thing", SHELL, 0.0)] * 2
    assert len(crossed(sight, (0.1, 0.2, -5.0), (0.1, 0.2, 5.0))) == 1, "there is no lid"
    assert len(crossed(sight, (0.1, 0.2, 0.0), (5.0, 0.2, 0.0))) == 1, "from the inside"


def test_a_mesh_of_many_triangles_is_crossed_where_a_small_one_is() -> None:
    fine, rng = ring(160, 80), random.Random(22)
    coarse, sight = sight_of(thing(RING)), sight_of(thing(fine))
    chords = []
    for _ in range(200):
        a, b = line_through(rng, 3.0, 1.0)
        one, other = (sum(c.chord_m for c in crossed(known, a, b)) for known in (coarse, sight))
        chords.append(abs(one - other))
    assert sorted(chords)[150] < 0.05 and sum(chord == 0.0 for chord in chords) > 20


# --- bodies ----------------------------------------------------------------------------------------------------------


def rovers(*places: Vector) -> tuple[Geometry, Layout, list[float]]:
    """Rovers of a chassis and a lid, at these places; between the first two a wall."""
    shapes = (
        Shape(Cylinder(0.3, 0.4), "walls", GREY, radio=METAL),
        Shape(Box((0.2, 0.2, 0.1)), "walls", GREY, (0.0, 0.0, 0.25), radio=METAL),
    )
    names = [f"rover{n}" for n in range(len(places))]
    links = {name: (Link(name, "free", shapes, 1.0, (1.0, 1.0, 1.0)),) for name in names}
    bodies = {name: Body(name, "ball", (0.0, 0.0, 0.0), links[name]) for name in names}
    layout = Layout(dict.fromkeys(names, "ball"), Declared())
    numbers = [0.0] * layout.size
    for name, spot in zip(names, places, strict=True):
        place_ball(numbers, layout[name], spot)
    return Geometry(Scene(bodies, (thing(WALL),))), layout, numbers


def test_a_rover_between_two_others_shadows_them_and_their_own_bodies_do_not() -> None:
    a, b, between = (-4.0, 0.0, 0.1), (4.0, 0.0, 0.1), (2.0, 0.0, 0.1)
    geometry, layout, numbers = rovers(a, b, between)
    sight = Sight(geometry, layout, numbers)
    assert [c.name for c in crossed(sight, a, b)] == ["rover0", "thing", "rover2", "rover1"]
    found = crossed(sight, a, b, ("rover0", "rover1"))
    assert [c.name for c in found] == ["thing", "rover2"] and found[1].material == METAL
    assert found[1].chord_m == pytest.approx(0.6), "chassis and lid are one"
    assert crossed(sight, a, b, ["thing"]) == crossed(sight, a, b), "scenery is never ignored"
    place_ball(numbers, layout["rover2"], (2.0, 0.5, 0.1))
    later = Sight(geometry, layout, numbers)
    assert [c.name for c in crossed(later, a, b, ("rover1", "rover0"))] == ["thing"]


def test_a_body_is_crossed_as_scenery_in_its_place_is() -> None:
    """However it is turned: nothing of it is overlooked."""
    rng = random.Random(25)
    geometry, layout, numbers = rovers((0.0, 0.0, 0.0))
    (rover,), found = geometry.scene.bodies.values(), 0
    boom = Shape(Box((1.0, 0.05, 0.05)), "walls", GREY, radio=METAL)
    link = replace(rover.links[0], shapes=(*rover.links[0].shapes, boom))
    geometry = Geometry(Scene({"rover0": replace(rover, links=(link,))}, ()))
    for _ in range(40):
        position, orientation = at_random(rng, 0.2), turned(rng)
        place_ball(numbers, layout["rover0"], position)
        start = layout["rover0"].offsets["orientation"]
        numbers[start : start + 4] = orientation
        placed = (replace(shape, name="rover0") for shape in link.shapes)
        there = [(one, *place(one, position, orientation)) for one in placed]
        still = sight_of(*(replace(one, position=at, orientation=turn) for one, at, turn in there))
        sight = Sight(geometry, layout, numbers)
        tip = moved((position, position), rotate(orientation, (0.99, 0.0, 0.0)))[0]
        lines = [line_through(rng, 2.0, 0.5) for _ in range(40)]
        for a, b in [*lines, *(moved(line_through(rng, 2.0, 0.0), tip) for _ in range(10))]:
            assert crossed(sight, a, b) == crossed(still, a, b)
            found += len(crossed(sight, a, b))
    assert found > 300


def test_both_directions_have_the_same_crossings_to_the_last_bit() -> None:
    rng = random.Random(23)
    geometry, layout, numbers = rovers(*((rng.uniform(-4, 4), rng.uniform(-2, 2), 0.1) for _ in range(12)))
    for _ in range(300):
        a, b = line_through(rng, 5.0, 1.0)
        there, back = (crossed(Sight(geometry, layout, numbers), *ends) for ends in ((a, b), (b, a)))
        assert repr(there) == repr(back)


def test_lines_that_drive_through_litter_cross_what_is_there_with_and_without_a_memory() -> None:
    """One end moves along an axis, then both jump: what a trace remembers has all that the line may cross."""
    rng = random.Random(26)
    things = tuple(thing(Box((0.12, 0.08, 0.16)), at_random(rng, 1.5), name=f"box{n}") for n in range(150))
    sight, singles, trace, found = sight_of(*things), [sight_of(one) for one in things], Trace(), 0
    for drive in range(60):
        ends, which, axis, step = [*line_through(rng, 1.2, 0.5)], drive % 2, drive % 3, rng.choice((-0.1, 0.1))
        for _ in range(15):
            ends[which] = moved((ends[which],) * 2, ((step, 0.0, 0.0), (0.0, step, 0.0), (0.0, 0.0, step))[axis])[0]
            a, b = ends
            line = (a, b) if a <= b else (b, a)
            alone = [crossing for one in singles for crossing in crossed(one, a, b)]
            assert sight.crossings(line, frozenset(), trace) == crossed(sight, a, b)
            assert sorted(crossed(sight, a, b)) == sorted(alone)
            found += len(alone)
    assert found > 300


def world_of(*sets: str) -> tuple[World, Layout, list[float]]:
    deployment = load_deployment(apply_sets(TEXT, "table.yaml", sets), "table.yaml")
    layout = build_layout(deployment)
    return World(deployment, deployment.network), layout, initial_numbers(deployment, layout)


def test_on_the_table_rods_and_figures_stand_between_and_follow_the_frame() -> None:
    world, layout, numbers = world_of()
    rod = table_of(load_deployment(TEXT, "table.yaml")).lines["goal"].x
    a, b = (rod - 0.05, 0.0, 0.084), (rod + 0.1, 0.0, 0.084)

    def names(a: Vector, b: Vector) -> list[tuple[str, RadioMaterial]]:
        world.turn_to(Frame(0, layout, np.array(numbers)))
        return [(crossing.name, crossing.material) for crossing in world.crossings(a, b, frozenset())]

    assert set(names(a, b)) == {("red.goal", METAL), ("red.goal", PLASTIC)}
    assert ("table", WOOD) in names(a, (a[0], 2.0, a[2])) and names(a, (a[0], 2.0, 0.5)) == []
    assert names(a, (rod - 0.05, 0.0, -0.06))[-1][0] == "table", "the floor"
    beside = ((rod - 0.05, 0.0, 0.03), (rod + 0.1, 0.0, 0.03))
    assert names(*beside) == [("red.goal", PLASTIC)]
    at = layout["red.goal"].offsets["joint_positions"]
    numbers[at : at + 2] = [0.08, 0.0]
    assert names(*beside) == [], "the figure has moved along its rod"
    numbers[at : at + 2] = [0.0, pi / 2]
    assert names(*beside) == [], "the figure is up"


def test_an_absent_ball_is_not_between() -> None:
    thing = "{shape: cylinder, radius: 1 cm, length: 1 m, z: 70 cm, surface: walls}"
    world, layout, numbers = world_of(f"scenery={{pole: {thing}}}", "table.spare_balls=1")
    a, b = (-0.03, 0.0, 0.3), (0.03, 0.0, 0.3)
    assert world.crossings(a, b, frozenset()) == (), "before the first frame"
    world.turn_to(Frame(0, layout, np.array(numbers)))
    (pole,) = world.crossings(a, b, frozenset())
    assert pole[:2] == ("pole", UNKNOWN) and pole.chord_m == pytest.approx(0.02)
    assert world.crossings(b, a, frozenset()) == (pole,)
    numbers[layout["ball-2"].offsets["absent"]] = 0.0
    place_ball(numbers, layout["ball-2"], (0.0, 0.0, 0.3))
    world.turn_to(Frame(1, layout, np.array(numbers)))
    assert [crossing.name for crossing in world.crossings(a, b, frozenset())] == ["ball-2", "pole"]
