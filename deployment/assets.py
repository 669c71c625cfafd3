"""The files that a deployment refers to, pinned: they are read once, and their digests go into the deployment's text.

They are in its asset folder, which is the deployment file's own, or the one inside it that `assets:` names.
"""

from __future__ import annotations

from pathlib import Path

from foosim.deployment.loader import apply_sets, check_open_meshes, load_deployment
from foosim.deployment.network.traces import file_settings
from foosim.deployment.text.files import read_files
from foosim.world.mesh import digest_of
from foosim.world.scenery import SceneryMesh


def pin_assets(text: str, name: str, folder: Path) -> tuple[str, dict[str, bytes]]:
    """The text with the digest of each file that it names, and the contents of these by path.

    `folder` is the one that the deployment's file is in. Raises DeploymentError, also for a wall without a thickness,
    and AssetError for a file that is not acceptable: the contents are read once, and what the digests name is what was
    checked.
    """
    deployment = load_deployment(text, name)
    wanted = deployment.files()
    if not wanted:
        return text, {}
    files = read_files(folder, deployment.assets, wanted)
    check_open_meshes(text, name, deployment.with_assets(files))
    sets = [
        f'scenery.{thing}.digest="{digest_of(files[spec.file])}"'
        for thing, spec in deployment.scenery.items()
        if isinstance(spec, SceneryMesh)
    ]
    sets += [
        f'{place}.digest="{digest_of(files[setting.file])}"' for place, setting in file_settings(deployment.network)
    ]
    return apply_sets(text, name, sets), files
