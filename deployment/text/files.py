"""Reads a deployment's file and those beside it that it includes or refers to, from its folder and from nowhere else.

A path is taken apart and each component opened in the folder before it, without following links, so nothing outside is
ever opened, for any path and any change of the folder meanwhile.
"""

from __future__ import annotations

import codecs
import errno
import os
import stat
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from types import MappingProxyType
from typing import Final

from foosim.common import limits
from foosim.common.errors import DeploymentError, describe
from foosim.deployment.text.includes import Source, Wanted, inlined
from foosim.deployment.text.yaml import Place, Problem
from foosim.world.matter.mesh import AssetError
from foosim.world.scenery import path_problem

NO_FILES: Final[Mapping[str, bytes]] = MappingProxyType({})
_COMPONENT = os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC
_FILE = _COMPONENT | os.O_NONBLOCK  # a pipe without a writer would block


def read_source_file(path: Path) -> Source:
    """Return the texts of a deployment file and of its includes; raises DeploymentError for an unreadable one."""
    text = read_deployment_text(path)
    texts: dict[str, str] = {}
    problems: list[Problem] = []

    def text_of(wanted: Wanted) -> str | None:
        try:
            content = read_files(path.parent, ".", {wanted.path: None})[wanted.path]
            texts[wanted.path] = _decoded(content, str(path.parent / wanted.path), len(texts) + 1)
        except AssetError as error:
            problems.append(wanted.problem(f"cannot be included, {error}"))
        except _Unreadable as unreadable:
            problems.append(unreadable.problem)
        return texts.get(wanted.path)

    inlined(text, str(path), text_of)
    if problems:
        raise DeploymentError([str(problem) for problem in sorted(problems)])
    return Source(text, tuple(texts.items()))


def read_deployment_text(path: Path) -> str:
    """Return the text of a deployment file, bounded before it is read, without its includes; raises DeploymentError."""
    try:
        with path.open("rb") as file:
            raw = file.read(limits.DEPLOYMENT_BYTES_MAX + 1)
    except FileNotFoundError:
        raise DeploymentError([f"{path}: there is no such file"]) from None
    except IsADirectoryError:
        raise DeploymentError([f"{path}: a folder, where a deployment file is needed"]) from None
    except OSError as error:
        raise DeploymentError([f"{path}: cannot be read, {error.strerror or error}"]) from None
    try:
        return _decoded(raw, str(path), 0)
    except _Unreadable as unreadable:
        raise DeploymentError([str(unreadable.problem)]) from None


class AbsentFile(AssetError):
    """A file is not where it was looked for."""


class _Unreadable(Exception):
    """A file's bytes are no text of a deployment."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(str(problem))
        self.problem = problem


def _decoded(raw: bytes, file: str, rank: int) -> str:
    """The text that a file's bytes are; raises _Unreadable."""
    if len(raw) > limits.DEPLOYMENT_BYTES_MAX:
        raise _Unreadable(Problem(Place(rank, 1, 1, file), f"more than {limits.DEPLOYMENT_BYTES_MAX} bytes"))
    raw = raw.removeprefix(codecs.BOM_UTF8)
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        before = raw[: error.start].decode("utf-8")
        place = Place(rank, before.count("\n") + 1, len(before) - before.rfind("\n"), file)
        raise _Unreadable(Problem(place, describe("not UTF-8", raw[error.start]))) from None


def read_files(
    folder: Path,
    assets: str,
    wanted: Iterable[str],
    known: Mapping[str, bytes] = NO_FILES,
    bytes_max: int | None = None,
) -> dict[str, bytes]:
    """The contents of files by their paths inside the asset folder `assets` of a folder; raises AssetError.

    `known` are the files that were read before: the limit is one of all together. A file has at most `bytes_max`, else
    the limit of assets. One that does not exist is an AbsentFile.
    """
    files: dict[str, bytes] = {}
    where = (folder / assets).absolute()
    left = limits.ASSETS_BYTES_MAX - sum(map(len, known.values()))
    try:
        root = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except OSError as error:
        raise AssetError(f"{folder}: {error.strerror}") from None
    try:
        for path in wanted:
            prefix = "" if assets == "." else f"{assets}/"
            files[path] = _read_file(root, prefix, path, where, bytes_max or limits.ASSET_BYTES_MAX)
            left -= len(files[path])
            if left < 0:
                raise AssetError(f"{path}: the files up to this one have more than {limits.ASSETS_BYTES_MAX} bytes")
    finally:
        os.close(root)
    return files


def _read_file(root: int, prefix: str, path: str, where: Path, bytes_max: int) -> bytes:
    """The content of a file below an open folder; `where` is the asset folder in messages."""
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
        return _content(file, path, bytes_max)
    except FileNotFoundError as error:
        raise AbsentFile(f"{path}: {error.strerror} in {where}") from None
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


def _content(file: int, path: str, bytes_max: int) -> bytes:
    if not stat.S_ISREG(os.fstat(file).st_mode):
        raise AssetError(f"{path}: no regular file")
    content = bytearray()
    while chunk := os.read(file, min(bytes_max + 1 - len(content), 1 << 20)):
        content += chunk
        if len(content) > bytes_max:
            raise AssetError(f"{path}: more than {bytes_max} bytes")
    return bytes(content)
