"""Sensors as deployments of format 1 had them: their noise was settings of their own."""

from collections.abc import Mapping
from typing import Final

NOISE: Final[Mapping[str, Mapping[str, tuple[str, ...]]]] = {
    "encoder": {"position_noise": ("slide",), "angle_noise": ("spin",)},
    "ball": {"noise": ("x", "y")},
    "pose": {"position_noise": ("position",), "heading_noise": ("heading",)},
    "odometry": {"noise": ("left", "right")},
    "proximity": {"noise": ("ways",)},
    "battery": {"noise": ("voltage",)},
}
"""By kind of sensor: its settings of noise, and the fields of its readings that each was of."""
