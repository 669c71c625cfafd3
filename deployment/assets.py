"""The files that a deployment refers to, pinned: they are read once, and their digests go into the deployment's text.

Those of scenery, links and robots, and what a robot's file names in turn. They are in the deployment's asset folder,
which is that of its own file, or the one inside it that `assets:` names; a mesh of a package may be elsewhere
(`packages`). A visual mesh is read in drawn form only.
"""

from __future__ import annotations

import posixpath
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path

from foosim.common import limits
from foosim.common.finding import Finding, Location
from foosim.common.names import nearest_name
from foosim.deployment.loader import apply_sets, check_complete, load_deployment, refuse_findings
from foosim.deployment.network.traces import file_settings
from foosim.deployment.packages import read_mesh_file
from foosim.deployment.schema import Deployment
from foosim.deployment.text.files import AbsentFile, read_files
from foosim.world.bodies.findings import BadRobot, listed
from foosim.world.bodies.urdf import MJCF, SUFFIX, Robot, is_packaged, meshes_of, place_of_mesh, read_urdf
from foosim.world.bodies.urdf_links import MISSING
from foosim.world.bodies.visual_meshes import drawn_content, undrawn_content, undrawn_path
from foosim.world.bodies.xml_tree import read_xml
from foosim.world.matter.mesh import AssetError, digest_of
from foosim.world.scenery import SceneryMesh


def asset_folder(file: Path) -> Path:
    """The folder nearest to a robot's file with all meshes that it names by relative paths. Raises AssetError."""
    robot = read_xml(file.name, read_files(file.parent, ".", [file.name])[file.name])
    meshes, key, within = robot.below("mesh"), "filename", ""
    if file.suffix == MJCF:
        key = "file"
        for compiler in robot.all_of("compiler"):
            within = compiler.attributes.get("meshdir", compiler.attributes.get("assetdir", within))
    named = [mesh.attributes.get(key, "") for mesh in meshes]
    paths = [posixpath.normpath(posixpath.join(within, name)) for name in named if "://" not in name]
    up = max([path.split("/").count("..") for path in paths], default=0)
    above = [file.parent, *file.parent.resolve().parents]
    return above[min(up, len(above) - 1)]


def read_robot(file: Path, assets: Path | None) -> Robot:
    """The robot in a URDF or MJCF file, its meshes read from the asset folder: `asset_folder`, if none is given.

    Raises AssetError, for an invalid robot with all that is wrong, a line each.
    """
    folder = asset_folder(file) if assets is None else assets
    try:
        path = file.resolve().relative_to(folder.resolve()).as_posix()
    except ValueError:
        raise AssetError(f"{file}: not in the asset folder {assets}") from None
    files = read_files(folder, ".", [path])
    absent = _read_meshes(folder, ".", path, files)
    return _robot(path, files, absent)


def _read_meshes(folder: Path, assets: str, robot: str, files: dict[str, bytes]) -> list[str]:
    """Add the meshes that a robot's file names to `files`, and return why some of collisions are not there."""
    absent: dict[str, list[tuple[str, str]]] = {}
    """Meshes and the places of them, by where they were searched."""
    for mesh in meshes_of(robot, files[robot]):
        if mesh in files:
            continue
        raw = undrawn_path(mesh)
        most = limits.VISUAL_BYTES_MAX if raw else limits.ASSET_BYTES_MAX
        try:
            packaged = is_packaged(robot, files[robot], mesh)
            content = read_mesh_file(folder, assets, robot, raw or mesh, most, packaged=packaged)
        except AssetError as error:
            if raw:
                files[mesh] = undrawn_content(str(error))
                continue
            place = place_of_mesh(robot, files[robot], mesh)
            if not isinstance(error, AbsentFile):
                raise AssetError(f"{place}: a mesh that cannot be read: {error}") from None
            absent.setdefault(error.what.removeprefix(f"{mesh}: "), []).append((mesh, place))
            continue
        files[mesh] = drawn_content(raw, content) if raw else content
        if sum(map(len, files.values())) > limits.ASSETS_BYTES_MAX:
            raise AssetError(f"{mesh}: the files up to this one have more than {limits.ASSETS_BYTES_MAX} bytes")
    return [_unread(meshes, why) for why, meshes in absent.items()]


def _unread(meshes: list[tuple[str, str]], why: str) -> str:
    """Return the error of meshes, with their places, that were searched in the same folders."""
    (mesh, place), *others = meshes
    if not others:
        return f"{place}: a mesh that cannot be read: {mesh}: {why}"
    names, lines = [name for name, _ in meshes], [one.rpartition(":")[2] for _, one in meshes]
    return f"{place}: {len(meshes)} meshes that cannot be read: {listed(names)} (lines {listed(lines)}): {why}"


def _robot(path: str, files: Mapping[str, bytes], absent: list[str]) -> Robot:
    """Return the robot in a file. Raises AssetError, with the meshes that are absent and where they were looked for."""
    notes: tuple[str, ...] = ()
    errors: list[str] = []
    try:
        robot = read_urdf(path, files)
    except BadRobot as bad:
        notes, errors = bad.notes, [line for line in str(bad).splitlines() if f": {MISSING}" not in line]
    if errors or absent:
        raise BadRobot([*errors, *absent], notes)
    return robot


def _absent(deployment: Deployment, folder: Path, path: str) -> Iterator[Finding]:
    """Yield the settings that name a file that does not exist, with the name nearest to it in its folder."""
    where = folder / deployment.assets
    beside: list[str] = []
    with suppress(OSError):
        beside = [one.name for one in (where / path).parent.iterdir() if one.suffix == Path(path).suffix]
    nearest = nearest_name(posixpath.basename(path), sorted(beside))
    named: list[tuple[Location, object]] = [(("robots", name), spec) for name, spec in deployment.robots.items()]
    named += [(("scenery", name), spec) for name, spec in deployment.scenery.items()]
    for place, setting in file_settings(deployment.network):
        named.append((tuple([int(step) if step.isdigit() else step for step in place.split(".")]), setting))
    for location, spec in named:
        if getattr(spec, "file", None) == path:
            yield Finding((*location, "file"), f"no such file in {where}", path, nearest)


def pin_assets(text: str, name: str, folder: Path) -> tuple[str, dict[str, bytes]]:
    """The text with the digest of each file that it names, and the contents of these by path.

    `folder` is the one that the deployment's file is in. Raises DeploymentError, also for a wall without a thickness
    and for a file that does not exist, and AssetError for an unacceptable one: the contents are read once, so the
    digests are of the contents checked.
    """
    deployment = load_deployment(text, name)
    files: dict[str, bytes] = {}
    while wanted := deployment.wanted(files):
        for path in wanted:
            if path not in files:  # a mesh comes with its robot
                try:
                    files |= read_files(folder, deployment.assets, [path], files)
                except AbsentFile:
                    refuse_findings(text, name, [*_absent(deployment, folder, path)])
                    raise
            if path.endswith((SUFFIX, MJCF)):
                absent = _read_meshes(folder, deployment.assets, path, files)
                if absent:
                    _robot(path, files, absent)
    if not files:
        return text, {}
    complete = deployment.with_assets(files)
    check_complete(text, name, complete)
    robots = deployment.robot_files(files)
    sets = ["digests={}"] if robots else []
    sets += [f'digests."{path}"="{digest_of(files[path])}"' for path in robots]
    sets += [
        f'scenery.{thing}.digest="{digest_of(files[spec.file])}"'
        for thing, spec in deployment.scenery.items()
        if isinstance(spec, SceneryMesh)
    ]
    sets += [
        f'{place}.digest="{digest_of(files[setting.file])}"' for place, setting in file_settings(deployment.network)
    ]
    return apply_sets(text, name, sets), files
