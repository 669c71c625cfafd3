"""Cameras: what is in their view, where they look, what a semantic camera sees, and settings that are refused."""

from __future__ import annotations

from functools import cache
from itertools import product
from typing import Any, Final

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from foosim.common.errors import BadValue, DeploymentError, Malformed
from foosim.deployment.channel_kinds import channel_codec
from foosim.deployment.schema import Deployment
from foosim.world.assembly.world import initial_numbers
from foosim.world.components import cameras
from foosim.world.components.cameras import towards
from foosim.world.components.fitted import sensors_of
from foosim.world.components.sight import Sight, moving_bodies
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import SensingView
from foosim.world.layout import build_layout
from foosim.world.scene import rotate
from tests.deployed import deployed

EYE = "robots.camera.sensors.eye"
ABOVE = "at: {z: 1.2 m, pitch: 90 deg}"
UP = (*[0.0] * 6, 1.0)
WAYS = st.tuples(*[st.floats(-100.0, 100.0)] * 3).filter(lambda way: max(map(abs, way)) > 1e-6)


@cache
def with_eye(settings: str, *sets: str) -> Deployment:
    return deployed(f"{EYE}={{rate: 50 Hz, {settings}}}", *sets)


def moved(deployment: Deployment) -> list[float]:
    """Return the numbers of a frame in which rods are turned and move."""
    layout = build_layout(deployment)
    numbers = initial_numbers(deployment, layout)
    for place, rod in enumerate(entity for entity in layout.entities if entity.model == "rod"):
        at, speeds = (rod.offsets[name] for name in ("joint_positions", "joint_velocities"))
        numbers[at : at + 2] = [0.01 * place - 0.03, 0.2 * place - 0.5]
        numbers[speeds : speeds + 2] = [0.5, 20.0]
    return numbers


def reading(deployment: Deployment, numbers: list[float], robot: str = "camera", channel: str = "eye") -> Any:
    """Return the reading of a sensor, as it is received."""
    layout = build_layout(deployment)
    (one,) = [one for one in sensors_of(deployment, layout, layout[robot]) if one.channel == channel]
    codec = channel_codec(deployment, robot, channel)
    assert codec is not None
    return codec.decode(one.codec.encode_checked(one.sample(SensingView(7, numbers))))


def everything(deployment: Deployment, numbers: list[float], sight: Sight) -> Sight:
    """Return a reading with all moving bodies that are present instead of those in view."""
    layout = build_layout(deployment)
    bodies: list[float] = []
    for number, looks in enumerate(moving_bodies(Surroundings(deployment, layout).bodies, layout)):
        if not looks.entity.is_absent(numbers):
            bodies += [float(number), *(one for first, end in looks.pose for one in numbers[first:end])]
    assert len(sight.bodies) < len(bodies)
    found = structs.replace(sight, bodies=tuple(bodies))
    found.kept["drawn_by"] = sight.kept["drawn_by"]
    return found


@pytest.mark.parametrize(
    "view",
    [
        "at: {x: 30 cm, z: 40 cm, pitch: 70 deg}",
        "at: {x: -1 m, z: 60 cm, pitch: 40 deg}, fov: 12 deg",
        "at: {y: -50 cm, z: 50 cm}, look_at: {x: 40 cm}, fov: 15 deg, width: 40, height: 90",
        "at: {x: 30 cm, z: 50 cm, pitch: 70 deg}, fov: 50 deg, distortion: {k1: -0.2, p1: 0.01}",
    ],
)
def test_a_picture_of_what_is_in_view_is_that_of_all_that_moves(view: str) -> None:
    """Absent balls are in neither. The first look draws, further ones do not, nor does one that is decoded again."""
    deployment = with_eye(f"kind: rgbd, {view}")
    numbers = moved(deployment)
    sight = reading(deployment, numbers)
    pictures = sight.kept["drawn_by"]
    whole, drawn = everything(deployment, numbers, sight), pictures.draws
    assert np.array_equal(sight.image(), whole.image()) and np.array_equal(sight.depth(), whole.depth())
    assert len(np.unique(sight.image())) > 5 and pictures.draws == drawn + 2
    sight.image()
    again = reading(deployment, numbers)
    again.image(), reading(deployment, numbers).depth()
    assert pictures.draws == drawn + 3


def test_bodies_have_velocities_where_they_blur() -> None:
    deployment = with_eye(f"kind: camera, {ABOVE}, exposure: 10 ms")
    sight, sharp = (reading(one, moved(one)) for one in (deployment, with_eye(f"kind: camera, {ABOVE}")))
    ball, rods = sight.bodies[:14], np.array(sight.bodies[14:]).reshape(8, 5)
    assert ball[:8] == sharp.bodies[:8] and np.array_equal(rods[:, :3].ravel(), sharp.bodies[8:])
    assert (rods[:, 3:] == (0.5, 20.0)).all()
    assert not np.array_equal(sight.image(), sharp.image())


def test_a_body_is_in_view_while_it_blurs_into_it() -> None:
    """Of a ball that has left the view by 15 cm within an exposure of 10 ms, and of a slower one."""
    deployment = with_eye("kind: camera, at: {x: 5 m, z: 1 m, pitch: 90 deg}, fov: 10 deg, exposure: 10 ms")
    layout = build_layout(deployment)
    numbers = moved(deployment)
    at = layout["ball"].offsets["position"]
    numbers[at : at + 3] = [5.0, 0.25, 0.5]
    seen = []
    for speed in (25.0, 5.0):
        numbers[layout["ball"].offsets["linear_velocity"] + 1] = speed
        seen.append(len(reading(deployment, numbers).bodies))
    assert seen == [14, 0]


def test_bodies_beside_the_view_throw_shadows_into_it() -> None:
    view = "at: {x: -80 cm, z: 40 cm, pitch: 90 deg}, fov: 10 deg"
    bare, shaded = (with_eye(f"kind: camera, {view}, shadows: {on}") for on in ("false", "true"))
    numbers = moved(bare)
    assert len(reading(bare, numbers).bodies) < len(reading(shaded, numbers).bodies) == 8 + 8 * 3


def test_a_camera_inside_of_a_body_draws() -> None:
    numbers = moved(with_eye(f"kind: rgbd, {ABOVE}"))
    sight = reading(with_eye("kind: rgbd, at: {z: 17.5 mm}"), numbers)
    assert sight.image().shape == (180, 320, 3) and sight.depth().dtype == np.float32


@given(WAYS)
def test_a_camera_looks_along_the_way_to_its_target_and_stays_level(way: tuple[float, float, float]) -> None:
    turned = towards(way)
    ahead, left = rotate(turned, (1.0, 0.0, 0.0)), rotate(turned, (0.0, 1.0, 0.0))
    length = float(np.linalg.norm(way))
    assert np.allclose(ahead, np.array(way) / length, atol=1e-12) and abs(left[2]) < 1e-15
    assert rotate(turned, (0.0, 0.0, 1.0))[2] >= -1e-15


def test_a_camera_follows_an_entity_and_keeps_its_mount_while_that_is_absent() -> None:
    deployment = with_eye("kind: camera, at: {x: 1 m, z: 1 m}, look_at: {entity: ball-2, z: 1 m}")
    numbers = moved(deployment)
    assert reading(deployment, numbers).qw == 1.0
    ball = build_layout(deployment)["ball-2"]
    numbers[ball.offsets["absent"]] = 0.0
    at = ball.offsets["position"]
    numbers[at : at + 7] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    sight = reading(deployment, numbers)
    assert rotate((sight.qx, sight.qy, sight.qz, sight.qw), (1.0, 0.0, 0.0)) == (-1.0, 0.0, 0.0)


def test_a_segmentation_has_names_and_kinds_of_pictures_are_those_of_the_camera() -> None:
    deployment = with_eye(f"kind: segmentation, {ABOVE}, width: 64, height: 36")
    sight = reading(deployment, moved(deployment))
    assert not sight.segmentation().flags.writeable  # readers share it
    seen = {sight.names[number - 1] for number in np.unique(sight.segmentation()) if number}
    assert {"blue.attack", "ball"} <= seen and "ball-2" not in seen
    with pytest.raises(BadValue, match=r"segmentation eye of camera has segmentation\(\) alone, 'image'"):
        sight.image()
    with pytest.raises(BadValue, match="samples of players, clients and captures alone"):
        Sight(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, ()).image()


@pytest.mark.parametrize(
    "bodies", [(), (1e9, *UP), (0.5, *UP), (0.0,), (-1.0, *UP), (0.0, *[0.0] * 7), (0.0, *UP, 1.0, 0.0)]
)
def test_a_reading_that_the_network_has_changed_is_malformed(bodies: tuple[float, ...]) -> None:
    codec = channel_codec(with_eye(f"kind: camera, noise: 1, {ABOVE}"), "camera", "eye")
    assert codec is not None
    tick = 0.0 if bodies else 1e300
    changed = codec.decode(codec.encode(Sight(tick, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, bodies)))
    with pytest.raises(Malformed):
        changed.image()


TAGGED: Final = "robots.red.goal.tags=[rod]"
REFUSED = {
    "kind: camera, width: 100000": "eye.width: more than the most that is valid, 1280, 100000",
    "kind: camera, height: 961": "eye.height: more than the most that is valid, 960, 961",
    "kind: depth_camera, samples: 2": "unknown key",
    "kind: camera, fov: 60 deg, focal_length: 25 mm": "both fov and focal_length",
    "kind: camera, focal_length: 10 m": "the angle of view would be 0.183346 deg, not 1 to 170 deg",
    "kind: camera, near: 2 m, far: 1 m": "near is not below far, 1 m",
    "kind: camera, look_at: {entity: bal}": "eye.look_at.entity: no entity with a body, 'bal', nearest is 'ball'",
    "kind: camera, at: {link: spin}": "eye.at.link: camera has no body",
    "kind: camera, modifiers: [{kind: gaussian_noise, std: 1}]": "a modifier changes numbers alone",
    "kind: semantic_camera, tag: rod, look_at: {entity: rat}": "no entity with a body",
}


@pytest.mark.parametrize("settings", REFUSED)
def test_settings_that_cannot_be_are_refused(settings: str) -> None:
    with pytest.raises(DeploymentError) as error:
        with_eye(settings, TAGGED)
    assert REFUSED[settings] in str(error.value).replace("robots.camera.sensors.", "")


@pytest.mark.parametrize(
    "kind", ["rgbd", "semantic_camera, tag: rod", "laser_scanner_3d, rows: 1, columns: 2, range: 1 m"]
)
def test_settings_are_checked_before_the_files_of_the_scenery_are_read(kind: str) -> None:
    with_eye(f"kind: {kind}", TAGGED, "scenery={wedge: {shape: mesh, file: wedge.obj}}")


def test_more_moving_bodies_than_a_packet_takes_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten balls have 80 numbers, 140 with an exposure, and 8 rods 24 or 40."""
    monkeypatch.setattr(cameras, "NUMBERS_MAX", 104)
    with_eye(f"kind: rgbd, width: 11, {ABOVE}", "table.spare_balls=9")
    for most, blurred in ((103, ""), (179, ", exposure: 1 ms")):
        monkeypatch.setattr(cameras, "NUMBERS_MAX", most)
        what = f"takes {most} numbers, and all 18 moving bodies of this world, which may be in view, have {most + 1}; f"
        with pytest.raises(DeploymentError, match=what):
            with_eye(f"kind: rgbd, {ABOVE}{blurred}", "table.spare_balls=9")


@pytest.mark.parametrize(
    ("place", "hidden", "seen"),
    [
        ("z: 1 m, pitch: 90 deg", False, [True]),
        ("z: -1 m, pitch: -90 deg", False, []),
        ("z: -1 m, pitch: -90 deg", True, [False]),
        ("z: 1 m, pitch: -90 deg", True, []),
    ],
)
def test_a_semantic_camera_sees_what_a_ray_reaches(place: str, hidden: bool, seen: list[bool]) -> None:
    """From below, the floor hides the rod."""
    settings = (
        f"kind: semantic_camera, tag: keeper, fov: 10 deg, at: {{x: -522 mm, {place}}}, hidden: {str(hidden).lower()}"
    )
    deployment = with_eye(settings, "robots.red.goal.tags=[keeper]")
    found = reading(deployment, moved(deployment)).objects
    assert [one.visible for one in found] == seen
    for one in found:
        ahead, left, up = one.position
        assert one.name == "red.goal" and one.distance == pytest.approx(np.linalg.norm(one.position))
        assert (abs(ahead), left, up) == pytest.approx((0.916 if "z: 1" in place else 1.084, left, 0.0))


def test_sizes_follow_the_pixels() -> None:
    sizes = {}
    for kind, more in product(("camera", "depth_camera", "segmentation", "rgbd"), ("", ", size: 9 kB")):
        settings: Any = with_eye(f"kind: {kind}, {ABOVE}{more}").robots["camera"].sensors["eye"]
        sizes[kind, more] = settings.carried_bytes
    assert [size for (_, more), size in sizes.items() if not more] == [20160, 57600, 2880, 77760]
    assert {size for (_, more), size in sizes.items() if more} == {9000}
