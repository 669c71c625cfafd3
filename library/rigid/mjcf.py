"""A robot from an MJCF file, as MuJoCo Menagerie has them: rigid links and joints, on a base that is fixed or free."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator

from foosim.common.errors import BadValue
from foosim.common.units import custom_error
from foosim.library.rigid.urdf import Urdf, UrdfRobot, slots_of
from foosim.world.bodies.urdf import MJCF
from foosim.world.component_types.registry import model
from foosim.world.scenery import AssetPath


def _mjcf_path(path: str) -> str:
    if not path.endswith(MJCF):
        raise custom_error(BadValue(f"no MJCF file, which ends with {MJCF}", path))
    return path


MjcfPath = Annotated[AssetPath, AfterValidator(_mjcf_path)]


class MjcfRobot(UrdfRobot):
    """A robot from an MJCF file in the asset folder, with one tree of bodies: `at` is the pose of its first body.

    The other settings are those of `urdf`. Actuators and sensors of the file are passed over, but for their forces.
    """

    file: MjcfPath


@model("mjcf", MjcfRobot, slots=slots_of, is_rigid=True)
class Mjcf(Urdf):
    """A robot from an MJCF file; its joints start where the file has them, or at the limit that is nearest to it."""
