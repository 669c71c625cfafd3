"""From the text of a deployment file to a `Deployment`, or to all that is wrong with it.

The text is scanned before anything is built (yaml_tree.py), then checked against the schema (deployment.py,
schema_problems.py) and for what lies between its parts (references.py). Every problem becomes one line,

    deploy/table.yaml:7:11: nodes.red.robots[1]: unknown robot, 'red.gaol', nearest is 'red.goal'

that is `file:line:column: what, value, nearest valid name`, in the order of the file. Settings given on a command
line are placed in the same tree first: settings.py.
"""

import codecs
from collections.abc import Sequence
from functools import lru_cache
from itertools import chain, islice
from pathlib import Path
from typing import Final

from pydantic import ValidationError

from foosim.common import limits
from foosim.common.errors import DeploymentError, describe
from foosim.common.finding import Finding
from foosim.deployment.checks import check_references, path_text
from foosim.deployment.components import read_components
from foosim.deployment.network.rules import Network
from foosim.deployment.network_checks import check_network, check_network_alone
from foosim.deployment.overrides import place_sets
from foosim.deployment.radio_checks import place_findings, rule_findings
from foosim.deployment.schema import Deployment
from foosim.deployment.schema_errors import schema_findings
from foosim.deployment.table_clearance import clearance_findings
from foosim.deployment.text.earlier_format import upgrade
from foosim.deployment.text.yaml import (
    DEPTH_MAX,
    NODES_MAX,
    Fields,
    Items,
    Locate,
    Place,
    Problem,
    Tree,
    copied,
    locate_in,
    measure,
    plain,
    read_tree,
    write_yaml,
)
from foosim.deployment.timing_checks import check_timing
from foosim.world.scenes.hall_start import start_findings

PROBLEMS_MAX: Final = 100
"""How many problems are looked for and shown: a hostile file may hold many thousands, each with names to compare."""
DEPLOYMENTS_KEPT: Final = 32
"""Deployments that are not read again: a rehearsal's processes all load the same text, which takes 20 ms each time.
The swarm's worlds are 25 texts."""
TREES_KEPT: Final = 4
"""Files that are not read again when other settings are placed in them."""
EARLIER_SETTINGS: Final = (("capture", "payloads"),)
"""Section and key of settings that captures of earlier formats may have in their deployments."""

_kept: dict[tuple[str, str], Deployment] = {}
"""By text and name, the least recently used first."""


def _read_tree(text: str, locate: Locate) -> tuple[Tree | None, list[Problem]]:
    """The result of `read_tree`, of a file of an earlier format as one of today's."""
    tree, problems = read_tree(text, locate)
    upgrade(tree)
    return tree, problems


def load_deployment(text: str, name: str) -> Deployment:
    """The deployment in `text`; `name` is the file's in messages. Raises DeploymentError with all problems.

    Equal texts give one value, which nobody changes: all processes of a rehearsal load the same.
    """
    known = _kept.pop((text, name), None)
    return _keep(text, name, known or read_deployment(text, name))


def read_deployment(text: str, name: str) -> Deployment:
    """The result of `load_deployment`, without the cache."""
    return _check(*_read_tree(text, locate_in(name)))


def load_earlier(text: str, name: str) -> Deployment:
    """What `load_deployment` returns of a text with settings that an earlier version had; they are left out."""
    tree, problems = _read_tree(text, locate_in(name))
    for section, key in EARLIER_SETTINGS:
        fields = tree.values.get(section) if isinstance(tree, Fields) else None
        if isinstance(fields, Fields):
            fields.values.pop(key, None)
    return _check(tree, problems)


def _keep(text: str, name: str, deployment: Deployment) -> Deployment:
    """Cache a text's deployment as the most recently used."""
    while len(_kept) >= DEPLOYMENTS_KEPT:
        _kept.pop(next(iter(_kept)))
    _kept[text, name] = deployment
    return deployment


@lru_cache(maxsize=TREES_KEPT)
def _tree_of(text: str, name: str) -> tuple[Tree | None, list[Problem]]:
    """The result of `read_tree`; it is not changed."""
    return _read_tree(text, locate_in(name))


def apply_sets(text: str, name: str, sets: Sequence[str]) -> str:
    """The canonical text of the deployment in `text` after the settings `a.b=VALUE`; raises DeploymentError.

    Canonical is block style in the file's order without comments: what travels in the handshake and is attached to
    the capture. Loading it gives the changed deployment, and its own canonical text is itself.
    """
    return _applied(text, name, tuple(sets))


@lru_cache(maxsize=DEPLOYMENTS_KEPT)
def _applied(text: str, name: str, sets: tuple[str, ...]) -> str:
    """The result of `apply_sets`, cached for repeated rehearsals."""
    tree, problems = _tree_of(text, name)
    if tree is not None:
        tree, set_problems = place_sets(copied(tree), sets)
        problems = [*problems, *set_problems]
    deployment = _check(tree, problems)
    assert tree is not None, "checked"
    canonical = write_yaml(plain(tree))
    depth, nodes = measure(tree)
    size = len(canonical.encode())
    if depth > DEPTH_MAX or nodes > NODES_MAX or size > limits.DEPLOYMENT_BYTES_MAX:
        what = f"too large with these settings ({size} bytes, {nodes} nodes, {depth} deep)"
        raise DeploymentError([str(Problem(tree.place, what))])
    _keep(canonical, name, deployment)
    return canonical


def load_network(text: str, name: str, sets: Sequence[str] = ()) -> Network | None:
    """The network of a file that has its `network:` section alone, after settings; None for any other file.

    Raises DeploymentError with all problems of the section. The matches of its selectors are not checked.
    """
    tree, problems = _read_tree(text, locate_in(name))
    if not isinstance(tree, Fields) or set(tree.values) != {"network"}:
        return None
    tree, set_problems = place_sets(tree, sets)
    data = plain(tree)
    findings = list(islice(check_network_alone(data), PROBLEMS_MAX + 1))
    network = None
    try:
        network = Network.model_validate(data["network"])
    except ValidationError as error:
        findings += islice(schema_findings(error, ("network",)), PROBLEMS_MAX + 1)
    if network is not None and not findings:
        findings += islice(rule_findings(network, (), {}), PROBLEMS_MAX + 1)
    found = [*problems, *set_problems, *(_problem(tree, finding) for finding in findings)]
    if found or network is None:
        raise DeploymentError(_report(found))
    return network


def check_open_meshes(text: str, name: str, deployment: Deployment) -> None:
    """Refuse walls without a thickness: meshes that are not closed, of a material of which it is not said how thick.

    `text` and `name` are what the deployment, which has its files, was loaded from. Raises DeploymentError.
    """
    findings = []
    for thing in deployment.open_meshes():
        radio = deployment.scenery[thing].radio
        material = "concrete" if radio is None or radio.is_ is None else radio.is_
        what = f"a wall without a thickness: the mesh is not closed, write {{is: {material}, thickness: 10 cm}}"
        findings.append(Finding(("scenery", thing, "radio"), what, material))
    refuse_findings(text, name, findings)


def refuse_findings(text: str, name: str, findings: Sequence[Finding], sets: Sequence[str] = ()) -> None:
    """Raise DeploymentError for problems that were found in a loaded deployment, if any.

    `text`, `name` and `sets` are what it was loaded from.
    """
    if findings:
        tree, _ = _read_tree(text, locate_in(name))
        assert tree is not None, "it was loaded"
        tree, _ = place_sets(tree, sets)
        raise DeploymentError(_report([_problem(tree, finding) for finding in findings]))


def with_network(text: str, name: str, other: tuple[str, str] | None, sets: Sequence[str]) -> str:
    """The canonical text of the deployment in `text` with another network, and after settings.

    `other` is the text and name of a file with a `network:` section, alone or in a deployment; None keeps the network.
    Raises DeploymentError with all problems, each in its file.
    """
    tree, problems = _read_tree(text, locate_in(name))
    if other is not None and isinstance(tree, Fields):
        there, there_problems = _read_tree(other[0], locate_in(other[1]))
        problems = [*problems, *there_problems]
        if isinstance(there, Fields) and "network" in there.values:
            tree.values["network"], tree.keys["network"] = there.values["network"], there.keys["network"]
        elif there is not None:
            problems.append(Problem(there.place, describe("missing key", "network")))
    if tree is not None:
        tree, set_problems = place_sets(tree, sets)
        problems = [*problems, *set_problems]
    _check(tree, problems)
    assert tree is not None, "checked"
    return write_yaml(plain(tree))


def read_deployment_text(path: Path) -> str:
    """The text of a deployment file, bounded before it is read; raises DeploymentError."""
    place = Place(0, 1, 1, str(path))
    try:
        with path.open("rb") as file:
            raw = file.read(limits.DEPLOYMENT_BYTES_MAX + 1)
    except FileNotFoundError:
        raise DeploymentError([f"{path}: there is no such file"]) from None
    except IsADirectoryError:
        raise DeploymentError([f"{path}: a folder, where a deployment file is needed"]) from None
    except OSError as error:
        raise DeploymentError([f"{path}: cannot be read, {error.strerror or error}"]) from None
    if len(raw) > limits.DEPLOYMENT_BYTES_MAX:
        raise DeploymentError([f"{place}: more than {limits.DEPLOYMENT_BYTES_MAX} bytes"])
    raw = raw.removeprefix(codecs.BOM_UTF8)
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        before = raw[: error.start].decode("utf-8")
        place = Place(0, before.count("\n") + 1, len(before) - before.rfind("\n"), str(path))
        raise DeploymentError([f"{place}: {describe('not UTF-8', raw[error.start])}"]) from None


def _check(tree: Tree | None, problems: Sequence[Problem]) -> Deployment:
    """Build the deployment from a tree, or raise all problems, those that the reader found among them."""
    deployment = None
    found = list(problems)
    if tree is not None:
        data = plain(tree)
        found_first = chain(check_references(data), check_timing(data), check_network(data))
        findings = list(islice(found_first, PROBLEMS_MAX + 1))
        data, component_findings = read_components(data)
        findings += component_findings[: PROBLEMS_MAX + 1]
        try:
            deployment = Deployment.model_validate(data)
        except ValidationError as error:
            findings += islice(schema_findings(error), PROBLEMS_MAX + 1)
        if deployment is not None and not findings:
            rules = rule_findings(deployment.network, deployment.endpoints(), deployment.carriers())
            in_the_way = chain(start_findings(deployment), clearance_findings(deployment))
            found_later = chain(in_the_way, rules, place_findings(deployment))
            findings = list(islice(found_later, PROBLEMS_MAX + 1))
        found += [_problem(tree, finding) for finding in findings]
    if found or deployment is None:
        raise DeploymentError(_report(found))
    return deployment


def _report(found: Sequence[Problem]) -> list[str]:
    """The problems in the order of the file, each once, bounded."""
    lines = [str(problem) for problem in sorted(set(found))]
    if len(lines) <= PROBLEMS_MAX:
        return lines
    return [*lines[:PROBLEMS_MAX], f"and more: only the first {PROBLEMS_MAX} problems are shown"]


def _problem(tree: Tree, finding: Finding) -> Problem:
    place = _place(tree, finding)
    if finding.other is not None and place.rank < (there := _place(tree, finding.other)).rank:
        finding, place = finding.other, there  # it was set after the file
    location = finding.location if finding.at == "value" else finding.location[:-1]
    text = describe(finding.what, finding.value, finding.nearest)
    path = path_text(location)
    return Problem(place, f"{path}: {text}" if path else text)


def _place(tree: Tree, finding: Finding) -> Place:
    """The place of the value, the key, or the mapping without the key; the nearest enclosing one if it is absent."""
    node, place = tree, tree.place
    for step in finding.location:
        if isinstance(node, Fields) and isinstance(step, str) and step in node.values:
            place, node = node.keys[step], node.values[step]
        elif isinstance(node, Items) and isinstance(step, int) and step < len(node.items):
            node = node.items[step]
            place = node.place
        else:
            break
    else:
        return place if finding.at == "key" else node.place
    return node.place
