"""The files that a deployment refers to, read from its asset folder and from nowhere else.

The folder is the deployment file's own, or the one inside it that `assets:` names. A path is taken apart and each
component opened in the folder before it, without following links, so nothing outside is ever opened, whatever the path
says and whoever changes the folder meanwhile. What is read is pinned: the digests go into the deployment's text.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from foosim.common import limits
from foosim.deployment.loader import apply_sets, check_open_meshes, load_deployment
from foosim.deployment.network.traces import file_settings
from foosim.world.mesh import AssetError, digest_of
from foosim.world.scenery import SceneryMesh, path_problem

_COMPONENT = os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC
_FILE = _COMPONENT | os.O_NONBLOCK  # a pipe without a writer would block


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


def read_files(folder: Path, assets: str, wanted: Mapping[str, object]) -> dict[str, bytes]:
    """The contents of files by their paths inside the asset folder `assets` of a folder; raises AssetError."""
    files: dict[str, bytes] = {}
    left = limits.ASSETS_BYTES_MAX
    try:
        root = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except OSError as error:
        raise AssetError(f"{folder}: {error.strerror}") from None
    try:
        for path in wanted:
            files[path] = _read_file(root, "" if assets == "." else f"{assets}/", path)
            left -= len(files[path])
            if left < 0:
                raise AssetError(f"{path}: the files up to this one have more than {limits.ASSETS_BYTES_MAX} bytes")
    finally:
        os.close(root)
    return files


def _read_file(root: int, prefix: str, path: str) -> bytes:
    """The content of a file below an open folder."""
    problem = path_problem(path)
    if problem:
        raise AssetError(f"{path!r}: {problem}")
    *folders, last = f"{prefix}{path}".split("/")
    opened: list[int] = []
    try:
        inner = root
        for folder in folders:
            inner = os.open(folder, _COMPONENT | os.O_DIRECTORY, dir_fd=inner)
            opened.append(inner)
        file = os.open(last, _FILE, dir_fd=inner)
        opened.append(file)
        return _content(file, path)
    except OSError as error:
        raise AssetError(f"{path}: {_reason(error)}") from None
    finally:
        for descriptor in opened:
            with suppress(OSError):
                os.close(descriptor)


def _reason(error: OSError) -> str:
    """The error of a component that was not opened. A link is neither a folder nor a file."""
    if error.errno in (errno.ELOOP, errno.ENOTDIR):
        return "a symbolic link, or no folder, on the way; neither is followed"
    return error.strerror or str(error)


def _content(file: int, path: str) -> bytes:
    if not stat.S_ISREG(os.fstat(file).st_mode):
        raise AssetError(f"{path}: no regular file")
    content = bytearray()
    while chunk := os.read(file, min(limits.ASSET_BYTES_MAX + 1 - len(content), 1 << 20)):
        content += chunk
        if len(content) > limits.ASSET_BYTES_MAX:
            raise AssetError(f"{path}: more than {limits.ASSET_BYTES_MAX} bytes")
    return bytes(content)
