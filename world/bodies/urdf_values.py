"""Values in a URDF: numbers, vectors, poses and names, each within its bounds; lengths in m, angles in rad.

Source of the format: the XML specification of URDF at wiki.ros.org/urdf/XML.
"""

from __future__ import annotations

import re
from math import inf, sqrt
from typing import Final, NamedTuple

from foosim.world.bodies.xml_tree import Element
from foosim.world.scene import ORIGIN, UPRIGHT, Quaternion, Vector, from_rpy

EXTENT_MIN_M: Final = 1e-4
EXTENT_MAX_M: Final = 1e3
ANGLE_MAX_RAD: Final = 1e3
NUMBER_MAX: Final = 1e9
NAME_LENGTH_MAX: Final = 256
_NUMBER: Final = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_NUMBER_LENGTH_MAX: Final = 40


class Placed(NamedTuple):
    """A pose in a frame around it."""

    position: Vector
    orientation: Quaternion


UNMOVED: Final = Placed(ORIGIN, UPRIGHT)


def name_of(element: Element) -> str:
    """Return the name of a link or joint, as it is written: any printable characters, also / and spaces."""
    name = text_of(element, "name")
    if not name.strip():
        raise element.error(f"{element.tag} with an empty name")
    if len(name) > NAME_LENGTH_MAX or not name.isprintable():
        raise element.error(f"a name has at most {NAME_LENGTH_MAX} characters, none of control", name)
    return name


def text_of(element: Element, key: str) -> str:
    """Return a required attribute."""
    text = element.attributes.get(key)
    if text is None:
        raise element.error(f"{element.tag} without {key}")
    return text


def number_of(element: Element, key: str, low: float, high: float, default: float | None = None) -> float:
    """Return an attribute that is a number within bounds."""
    if default is not None and key not in element.attributes:
        return default
    value = _number(element, key, text_of(element, key))
    if not low <= value <= high:
        raise element.error(f"{key} of {element.tag} is not within {low:g} to {high:g}", element.attributes[key])
    return value


def vector_of(element: Element, key: str, most: float, default: Vector | None = None) -> Vector:
    """Return an attribute that is three numbers, none of which is farther than `most` from 0."""
    if default is not None and key not in element.attributes:
        return default
    words = text_of(element, key).split()
    if len(words) != 3:
        raise element.error(f"{key} of {element.tag} has {len(words)} numbers, it has 3", element.attributes[key])
    x, y, z = (_number(element, key, word) for word in words)
    if max(abs(x), abs(y), abs(z)) > most:
        raise element.error(f"{key} of {element.tag} is not within -{most:g} to {most:g}", element.attributes[key])
    return x, y, z


def placed_by(element: Element) -> Placed:
    """Return the pose of the origin in an element: turned about fixed x (roll), then y (pitch), then z (yaw), or by a
    quaternion."""
    origin = element.one_of("origin")
    if origin is None:
        return UNMOVED
    position = vector_of(origin, "xyz", EXTENT_MAX_M, ORIGIN)
    if "quat_xyzw" in origin.attributes:
        return Placed(position, _quaternion_of(origin))
    roll, pitch, yaw = vector_of(origin, "rpy", ANGLE_MAX_RAD, ORIGIN)
    return Placed(position, UPRIGHT if roll == pitch == yaw == 0.0 else from_rpy(roll, pitch, yaw))


def _quaternion_of(origin: Element) -> Quaternion:
    words = origin.attributes["quat_xyzw"].split()
    x, y, z, w = parts = [_number(origin, "quat_xyzw", word) for word in words] if len(words) == 4 else (0.0,) * 4
    length = sqrt(sum(part * part for part in parts))
    if "rpy" in origin.attributes or length == 0.0:
        raise origin.error("an origin has rpy, or a quaternion of 4 numbers, one of them not 0", " ".join(words))
    return x / length, y / length, z / length, w / length


def _number(element: Element, key: str, text: str) -> float:
    """Return a number; the texts `nan`, `inf` and `1_0`, which Python reads, are refused."""
    word = text.strip()
    if len(word) > _NUMBER_LENGTH_MAX or not _NUMBER.fullmatch(word):
        raise element.error(f"{key} of {element.tag} is not a finite number", text)
    value = float(word)
    if not abs(value) < inf:
        raise element.error(f"{key} of {element.tag} is not a finite number", text)
    return value + 0.0  # -0.0 is 0.0
