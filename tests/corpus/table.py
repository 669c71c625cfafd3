"""What foosim reads of public robots: `python -m tests.corpus.table` writes table.txt, which a test compares.

Each line has a file by its place in its package, and what `foosim urdf` says of it: its links, the joints that move,
its mass, the base that it proposes and how many notes it has; or why it is refused, by its first error.
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Final

from foosim.common.errors import Refused
from foosim.deployment.assets import read_robot
from foosim.world.bodies.urdf import SUFFIX, Robot
from foosim.world.bodies.urdf_base import base_of
from foosim.world.matter.mesh import MESH_SUFFIXES

HERE: Final = Path(__file__).parent
TABLE: Final = HERE / "table.txt"
EXAMPLE: Final = "example-robot-data"
PYBULLET: Final = "pybullet_data"
PUBLIC: Final = {
    EXAMPLE: (EXAMPLE, "cmeel.prefix/share/example-robot-data/robots"),
    PYBULLET: ("pybullet", "pybullet_data"),
}
"""Sets of robots on PyPI: the distribution that has each, and its folder among the installed packages."""
OWN: Final = "files"
"""Those of this folder."""
SETS: Final = (*PUBLIC, OWN)
ALIKE: Final = "random_urdfs"
"""A folder of a thousand objects, of one form."""
LIGHT_BYTES: Final = 4_000_000
"""Most files name meshes of at most as many bytes; the others take minutes."""
_MESH: Final = re.compile(r"""filename\s*=\s*["'][^"']*?([^"'/]+)["']""")


def folder_of(which: str) -> Path | None:
    """Return the folder of a set of robots, None where it is not installed."""
    if which == OWN:
        return HERE / OWN
    package, inside = PUBLIC[which]
    try:
        folder = Path(str(distribution(package).locate_file(inside)))
    except PackageNotFoundError:
        return None
    return folder if folder.is_dir() else None


def foreign_version(which: str) -> str:
    """Return in words that another version of a set is installed than `pyproject.toml` has, empty without one."""
    text = (HERE.parents[1] / "pyproject.toml").read_text(encoding="utf-8")
    for pin in tomllib.loads(text)["project"]["optional-dependencies"]["corpus"]:
        package, _, wanted = pin.partition("==")
        if package == which and folder_of(which) and (found := distribution(package).version) != wanted:
            return f"{package} {found} is installed, tests/corpus/table.txt has {wanted}"
    return ""


def files_of(which: str, folder: Path, *, is_light: bool) -> dict[str, Path]:
    """Return the light or heavy files of a set by their names in the table."""
    sizes = {path.name: path.stat().st_size for path in folder.rglob("*") if path.suffix.lower() in MESH_SUFFIXES}
    files = {}
    for path in sorted(folder.rglob(f"*{SUFFIX}")):
        names = set(_MESH.findall(path.read_text(encoding="utf-8", errors="replace")))
        place = path.relative_to(folder)
        if place.parts[0] != ALIKE and (sum(sizes.get(name, 0) for name in names) <= LIGHT_BYTES) == is_light:
            files[f"{which}/{place.as_posix()}"] = path
    return files


def lines_of(which: str, folder: Path, *, is_light: bool) -> list[str]:
    """Return the lines of the light or heavy files of a set."""
    files = files_of(which, folder, is_light=is_light)
    return [f"{name}: {found(file).replace(str(folder), which)}" for name, file in files.items()]


def found(file: Path) -> str:
    """Return what is read of a file, or why it is refused."""
    try:
        return described(read_robot(file, None))
    except Refused as error:
        first = str(error).splitlines()[0].removeprefix(f"{file.name}:")
        return f"refused, line {first}"


def described(robot: Robot) -> str:
    """Return the links, the moving joints, the mass, the proposed base and the notes of a robot."""
    counts = ((len(robot.links), "link"), (len(robot.moving), "joint"), (len(robot.notes), "note"))
    links, joints, notes = (f"{count} {what}{'' if count == 1 else 's'}" for count, what in counts)
    return f"{links}, {joints}, {robot.mass:.4g} kg, {'fixed' if base_of(robot)[0] else 'free'}, {notes}"


def table() -> dict[str, list[str]]:
    """Return the lines of the table by set, without empty ones."""
    lines = TABLE.read_text(encoding="utf-8").splitlines()
    return {which: [line for line in lines if line.startswith(f"{which}/")] for which in SETS}


def written() -> Iterator[str]:
    """Yield the lines of the table as it is now; those of a set that is not installed stay."""
    before = table() if TABLE.exists() else {}
    for which in SETS:
        folder = folder_of(which)
        if folder is None:
            print(f"{which} is not installed: its lines stay", file=sys.stderr)
        both = [] if folder is None else [lines_of(which, folder, is_light=is_light) for is_light in (True, False)]
        yield from sorted([line for lines in both for line in lines]) if both else before[which]
        yield ""


def main() -> None:
    """Write the table."""
    TABLE.write_text("\n".join(written()).rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
