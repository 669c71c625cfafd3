"""Scans that are cast where they are read: those of the frame they were measured in, and closed forms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, radians, sin, tan
from typing import Any, Final

import numpy as np
import pytest
from msgspec import structs

from foosim.common.errors import BadValue, DeploymentError, Malformed
from foosim.deployment.assets import pin_assets
from foosim.deployment.channel_kinds import channel_codec
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.world.assembly.world import initial_numbers
from foosim.world.components.fitted import sensors_of
from foosim.world.components.sight import moving_bodies, sphere_of
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import SensingView, View
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Layout, build_layout
from foosim.world.rays.shapes import rotated
from foosim.world.scene import moved, rotate
from tests.whole_worlds import NAME, assets, yard
from tests.world.test_beam_sensors import PLACED

Text = Callable[..., str]
SCAN: Final = "kind: laser_scanner_3d, rate: 10 Hz, rows: 16, columns: 90, highest: 25 deg, least: 20 cm, range: 6 m"


def read(deployment: Deployment, layout: Layout, robot: str, numbers: Sequence[float]) -> Any:
    """Return the reading of the sensor `eye`, as a client decodes it."""
    its = sensors_of(deployment, layout, layout[robot])
    one = next(one for one in its if one.channel == "eye")
    payload = one.codec.encode(one.sample(SensingView(7, list(numbers), np.array(numbers))))
    codec = channel_codec(deployment, robot, "eye")
    assert codec is not None
    return codec.decode(payload)


def test_a_scan_is_that_of_rays_in_the_frame() -> None:
    """Of bodies of all kinds, some beyond the range; to the bit where no link is fixed to a free one. All links are
    within the spheres by which bodies are found in view."""
    where = {"scout": "at: {x: 20 cm, z: 30 cm, pitch: 10 deg}", "goer-2": "at: {z: 60 cm}, look_at: {entity: sphere}"}
    sets = [f"robots.{robot}.sensors.eye={{{SCAN}, {at}}}" for robot, at in where.items()]
    text, files = pin_assets(apply_sets(yard(), NAME, sets), NAME, assets())
    deployment = load_deployment(text, NAME).with_assets(files)
    layout = build_layout(deployment)
    rng = np.random.default_rng(3)
    directions = np.array(deployment.robots["scout"].sensors["eye"].directions)  # type: ignore[attr-defined]
    around, met = Surroundings(deployment, layout), set()
    for _ in range(6):
        numbers = initial_numbers(deployment, layout)
        for entity in layout.entities:
            for field, sigma in (("position", 1.0), ("joint_positions", 0.3)):
                at = entity.offsets.get(field, 0)
                count = entity.counts.get(field, 0) if not entity.is_absent(numbers) else 0
                numbers[at : at + count] = (np.array(numbers[at : at + count]) + rng.normal(0.0, sigma, count)).tolist()
        for looks in moving_bodies(around.bodies, layout):
            poses = forward_kinematics(looks.body, looks.entity, numbers)
            at, reach = looks.free_at, looks.radius + sum(abs(numbers[place]) for place in looks.slides)
            place = looks.place if at < 0 else numbers[at : at + 3]
            for index, _ in looks.links:
                middle, radius = sphere_of(looks.body.links[index]) or ((0.0, 0.0, 0.0), 0.0)
                there = moved(poses[index][1], rotate(poses[index][2], middle), 1.0)
                assert np.linalg.norm(np.subtract(there, place)) + radius <= reach + 1e-9
        for robot in where:
            scan = read(deployment, layout, robot, numbers)
            ways = rotated(np.array([[scan.qx], [scan.qy], [scan.qz], [scan.qw]]), directions.T).T
            starts = np.tile((scan.x, scan.y, scan.z), (len(ways), 1))
            hits = around.rays(View(7, numbers), starts, ways, 6.0, layout[robot])
            expected = np.clip(hits.distances, 0.2, 6.0).reshape(16, 90)
            assert scan.ranges() == pytest.approx(expected, abs=1e-9)
            assert (scan.ranges() == expected).mean() > 0.98
            seen = (hits.distances >= 0.2) & (hits.distances < np.inf)
            assert scan.points() == pytest.approx(directions[seen] * hits.distances[seen, None], abs=1e-9)
            met |= {around.caster.things[thing] for thing in hits.things if 0 <= thing < len(layout.entities)}
    assert len(met) > 20


def hall(text: Text, *settings: str, scenery: str = "{}") -> tuple[Deployment, Layout]:
    """Return a hall with a rover, whose scanner has these settings."""
    eye = f"robots.rover01.sensors.eye={{{SCAN}}}", *(f"robots.rover01.sensors.eye.{one}" for one in settings)
    deployment = load_deployment(text(1, *PLACED, f"scenery={scenery}", *eye), "hall.yaml")
    return deployment, build_layout(deployment)


def test_rows_rise_and_columns_go_to_the_left(fleet_text: Text) -> None:
    """Between the floor and a high wall 18 m ahead."""
    wall = "{wall: {shape: box, x: 21 m, y: 0 m, z: 10 m, length: 2 m, width: 60 m, height: 20 m}}"
    angles = "rows=5", "columns=3", "angle=40 deg", "lowest=-20 deg", "highest=20 deg"
    deployment, layout = hall(fleet_text, *angles, "range=100 m", "least=0 m", "at={z: 1 m}", scenery=wall)
    found = read(deployment, layout, "rover01", initial_numbers(deployment, layout))
    aside = [radians(angle) for angle in (-20.0, 0.0, 20.0)]
    expected = [
        [18.0 / cos(a) / cos(e) if e >= 0.0 or tan(-e) * 18.0 / cos(a) < 1.0 else 1.0 / sin(-e) for a in aside]
        for e in (radians(angle) for angle in (-20.0, -10.0, 0.0, 10.0, 20.0))
    ]
    assert found.ranges() == pytest.approx(np.array(expected))
    points = found.points()
    assert points[:6, 2] == pytest.approx([-1.0] * 6) and points[6:, 0] == pytest.approx([18.0] * 9)
    assert (np.diff(points[6:9, 1]) > 0.0).all()


def test_what_is_no_scan_is_refused(fleet_text: Text) -> None:
    for setting, message in (
        ("lowest=30 deg", "lowest is above highest"),
        ("range=15 cm", r"least is not below the range, 0\.15 m"),
    ):
        with pytest.raises(DeploymentError, match=message):
            hall(fleet_text, setting)
    deployment, layout = hall(fleet_text, "size=5 kB")
    assert deployment.robots["rover01"].sensors["eye"].carried_bytes == 5000
    its = sensors_of(deployment, layout, layout["rover01"])
    numbers = initial_numbers(deployment, layout)
    alone = next(one for one in its if one.channel == "eye").sample(SensingView(0, numbers, np.array(numbers)))
    with pytest.raises(BadValue, match="drawn from the samples of players, clients and captures"):
        alone.ranges()
    scan = read(deployment, layout, "rover01", numbers)
    changed = structs.replace(scan, bodies=(99.0, *scan.bodies[1:8]))
    changed.kept["drawn_by"] = scan.kept["drawn_by"]
    with pytest.raises(Malformed, match="numbers of bodies are 0 to"):
        changed.points()
