"""A world as a page draws it, in JSON, said once for each layout: links with their shapes, scenery, bodies, what can be
plotted and added.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Mapping
from typing import Any, Final

import numpy as np

from foosim.deployment.schema import Deployment
from foosim.world.initial_state import kickoff_spot
from foosim.world.layout import ADDABLE, BALL, Layout
from foosim.world.mesh import Mesh
from foosim.world.payloads import COMMANDS
from foosim.world.scene import Box, Scene, Shape, Sphere, Vector, enclosing, shape_box, swept_box
from foosim.world.spec import Sensor

UNITS: Final[Mapping[str, tuple[str, ...]]] = {
    "position": ("m",),
    "orientation": ("",),
    "linear_velocity": ("m/s",),
    "angular_velocity": ("rad/s",),
    "joint_positions": ("m", "rad"),
    "joint_velocities": ("m/s", "rad/s"),
    "contacts": ("", "N s", ""),
    "heading": ("rad",),
    "wheel_speeds": ("m/s",),
    "wheel_travel": ("m",),
    "charge": ("J",),
    "still_ticks": ("ticks",),
    "out_ticks": ("ticks",),
    "wait_ticks": ("ticks",),
}
"""Of a field's numbers; the last one stands for all behind it. What is not here has no unit."""
SET_POINT_UNITS: Final[Mapping[str, tuple[str, ...]]] = {"rod": ("m", "rad"), "rover": ("m/s",)}
"""Units of `set_point`, by model."""
READING_UNITS: Final[Mapping[str, str]] = {
    "encoder": "m, rad",
    "ball": "m",
    "pose": "m, rad",
    "odometry": "m",
    "proximity": "m",
    "battery": "V",
}


def scene_content(deployment: Deployment, layout: Layout, scene: Scene) -> dict[str, Any]:
    """Return the content of the message `scene` but for its source and generation."""
    meshes: dict[str, Mesh] = {}
    links: list[dict[str, Any]] = []
    bodies: list[dict[str, Any]] = []
    added = set(layout.names) - {*deployment.robots, BALL}
    for name, body in scene.bodies.items():
        first = len(links)
        links += [{"name": link.name, "body": name, "shapes": _shapes(link.shapes, meshes)} for link in body.links]
        is_free = body.model in ADDABLE
        bodies.append(
            {
                "name": name,
                "model": body.model,
                "links": list(range(first, len(links))),
                "removable": is_free and name in added,
                "pushable": is_free,
            }
        )
    scenery = _shapes(scene.scenery, meshes)
    return {
        "layout": layout.digest.hex(),
        "links": links,
        "scenery": scenery,
        "bodies": bodies,
        "fields": _fields(layout),
        "commands": _commands(layout),
        "sensors": _sensors(deployment),
        "meshes": {key: _mesh(mesh) for key, mesh in meshes.items()},
        "bounds": standing_bounds(scene),
        "addable": _addable(deployment),
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
    if isinstance(geometry, Mesh):
        key = geometry.digest.hex()[:16]
        meshes[key] = geometry
        return {"kind": "mesh", "mesh": key}
    return {"kind": "cylinder", "radius": geometry.radius, "length": geometry.length}


def _mesh(mesh: Mesh) -> dict[str, str]:
    """Return the corners (float32) and triangles (uint32) of a mesh, little-endian, as base64."""
    return {
        "vertices": b64encode(mesh.vertices.astype("<f4").tobytes()).decode(),
        "triangles": b64encode(mesh.triangles.astype("<u4").tobytes()).decode(),
    }


def _fields(layout: Layout) -> list[dict[str, Any]]:
    """Return the runs of numbers of a frame: those of one unit, by their first index."""
    fields = []
    for entity in layout.entities:
        ends = [*list(entity.offsets.values())[1:], entity.stop]
        for (name, start), end in zip(entity.offsets.items(), ends, strict=True):
            units = SET_POINT_UNITS.get(entity.model, ("",)) if name == "set_point" else UNITS.get(name, ("",))
            for place, count in _runs(end - start, len(units)):
                fields.append(
                    {
                        "entity": entity.name,
                        "field": name,
                        "unit": units[min(place, len(units) - 1)],
                        "index": start + place,
                        "count": count,
                    }
                )
    return fields


def _commands(layout: Layout) -> list[dict[str, Any]]:
    """Return the numbers of a frame that are set-points: what an actuator holds of the last command that it took."""
    found = []
    for entity in layout.robots:
        if entity.model in COMMANDS:
            channel, command = COMMANDS[entity.model]
            units = SET_POINT_UNITS[entity.model]
            for place, name in enumerate(command._fields):
                unit, index = units[min(place, len(units) - 1)], entity.offsets["set_point"] + place
                found.append({"robot": entity.name, "channel": channel, "number": name, "unit": unit, "index": index})
    return found


def _runs(count: int, units: int) -> list[tuple[int, int]]:
    """Return the place and length of the runs of so many numbers that have a unit each."""
    runs = [(place, 1) for place in range(min(count, units) - 1)]
    return [*runs, (len(runs), count - len(runs))]


def _sensors(deployment: Deployment) -> list[dict[str, str]]:
    found: list[dict[str, str]] = []
    for name, robot in sorted(deployment.robots.items()):
        sensors: Mapping[str, Sensor] = robot.sensors
        for channel, sensor in sorted(sensors.items()):
            kind = sensor.kind
            found.append({"robot": name, "channel": channel, "kind": kind, "unit": READING_UNITS[kind]})
    return found


def standing_bounds(scene: Scene) -> tuple[Vector, Vector]:
    """Return the box around what stands; bodies that are free move within it."""
    boxes = [shape_box(shape) for shape in scene.scenery]
    boxes += [swept_box(body) for body in scene.bodies.values() if body.links[0].joint != "free"]
    boxes = [box for box in boxes if np.isfinite(box).all()]
    return enclosing(boxes) if boxes else ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))


def _addable(deployment: Deployment) -> list[dict[str, Any]]:
    """Return what can be added, and where and how fast it is where nothing else is said."""
    if deployment.is_hall:
        return []
    return [{"model": model, "position": kickoff_spot(deployment), "velocity": (0.0, 0.0, 0.0)} for model in ADDABLE]
