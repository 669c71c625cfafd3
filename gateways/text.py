"""The gateway `text`: readings in text files, one for each sensor, byte for byte as MORSE's stream of this name.

A file is `ROBOT.COMPONENT.txt`, without dots before digits and with `_` for `/`. It begins with the mounting of the
sensor: its distance from the robot, and the unit vector towards it in the frames of the world and of the robot. A
record begins with the pose of the robot, by its newest reading of a sensor of the class Pose; `nan` without one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import hypot, nan
from os import SEEK_END
from pathlib import Path
from typing import Annotated, BinaryIO, Final

from pydantic import Field

from foosim.common.errors import Refused
from foosim.gateways.gateway import Gateway, Peer
from foosim.gateways.rows import Component, label_of
from foosim.gateways.table import POSE
from foosim.world.component_types.registry import gateway
from foosim.world.component_types.settings import GatewaySettings
from foosim.world.scene import from_rpy, rotate

RECORD: Final = (
    "==> Data at X,Y,Z: [{:.6f} {:.6f} {:.6f}]yaw,pitch,roll: [{:.6f} {:.6f} {:.6f}] | index {} | time {:.2f}\n"
)


class TextSettings(GatewaySettings):
    """Text files in `folder`, which is made where there is none. A file that exists is continued."""

    folder: Annotated[str, Field(min_length=1)] = "."


@gateway("text", TextSettings)
class Text(Gateway):
    """Readings of sensors in text files. A file that cannot be written is closed, and the log has the reason."""

    _files: dict[str, BinaryIO]
    _poses: dict[str, Component]

    async def open(self) -> str:
        """Open all files. Raises Refused."""
        folder, self._files = Path(self.settings.folder), {}
        self._poses = {one.robot: one for one in self.run.components.values() if one.row.morse == "Pose"}
        names = {full: file_of(full) for full, one in self.run.components.items() if one.is_out}
        files = sorted(names.values())
        if doubled := [name for name, other in pairwise(files) if name == other]:
            raise Refused(f"{self.run.name}: {doubled[0]} is the file of two sensors: change the label of one")
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for full, name in names.items():
                self._files[full] = (folder / name).open("ab")
        except OSError as error:
            raise Refused(f"{self.run.name}: {error.filename}: {error.strerror}") from None
        return f"{len(self._files)} files in {folder}"

    def arrived(self, component: Component) -> None:
        if component.full not in self._files:
            return  # it was closed
        file, robot = self._files[component.full], self._poses.get(component.robot)
        fields = (robot.fields if robot is not None else None) or {}
        pose = [fields.get(name, nan) for name in POSE]
        try:
            is_new = component.count == 1 and not file.seek(0, SEEK_END)
            file.write(((header_of(component, pose) if is_new else "") + record_of(component, pose)).encode())
        except OSError as error:
            self._end(component.full, error)

    def peers(self) -> Iterator[Peer]:
        yield from (Peer(file.name, full, self.run.components[full].count) for full, file in self._files.items())

    async def close(self) -> None:
        for full in [*self._files]:
            self._end(full)

    def _end(self, full: str, error: OSError | None = None) -> None:
        """Close a file, with what was to be written."""
        file = self._files.pop(full)
        try:
            file.close()
        except OSError as failed:
            error = failed
        if error is not None:
            self.log.error("%s is not written any more: %s", file.name, error.strerror)


def file_of(full: str) -> str:
    """Return the name of the file of a sensor."""
    return re.sub(r"\.([0-9]+)", r"\1", full).replace("/", "_") + ".txt"


def header_of(component: Component, pose: Sequence[float]) -> str:
    """Return how a file begins; `pose` is that of the robot."""
    x, y, z = getattr(getattr(component.settings, "at", None), "position", (0.0, 0.0, 0.0))
    distance = hypot(x, y, z)
    there = (x / distance, y / distance, z / distance) if distance else (0.0, 0.0, 0.0)
    around = rotate(from_rpy(*reversed(pose[3:])), there)
    robot = label_of(component.deployment, component.robot)
    vectors = f"({distance!r}, Vector({around!r}), Vector({there!r}))"
    return f"ROBOT {robot} || SENSOR {component.full}\n(distance, globalVector(3), localVector(3))\n{vectors}\n\n"


def record_of(component: Component, pose: Sequence[float]) -> str:
    """Return the record of the newest reading; `pose` is that of the robot."""
    time_s = component.time_ns / 1e9
    lines = [RECORD.format(*pose, component.count - 1, time_s)]
    for name, its in {"timestamp": time_s, **(component.fields or {})}.items():
        lines.append(f"\t{name} = {its:.6f}\n" if isinstance(its, float) else f"\t{name} = {its!r}\n")
    return "".join(lines)
