"""Where the file of a mesh is that a robot's file names as `package://PACKAGE/PATH`: folders are searched for it.

ROS finds packages by an index of its installations, which another machine has not. Here a package is a folder of its
name: in the asset folder, around the robot's file in there, or above the asset folder. Then comes the package that the
robot's file is in, whatever its folder is called, and last a folder around the file whose name is in the path: of a
package of which a part was copied, that is the part. No link is followed (`read_files`), and only a mesh is looked for.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from foosim.deployment.text.files import AbsentFile, read_files
from foosim.world.scenery import path_problem

ABOVE_MAX: Final = 5
"""The count of folders above the asset folder in which a package is looked for."""


def read_mesh_file(folder: Path, assets: str, robot: str, mesh: str, bytes_max: int, *, packaged: bool) -> bytes:
    """Return the content of a mesh's file that the robot's file `robot` names, by its package or not.

    Paths are those inside the asset folder `assets` of a folder. Raises AssetError, AbsentFile where there is none.
    """
    absent: AbsentFile | None = None
    for root, inside, path in _places(folder, assets, robot, mesh) if packaged else [(folder, assets, mesh)]:
        if absent and path_problem(path):
            continue  # nothing is read so deep
        try:
            return read_files(root, inside, [path], bytes_max=bytes_max)[path]
        except AbsentFile as error:
            absent = absent or error
    assert absent is not None
    top = [*(folder / assets).resolve().parents][:ABOVE_MAX][-1:]
    around = f", around {robot}, and in the folders above up to {top[0]}" if packaged and top else ""
    parts = ", by the whole path, or by what comes after a folder's name in it" if around else ""
    raise AbsentFile(f"{absent}{around}{parts}")


def _places(folder: Path, assets: str, robot: str, mesh: str) -> Iterator[tuple[Path, str, str]]:
    """Yield a folder, the asset folder in it, and the path in there, of each place where a mesh may be."""
    around = robot.split("/")[:-1]
    inner = ["".join(f"{name}/" for name in around[:depth]) for depth in range(len(around), 0, -1)]
    above = [*(folder / assets).resolve().parents][:ABOVE_MAX]
    yield folder, assets, mesh
    yield from [(folder, assets, ancestor + mesh) for ancestor in inner]
    yield from [(parent, ".", mesh) for parent in above]
    inside = mesh.partition("/")[2] or mesh
    yield from [(folder, assets, ancestor + inside) for ancestor in (*inner, "")]
    yield from [(parent, ".", inside) for parent in above if (parent / "package.xml").is_file()]
    named = [(folder, assets, ancestor, ancestor.rstrip("/").rpartition("/")[2]) for ancestor in inner]
    named.append((folder, assets, "", (folder / assets).resolve().name))
    named += [(parent, ".", "", parent.name) for parent in above]
    parts = mesh.split("/")
    for root, place, ancestor, name in named:
        tails = ["/".join(parts[number + 1 :]) for number, part in enumerate(parts[:-1]) if part == name]
        yield from [(root, place, ancestor + tail) for tail in tails]
