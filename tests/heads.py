"""A head on a neck: two joints, of which the second hangs on the first, as robots from a file."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, Final

EYE_M: Final = (0.1, 0.05)
"""How far the eye is ahead of the axis of tilt, and above it."""
TILT_M: Final = 0.6
"""The height of the axis of tilt, above that of pan."""
HEAD: Final = f"""<robot name="head">
  <link name="foot"><inertial><mass value="20"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>
  <link name="neck">
    <inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>
    <collision><geometry><box size="0.08 0.08 0.2"/></geometry></collision>
  </link>
  <link name="skull">
    <inertial><origin xyz="0.05 0 0"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>
    <collision><geometry><box size="0.2 0.1 0.1"/></geometry></collision>
  </link>
  <link name="eye"/>
  <joint name="pan" type="revolute">
    <parent link="foot"/><child link="neck"/><origin xyz="0 0 0.4"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="40" velocity="4"/>
  </joint>
  <joint name="tilt" type="revolute">
    <parent link="neck"/><child link="skull"/><origin xyz="0.05 0 0.2"/><axis xyz="0 1 0"/>
    <limit lower="-1.2" upper="1.2" effort="40" velocity="4"/>
  </joint>
  <joint name="front" type="fixed">
    <parent link="skull"/><child link="eye"/><origin xyz="{EYE_M[0]} 0 {EYE_M[1]}"/>
  </joint>
</robot>
"""


@cache
def folder() -> Path:
    """Return a folder with the file of the head in its folder `models`, and of one whose tilt looks up."""
    made = Path(mkdtemp())
    (made / "models").mkdir()
    (made / "models" / "head.urdf").write_text(HEAD)
    (made / "models" / "upward.urdf").write_text(HEAD.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 -1 0"/>'))
    return made


def head(kind: str, place: dict[str, str], **settings: Any) -> dict[str, Any]:
    """Return one on the floor whose actuator `go` is of a kind."""
    return {
        "model": "urdf",
        "file": "head.urdf",
        "fixed": True,
        "at": place,
        "actuators": {"go": {"kind": kind, **settings}},
    }
