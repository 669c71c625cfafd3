"""Limits of the state of a rigid body of any kind after a tick: a state beyond them is a failure of its engine.

Speed alone is no failure below `SPEED_MAX_M_S`: a body that falls from high, or is hit, is faster than its model
promises. Its volume grows with its speed, so within a tick it meets only bodies of its island.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, sqrt
from typing import Final, NamedTuple

from foosim.world.assembly.volumes import radius_of, reach_speed
from foosim.world.assembly.world import build_scene
from foosim.world.layout import Entity, Layout
from foosim.world.scene import Body
from foosim.world.spec import WorldSpec

SPEED_MAX_M_S: Final = 1000.0
WORLD_MAX_M: Final = 100e3
"""The greatest coordinate of a free body, as of a place in a deployment (m)."""
STOP_DEPTH_M: Final = 0.02
STOP_DEPTH_RAD: Final = 0.1
"""The tolerance of a joint beyond its limits: its stops give way a little."""
ROUNDING: Final = 1.000001


class _Limits(NamedTuple):
    """Of a body: its promise of a speed (m/s), how far a part is from its centre of mass (m), and its joints: name,
    least and greatest position."""

    speed_limit: float
    radius: float
    joints: tuple[tuple[str, float, float], ...]


class BodyLimits:
    """The limits of the rigid bodies of a layout whose joints couple."""

    def __init__(self, spec: WorldSpec, layout: Layout) -> None:
        self._tick_s = spec.tick_ns / 1e9
        rigid = [entity for entity in layout.entities if entity.is_rigid and entity.kind.couples]
        bodies = build_scene(spec, layout).bodies if rigid else {}
        self._limits = {entity.index: _limits_of(bodies[entity.name]) for entity in rigid}

    def __bool__(self) -> bool:
        return bool(self._limits)

    def __contains__(self, index: int) -> bool:
        return index in self._limits

    def problem(self, entity: Entity, numbers: Sequence[float], before: Sequence[float]) -> str:
        """Return in words why an entity's new, finite state is invalid; empty for a valid one."""
        its = self._limits.get(entity.index)
        if its is None:
            return ""
        at = entity.offsets.get("joint_positions", 0)
        for (name, low, high), position in zip(its.joints, numbers[at : at + len(its.joints)], strict=True):
            if not low <= position <= high:
                return f"its joint {name} is at {position:.4g}, {low:.4g} to {high:.4g} is valid"
        return self._problem_of_base(entity, its, numbers, before) if "position" in entity.offsets else ""

    def _problem_of_base(self, entity: Entity, its: _Limits, numbers: Sequence[float], before: Sequence[float]) -> str:
        at = entity.offsets["position"]
        x, y, z = numbers[at : at + 3]
        a, b, c = before[at : at + 3]
        farthest = max(abs(x), abs(y), abs(z))
        if farthest > WORLD_MAX_M:
            return f"it is {farthest:.4g} m from the origin along an axis, the world ends at {WORLD_MAX_M:g} m"
        speed = speed_of(entity, its.radius, numbers)
        if speed > SPEED_MAX_M_S:
            return f"a part of it moves at up to {speed:.6g} m/s, at most {SPEED_MAX_M_S:g} m/s are computed"
        way = sqrt((x - a) * (x - a) + (y - b) * (y - b) + (z - c) * (z - c))
        reach = reach_speed(its.speed_limit, speed_of(entity, its.radius, before)) * self._tick_s
        if way > reach * ROUNDING:
            return f"it went {way:.4g} m in a tick, at most {reach:.4g} m (speed_limit {its.speed_limit:g} m/s)"
        return ""


def speed_of(entity: Entity, radius: float, numbers: Sequence[float]) -> float:
    """Return a bound of the speed of any part of a free body (m/s): |v| + |w| x radius."""
    at, spin = entity.offsets["linear_velocity"], entity.offsets["angular_velocity"]
    x, y, z = numbers[at : at + 3]
    a, b, c = numbers[spin : spin + 3]
    return sqrt(x * x + y * y + z * z) + sqrt(a * a + b * b + c * c) * radius


def _limits_of(body: Body) -> _Limits:
    joints = []
    for name, link in zip(body.joint_names, body.joints, strict=True):
        depth = STOP_DEPTH_M if link.joint == "prismatic" else STOP_DEPTH_RAD
        low, high = (-inf, inf) if link.joint == "continuous" else link.limits
        joints.append((name, low - depth, high + depth))
    return _Limits(body.speed_limit, radius_of(body) if body.is_free else 0.0, tuple(joints))
