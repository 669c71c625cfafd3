"""What a study runs: a deployment, the parameters that vary with their values, seeds, and a simulated time.

A parameter is a path of `--set`, its values are texts as after the `=` there. The runs are every combination of values
with every seed. The identity of a study is a digest of what all its runs have in common: values and seeds are left out,
so that a study can be extended.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import blake2b
from importlib.util import find_spec
from itertools import product
from math import prod
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import yaml

from foosim.client.loading import look_in
from foosim.common.errors import BadValue, DeploymentError
from foosim.common.units import parse_ns
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, check_engine, load_deployment
from foosim.deployment.text.files import read_deployment_text, read_source_file
from foosim.simulation.run import check_lockstep
from foosim.simulation.study.run import Run, version_here

SEED: Final = "seed"
RUNS_MAX: Final = 1_000_000


class StudyFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"duration": "for", "sets": "set"}):
    """A study as a YAML file: `deployment` is the path of its file, relative to this one's folder."""

    deployment: str
    duration: str
    vary: dict[str, list[Any]] = {}
    seeds: str | int = 1
    sets: list[str] = []


@dataclass(frozen=True, slots=True)
class Study:
    """A checked study. `text` has the digests of the deployment's files."""

    text: str
    name: str
    folder: Path
    ticks: int
    vary: Mapping[str, Sequence[str]]
    seeds: Sequence[int]
    version: str = field(default_factory=version_here)

    @property
    def parameters(self) -> tuple[str, ...]:
        """The paths that vary."""
        return tuple(self.vary)

    @property
    def combinations(self) -> list[tuple[str, ...]]:
        """Return the values of each combination, in the order of `parameters`."""
        return list(product(*self.vary.values()))

    def run(self, values: Sequence[str], seed: int) -> Run:
        """Return the run of a combination and a seed."""
        sets = [f"{path}={value}" for path, value in zip(self.vary, values, strict=True)]
        return Run(self.text, self.name, self.folder, (*sets, f"{SEED}={seed}"), self.ticks, self.version)

    def identity(self) -> str:
        """Return a digest of the deployment, the modules of its players, the simulated time and the parameters."""
        deployment = load_deployment(self.text, self.name)
        modules = sorted({player.class_.partition(":")[0] for player in deployment.players.values()})
        sources = [_source(module) for module in modules if not module.startswith("foosim.")]
        parts = [self.text.encode(), str(self.ticks).encode(), *(path.encode() for path in sorted(self.vary)), *sources]
        hasher = blake2b(digest_size=8)
        for part in parts:
            hasher.update(len(part).to_bytes(8) + part)
        return hasher.hexdigest()


def _source(module: str) -> bytes:
    """Return the text of a player's module, where it has one."""
    spec = find_spec(module)
    return Path(spec.origin).read_bytes() if spec is not None and spec.origin and Path(spec.origin).exists() else b""


def study_of(
    file: Path, duration: str, vary: Mapping[str, Sequence[object]], seeds: Sequence[int], sets: Sequence[str] = ()
) -> Study:
    """Return the study of a deployment's file.

    Raises DeploymentError for a bad deployment, and for an unknown parameter: no combination is accepted then. Raises
    AssetError for a bad file, BadValue for empty or repeated values and for a bad time.
    """
    look_in(str(file.parent.absolute()))
    text = apply_sets(read_source_file(file), str(file), sets)
    text, files = pin_assets(text, str(file), file.parent)
    deployment = load_deployment(text, str(file)).with_assets(files)
    check_engine(text, str(file), deployment)
    ticks = -(-parse_ns(duration) // deployment.tick_ns)
    if ticks < 1:
        raise BadValue("the simulated time of a run is a tick or more", duration)
    for path, given in vary.items():
        if isinstance(given, str):
            raise BadValue(f"{path}: a text, where its values are needed one by one", given)
    values = {path: tuple(map(text_of, given)) for path, given in vary.items()}
    seeds = [_plain(seed) for seed in seeds]
    for what, listed in (*values.items(), ("seeds", tuple(map(str, seeds)))):
        if not listed or len(set(listed)) != len(listed):
            raise BadValue(f"{what}: {'a value is there twice' if listed else 'there is no value'}", ",".join(listed))
    if SEED in values or any(one.partition("=")[0] == SEED for one in sets):
        raise BadValue("the seed is no parameter: it has its own option", SEED)
    if (runs := prod(map(len, values.values())) * len(seeds)) > RUNS_MAX:
        raise BadValue(f"more than {RUNS_MAX} runs", runs)
    study = Study(text, str(file), file.parent.absolute(), ticks, values, tuple(seeds))
    _check_parameters(study)
    return study


def _check_parameters(study: Study) -> None:
    """Raise Refused where neither the first combination nor one that differs from it in one value can be run."""
    first = study.combinations[0]
    others = [
        (*first[:place], value, *first[place + 1 :])
        for place, listed in enumerate(study.vary.values())
        for value in listed[1:]
    ]
    refused: DeploymentError | BadValue | None = None
    for values in (first, *others):
        try:
            text = apply_sets(study.text, study.name, study.run(values, study.seeds[0]).sets)
            check_lockstep(load_deployment(text, study.name))
            return
        except (DeploymentError, BadValue) as error:
            refused = refused or error
    assert refused is not None
    if isinstance(refused, DeploymentError):
        lines = refused.problems
        for number, path in enumerate(study.vary, 1):
            lines = tuple(re.sub(rf"^--set:{number}:\d+", f"--vary {path}", line) for line in lines)
        raise DeploymentError(lines)
    raise refused


def read_study(file: Path) -> StudyFile | None:
    """Return the study in a file, None for a deployment's file. Raises BadValue, and DeploymentError for no text."""
    try:
        content = yaml.safe_load(read_deployment_text(file))
    except yaml.YAMLError:
        return None  # the reader of deployments says where
    if not isinstance(content, dict) or "deployment" not in content:
        return None
    try:
        return msgspec.convert(content, StudyFile)
    except msgspec.ValidationError as error:
        raise BadValue(f"{file}: {error} (the keys are deployment, for, vary, seeds and set)") from None


def text_of(value: object) -> str:
    """Return a value as the text that `--set` takes. Raises BadValue for one that YAML has not."""
    if isinstance(value, str):
        return str(value)
    try:
        return yaml.safe_dump(_plain(value), default_flow_style=True).split("\n...")[0].strip()
    except yaml.YAMLError:
        raise BadValue("not a value of a deployment, a number, text, list or mapping", repr(value)) from None


def _plain(value: Any) -> Any:
    """Return a number or an array of numpy as Python's."""
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else value


def values_of(text: str) -> list[str]:
    """Return the values of `10ms,50ms` or `1..20`: commas within brackets and quotes separate none.

    Raises BadValue.
    """
    try:
        node = yaml.compose(f"[{text}]", Loader=yaml.SafeLoader)
    except yaml.YAMLError:
        raise BadValue("not a list of values with commas between", text) from None
    assert isinstance(node, yaml.SequenceNode)
    if node.end_mark.index != len(text) + 2:
        raise BadValue("not a list of values with commas between", text)
    found: list[str] = []
    for item in node.value:
        one = text[item.start_mark.index - 1 : item.end_mark.index - 1]
        first, dots, last = one.partition("..")
        if dots and first.isdecimal() and last.isdecimal():
            if not 0 <= int(last) - int(first) < RUNS_MAX:
                raise BadValue(f"a range without a value, or with more than {RUNS_MAX}", one)
            found += map(str, range(int(first), int(last) + 1))
            continue
        found.append(one)
    if not found:
        raise BadValue("a list without a value", text)
    return found


def seeds_of(text: str) -> list[int]:
    """Return the seeds of `1..20` or `1,2,5..9`. Raises BadValue."""
    listed = values_of(text)
    if bad := [one for one in listed if not one.isdecimal()]:
        raise BadValue("not a seed, a whole number from 0 on, or a range such as 1..20", bad[0])
    return [int(one) for one in listed]
