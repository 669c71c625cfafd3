"""The files that a deployment refers to, pinned: they are read once, and their digests go into the deployment's text.

Those of scenery, links and robots, and what a robot's file names in turn. They are in the deployment's asset folder,
which is that of its own file, or the one inside it that `assets:` names.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from foosim.deployment.loader import apply_sets, check_complete, load_deployment
from foosim.deployment.network.traces import file_settings
from foosim.deployment.text.files import read_files
from foosim.world.bodies.urdf import SUFFIX, Robot, meshes_of, place_of_mesh, read_urdf
from foosim.world.matter.mesh import AssetError, digest_of
from foosim.world.scenery import SceneryMesh


def read_robot(file: Path, assets: Path | None) -> Robot:
    """The robot in a URDF file, its meshes read from the asset folder: that of the file, if none is given.

    Raises AssetError.
    """
    folder = file.parent if assets is None else assets
    try:
        path = file.name if assets is None else file.resolve().relative_to(assets.resolve()).as_posix()
    except ValueError:
        raise AssetError(f"{file}: not in the asset folder {assets}") from None
    files = read_files(folder, ".", [path])
    for mesh in meshes_of(path, files[path]):
        files |= _read(folder, ".", mesh, files)
    return read_urdf(path, files)


def _read(folder: Path, assets: str, path: str, known: Mapping[str, bytes]) -> dict[str, bytes]:
    """The content of one file by its path, beside those that are known. Raises AssetError, of a robot's mesh with the
    place where the robot's file names it."""
    try:
        return read_files(folder, assets, [path], known)
    except AssetError as error:
        for robot, content in known.items():
            if robot.endswith(SUFFIX) and path in meshes_of(robot, content):
                place = place_of_mesh(robot, content, path)
                raise AssetError(f"{place}: a mesh that cannot be read: {error}") from None
        raise


def pin_assets(text: str, name: str, folder: Path) -> tuple[str, dict[str, bytes]]:
    """The text with the digest of each file that it names, and the contents of these by path.

    `folder` is the one that the deployment's file is in. Raises DeploymentError, also for a wall without a thickness,
    and AssetError for a file that is not acceptable: the contents are read once, and what the digests name is what was
    checked.
    """
    deployment = load_deployment(text, name)
    files: dict[str, bytes] = {}
    while wanted := deployment.wanted(files):
        for path in wanted:
            files |= _read(folder, deployment.assets, path, files)
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
