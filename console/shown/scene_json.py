"""A world as a page draws it, in JSON: links with their shapes, scenery, bodies, fields for plots."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Mapping
from itertools import islice
from typing import Any, Final

import numpy as np

from foosim.client.commands import CommandEncoder
from foosim.deployment.channel_kinds import joints_of
from foosim.deployment.schema import Deployment
from foosim.rendering.cameras import cameras_of
from foosim.world.assembly.world import mark_kinds
from foosim.world.component_types.payloads import PayloadCodec
from foosim.world.component_types.per_field import codec_of
from foosim.world.components.job_reading import JobSettings
from foosim.world.kinematics import CENTRE_OF_SLOT
from foosim.world.layout import Entity, Layout
from foosim.world.matter.materials import METAL
from foosim.world.matter.mesh import Mesh
from foosim.world.scene import (
    Box,
    Capsule,
    Hull,
    Scene,
    Shape,
    Sphere,
    Vector,
    drawn,
    enclosing,
    looks_of,
    shape_box,
    swept_box,
)
from foosim.world.setting.settable import settable

UNITS: Final[Mapping[str, tuple[str, ...]]] = {
    "position": ("m",),
    "orientation": ("",),
    "linear_velocity": ("m/s",),
    "angular_velocity": ("rad/s",),
    "contacts": ("", "N s", ""),
}
"""Of the numbers of fields that every model calls the same; the last one is that of all after it."""
JOINT_UNITS: Final[Mapping[str, tuple[str, str]]] = {
    "joint_positions": ("m", "rad"),
    "joint_velocities": ("m/s", "rad/s"),
    "joint_efforts": ("N", "N m"),
}
"""Of the numbers of joints that slide, and of joints that turn."""
DRIVES: Final = {"v_w": "linear", "x_y_w": "x"}
"""Actuators by which a robot is driven with keys, and the name of their speed ahead; `angular` turns it."""
NO_UNIT: Final = ("",)
TICKS: Final = ("_ticks", ("ticks",))
"""How a field of a rule's memory is called that counts ticks, and its unit."""


def scene_content(deployment: Deployment, layout: Layout, scene: Scene) -> dict[str, Any]:
    """Return the content of the message `scene` but for its source and generation."""
    meshes: dict[str, Mesh] = {}
    links: list[dict[str, Any]] = []
    bodies: list[dict[str, Any]] = []
    looks = iter(looks_of(link for body in scene.bodies.values() for link in body.links))
    for name, body in scene.bodies.items():
        first = len(links)
        for link, shapes in islice(looks, len(body.links)):
            links.append({"name": link.name, "body": name, "shapes": _shapes(shapes, meshes)})
        bodies.append(
            {
                "name": name,
                "model": body.model,
                "links": list(range(first, len(links))),
                "robot": layout[name].is_robot,
                "removable": layout[name].can_leave,
                "pushable": layout[name].is_free,
                "settable": settable(deployment, layout, layout[name]),
                "jobs": jobs_content(deployment, name),
                "drivable": bool(drive_of(deployment, name)),
            }
        )
    scenery = _shapes(drawn(scene.scenery), meshes)
    return {
        "layout": layout.digest.hex(),
        "links": links,
        "scenery": scenery,
        "bodies": bodies,
        "fields": _fields(deployment, layout, scene),
        "commands": _commands(deployment, layout),
        "sensors": _sensors(deployment),
        "cameras": [
            {"robot": robot, "channel": channel, "pictures": list(settings.pictures)}
            for (robot, channel), settings in cameras_of(deployment).items()
        ],
        "meshes": {key: _mesh(mesh) for key, mesh in meshes.items()},
        "bounds": standing_bounds(scene),
        "marks": {
            name: {"look": kind.look, "text": kind.text, "cut": kind.is_cut}
            for name, kind in sorted(mark_kinds(deployment).items())
        },
        "network": {
            "rules": [rule.id for rule in deployment.network.links],
            "endpoints": sorted(deployment.endpoints()),
        },
    }


def _shapes(shapes: Iterable[Shape], meshes: dict[str, Mesh]) -> list[dict[str, Any]]:
    """Return shapes; the meshes among them, which several may share, are added to `meshes`."""
    return [
        {
            **_geometry(shape, meshes),
            "metal": shape.radio is METAL,
            "position": shape.position,
            "orientation": shape.orientation,
            "colour": shape.colour,
            "name": shape.name,
        }
        for shape in shapes
    ]


def _geometry(shape: Shape, meshes: dict[str, Mesh]) -> dict[str, Any]:
    geometry = shape.geometry
    if isinstance(geometry, Box):
        return {"kind": "box", "half": geometry.half}
    if isinstance(geometry, Sphere):
        return {"kind": "sphere", "radius": geometry.radius}
    if isinstance(geometry, Mesh | Hull):
        mesh = geometry.mesh if isinstance(geometry, Hull) else geometry
        key = mesh.digest.hex()[:16]
        meshes[key] = mesh
        return {"kind": "mesh", "mesh": key}
    if isinstance(geometry, Capsule):
        return {"kind": "capsule", "radius": geometry.radius, "length": geometry.length}
    return {"kind": "cylinder", "radius": geometry.radius, "length": geometry.length}


def _mesh(mesh: Mesh) -> dict[str, str]:
    """Return the corners (float32) and triangles (uint32) of a mesh, little-endian, as base64."""
    return {
        "vertices": b64encode(mesh.vertices.astype("<f4").tobytes()).decode(),
        "triangles": b64encode(mesh.triangles.astype("<u4").tobytes()).decode(),
    }


def _fields(deployment: Deployment, layout: Layout, scene: Scene) -> list[dict[str, Any]]:
    """Return the runs of numbers of a frame: those of one unit, by their first index; each joint's number by itself."""
    fields = []
    for entity in layout.entities:
        body = scene.bodies.get(entity.name)
        names = {} if body is None or not body.is_free or body.links[0].is_centred else CENTRE_OF_SLOT
        commanded = {f"{channel}.set_point": codec for channel, codec in _actuators(deployment, entity.name)}
        for name, start in entity.offsets.items():
            if body is not None and name in JOINT_UNITS:
                for place, (joint, link) in enumerate(zip(body.joint_names, body.joints, strict=True)):
                    unit = JOINT_UNITS[name][link.joint != "prismatic"]
                    run = {"entity": entity.name, "field": name, "name": joint}
                    fields.append({**run, "unit": unit, "index": start + place, "count": 1})
                continue
            codec = commanded.get(name)
            units = _units(entity, name) if codec is None else tuple(field.unit for field in codec.fields)
            for place, count in _runs(entity.counts[name], len(units)):
                fields.append(
                    {
                        "entity": entity.name,
                        "field": names.get(name, name),
                        "unit": units[min(place, len(units) - 1)],
                        "index": start + place,
                        "count": count,
                    }
                )
    return fields


def _units(entity: Entity, field: str) -> tuple[str, ...]:
    """Return the units of a field's numbers, the last one for all after it; a field may have none."""
    ending, ticks = TICKS
    return entity.kind.units.get(field) or UNITS.get(field) or (ticks if field.endswith(ending) else NO_UNIT)


def _actuators(deployment: Deployment, robot: str) -> list[tuple[str, PayloadCodec]]:
    """Return the channels of a robot's actuators, and the codecs of their commands."""
    settings = deployment.robots.get(robot)
    actuators = {} if settings is None else settings.actuators
    return [(channel, codec_of(actuator.component_type)) for channel, actuator in sorted(actuators.items())]


def _commands(deployment: Deployment, layout: Layout) -> list[dict[str, Any]]:
    """Return the numbers of a frame that are set-points: an actuator's part of its last accepted command."""
    return [
        {
            "robot": entity.name,
            "channel": channel,
            "number": number,
            "unit": unit,
            "index": entity.offsets[f"{channel}.set_point"] + place,
        }
        for entity in layout.robots
        for channel, codec in _actuators(deployment, entity.name)
        if f"{channel}.set_point" in entity.offsets
        for place, (number, unit) in enumerate(_numbers(deployment, entity, channel, codec))
    ]


def _numbers(deployment: Deployment, entity: Entity, channel: str, codec: PayloadCodec) -> list[tuple[str, str]]:
    """Return what the numbers of a set-point are called, with their units: by joint where there is one for each."""
    count, joints = entity.counts[f"{channel}.set_point"], joints_of(deployment, entity.name, channel)
    if len(joints) == count and any(map(codec.is_of_joints, codec.fields)):
        unit = next(field.unit for field in codec.fields if codec.is_of_joints(field))
        return [(joint, unit) for joint in joints]
    return [(field.name, field.unit) for field in codec.fields[:count]]


def _runs(count: int, units: int) -> list[tuple[int, int]]:
    """Return the place and length of the runs of `count` numbers with a unit each."""
    runs = [(place, 1) for place in range(min(count, units) - 1)]
    return [*runs, (len(runs), count - len(runs))]


def _sensors(deployment: Deployment) -> list[dict[str, Any]]:
    """Return the sensors; those of joints with what the numbers of a reading are called, and their units."""
    found = []
    for name, robot in sorted(deployment.robots.items()):
        for channel, sensor in sorted(robot.sensors.items()):
            codec, joints = codec_of(sensor.component_type), joints_of(deployment, name, channel)
            units = [field.unit for field in codec.fields for _ in (joints if codec.is_of_joints(field) else (0,))]
            numbers = [*zip(codec.number_names(len(units), joints), units, strict=True)] if joints else []
            about = {"robot": name, "channel": channel, "kind": sensor.kind, "unit": codec.unit}
            found.append({**about, "numbers": numbers})
    return found


def standing_bounds(scene: Scene) -> tuple[Vector, Vector]:
    """Return the box around scenery and bodies on fixed bases; free bodies move within it."""
    boxes = [shape_box(shape) for shape in scene.scenery]
    boxes += [swept_box(body) for body in scene.bodies.values() if body.links[0].joint != "free"]
    boxes = [box for box in boxes if np.isfinite(box).all()]
    return enclosing(boxes) if boxes else ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))


def jobs_of(deployment: Deployment, robot: str) -> dict[str, str]:
    """Return the actuators of a robot whose jobs a sensor reports, each with that sensor's channel."""
    sensors = sorted(deployment.robots[robot].sensors.items(), reverse=True)  # of several the first by name counts
    return {its.actuator: channel for channel, its in sensors if isinstance(its, JobSettings)}


def drive_of(deployment: Deployment, entity: str) -> str:
    """Return the actuator of a robot that takes speeds of its body; empty of other entities."""
    robot = deployment.robots.get(entity)
    return next((name for name, its in robot.actuators.items() if its.kind in DRIVES), "") if robot else ""


def jobs_content(deployment: Deployment, entity: str) -> list[dict[str, Any]]:
    """Return them as pages read it, with the names of their commands' numbers; none of other entities."""
    if entity not in deployment.robots:
        return []
    encoder = CommandEncoder(deployment)
    return [
        {"actuator": actuator, "numbers": [field.name for field in encoder.actuator(entity, actuator).fields]}
        for actuator in sorted(jobs_of(deployment, entity))
    ]
