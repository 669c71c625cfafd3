"""From the text of a deployment file to a `Deployment`, or to all that is wrong with it.

The text is scanned before anything is built (text/yaml.py), with what it includes (text/includes.py), expanded
(text/expand.py), then checked against the schema (schema.py, schema_errors.py) and for what lies between its parts
(validate.py). Every problem becomes one line,

    deploy/table.yaml:7:11: nodes.red.robots[1]: unknown robot, 'red.atack', nearest is 'red.attack'

that is `file:line:column: what, value, nearest valid name`, in the order of the files. Settings given on a command
line are placed in the same tree first: overrides.py.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import chain, islice
from typing import Any, Final

from pydantic import ValidationError

from foosim.common import limits
from foosim.common.errors import ABSENT, DeploymentError, describe
from foosim.common.finding import Finding
from foosim.deployment.components import read_components
from foosim.deployment.network.link_settings import Profiles
from foosim.deployment.network.rules import Network
from foosim.deployment.overrides import place_sets
from foosim.deployment.schema import Deployment
from foosim.deployment.schema_errors import schema_findings
from foosim.deployment.text.expand import Expanded, expand
from foosim.deployment.text.includes import Source, read_source
from foosim.deployment.text.made import without_places_by_node
from foosim.deployment.text.places import Places
from foosim.deployment.text.report import PROBLEMS_MAX
from foosim.deployment.text.selection import TooManyComparisons
from foosim.deployment.text.templates import TEMPLATES
from foosim.deployment.text.yaml import (
    DEPTH_MAX,
    NODES_MAX,
    Fields,
    Items,
    Leaf,
    Place,
    Problem,
    Tree,
    measure,
    plain,
    write_yaml,
)
from foosim.deployment.validate import needs, stages
from foosim.deployment.validate_network import Names, check_network, rule_findings
from foosim.world.spec import KITS

DEPLOYMENT_KEYS: Final = frozenset(
    field.alias or name for name, field in Deployment.model_fields.items() if name != KITS
)
"""The keys of a deployment except those of kits."""
DEPLOYMENTS_KEPT: Final = 32
"""Cached deployments: all processes of a rehearsal load the same text, which takes 20 ms each time. The swarm's worlds
are 25 texts."""
SECTION_OF_KEY: Final = {"model": "robots", "shape": "scenery", "class": "players"}
"""What an unused template is for, by a key that it has."""

Text = str | Source
"""A deployment's text, alone or with the files that it includes."""

_kept: dict[tuple[Text, str], tuple[Deployment, Tree | None]] = {}
"""By text and name, the least recently used first. A canonical text has the tree of its files, with their
places."""


def load_deployment(text: Text, name: str) -> Deployment:
    """The deployment in `text`; `name` is the file's in messages. Raises DeploymentError with all problems.

    Equal texts give one immutable value: all processes of a rehearsal load the same.
    """
    known = _kept.pop((text, name), None) or (read_deployment(text, name), None)
    return _keep(text, name, *known)


def read_deployment(text: Text, name: str) -> Deployment:
    """The result of `load_deployment`, without the cache."""
    return _check(*read_source(text, name))


def _keep(text: Text, name: str, deployment: Deployment, tree: Tree | None) -> Deployment:
    """Cache a text's deployment as the most recently used, with its tree."""
    while len(_kept) >= DEPLOYMENTS_KEPT:
        _kept.pop(next(iter(_kept)))
    _kept[text, name] = deployment, tree
    return deployment


def apply_sets(text: Text, name: str, sets: Sequence[str]) -> str:
    """The canonical text of the deployment in `text` after the settings `a.b=VALUE`; raises DeploymentError.

    Canonical is block style in the file's order without comments, with what the file includes, and not expanded: what
    travels in the handshake and is attached to the capture. Loading it gives the changed deployment, and its own
    canonical text is itself.
    """
    return _applied(text, name, tuple(sets))


def with_owners(text: Text, name: str, owners: Mapping[str, Sequence[str]], sets: Sequence[str] = ()) -> str:
    """The canonical text of the same world on other nodes, each with its robots, and after settings.

    What runs where its robot's node is (`$node`) runs anywhere: the nodes have other names. Raises DeploymentError.
    """
    return _applied(text, name, tuple(sets), tuple((node, tuple(robots)) for node, robots in owners.items()))


def with_network(text: Text, name: str, other: tuple[Text, str] | None, sets: Sequence[str]) -> str:
    """The canonical text of the deployment in `text` with another network, and after settings.

    `other` is the text and name of a file with a `network:` section, alone or in a deployment; None keeps the network.
    Raises DeploymentError with all problems, each in its file.
    """
    return _applied(text, name, tuple(sets), network=other)


@lru_cache(maxsize=DEPLOYMENTS_KEPT)
def _applied(
    text: Text,
    name: str,
    sets: tuple[str, ...],
    owners: tuple[tuple[str, tuple[str, ...]], ...] = (),
    network: tuple[Text, str] | None = None,
) -> str:
    """The result of `apply_sets`, `with_owners` and `with_network`, cached for repeated rehearsals."""
    tree, problems = read_source(text, name)
    if owners and isinstance(tree, Fields):
        without_places_by_node(tree)
        place = tree.keys.get("nodes", tree.place)
        nodes: dict[str, Tree] = {node: _listed(robots, place) for node, robots in owners}
        tree.values["nodes"], tree.keys["nodes"] = Fields(place, nodes, dict.fromkeys(nodes, place)), place
    if network is not None and isinstance(tree, Fields):
        there, there_problems = read_source(*network)
        problems = [*problems, *there_problems]
        if isinstance(there, Fields) and "network" in there.values:
            tree.values["network"], tree.keys["network"] = there.values["network"], there.keys["network"]
        elif there is not None:
            problems.append(Problem(there.place, describe("missing key", "network")))
    tree, problems = _with_sets(tree, problems, sets)
    canonical = _canonical(tree)
    _keep(canonical, name, _check(tree, problems), tree)
    return canonical


def _listed(robots: Sequence[str], place: Place) -> Fields:
    """A node with a list of robots."""
    return Fields(place, {"robots": Items(place, [Leaf(place, robot) for robot in robots])}, {"robots": place})


def _canonical(tree: Tree | None) -> str:
    """The text of a tree that was read; raises DeploymentError where settings or included files make it too large."""
    if tree is None:
        return ""
    canonical = write_yaml(plain(tree))
    depth, nodes = measure(tree)
    size = len(canonical.encode())
    if depth > DEPTH_MAX or nodes > NODES_MAX or size > limits.DEPLOYMENT_BYTES_MAX:
        what = f"too large with its settings and included files ({size} bytes, {nodes} nodes, {depth} deep)"
        raise DeploymentError([str(Problem(tree.place, what))])
    return canonical


def _with_sets(
    tree: Tree | None, problems: Sequence[Problem], sets: Sequence[str]
) -> tuple[Tree | None, list[Problem]]:
    """A tree after settings, itself changed, and the problems of both."""
    if tree is None:
        return None, [*problems]
    tree, set_problems = place_sets(tree, sets)
    return tree, [*problems, *set_problems]


def expanded_text(text: Text, name: str, sets: Sequence[str] = ()) -> str:
    """The same deployment as `apply_sets` gives, with nothing abbreviated: no templates, no counts, no selectors in the
    place of robots. It may be longer than a deployment's text is allowed to be. Raises DeploymentError."""
    canonical = apply_sets(text, name, sets)
    tree, _ = read_source(canonical, name)
    assert tree is not None, "checked"
    expanded = expand(tree).tree
    assert expanded is not None, "checked"
    return write_yaml(plain(expanded))


def load_network(text: Text, name: str, sets: Sequence[str] = ()) -> Network | None:
    """The network of a file that has its `network:` section alone, after settings; None for any other file.

    Raises DeploymentError with all problems of the section. The matches of its selectors are not checked.
    """
    tree, problems = read_source(text, name)
    if not isinstance(tree, Fields) or set(tree.values) != {"network"}:
        return None
    tree, set_problems = place_sets(tree, sets)
    data, network = plain(tree)["network"], None
    findings: Iterator[Finding] = iter(())
    try:
        network = Network.model_validate(data)
    except ValidationError as error:
        findings = schema_findings(error, ("network",))
    else:
        of_itself = list(islice(check_network(network, Names(())), PROBLEMS_MAX + 1))
        findings = iter(of_itself) if of_itself else rule_findings(Profiles(network, {}, ""), ())
    places = Places(tree, tree, {})
    found = [*problems, *set_problems, *map(places.problem, islice(findings, PROBLEMS_MAX + 1))]
    if found or network is None:
        raise DeploymentError(_report(found))
    return network


def check_complete(text: Text, name: str, deployment: Deployment) -> None:
    """Refuse errors that need a deployment's files: walls without a thickness, robots whose files do not give
    what their components need, and what starts in a mesh.

    `text` and `name` are what the deployment was loaded from. Raises DeploymentError.
    """
    ends = Names(deployment.endpoints())
    for _, stage in stages(deployment, with_files=True):
        found = chain.from_iterable(check.find(deployment, ends) for check in stage)
        refuse_findings(text, name, list(islice(found, PROBLEMS_MAX + 1)))


def check_engine(text: Text, name: str, deployment: Deployment) -> None:
    """Refuse an engine that cannot be built on this machine.

    `text` and `name` are what the deployment was loaded from. Raises DeploymentError.
    """
    engine = deployment.engine_type
    if lack := engine.lack:
        refuse_findings(text, name, [Finding(("engine",), f"{lack}: {engine.instead}", ABSENT)])


def refuse_findings(text: Text, name: str, findings: Sequence[Finding], sets: Sequence[str] = ()) -> None:
    """Raise DeploymentError for problems that were found in a loaded deployment, if any.

    `text`, `name` and `sets` are what it was loaded from.
    """
    if findings:
        _, tree = (_kept.get((text, name)) if not sets else None) or (None, None)
        if tree is None:
            tree, _ = _with_sets(*read_source(text, name), sets)
        assert tree is not None, "it was loaded"
        expanded = expand(tree)
        assert expanded.tree is not None, "it was loaded"
        places = Places(tree, expanded.tree, {})
        raise DeploymentError(_report([places.problem(finding, is_made=True) for finding in findings]))


def _check(tree: Tree | None, problems: Sequence[Problem]) -> Deployment:
    """Build the deployment from a tree, or raise all problems, including those of the reader."""
    deployment = None
    found = list(problems)
    expanded = Expanded(None) if tree is None else expand(tree)
    found += expanded.problems
    if tree is not None and expanded.tree is not None:
        places = Places(tree, expanded.tree, expanded.unused)
        try:
            deployment, others = _examined(expanded, places)
            found += others
        except TooManyComparisons as error:
            found.append(Problem(tree.place, str(error)))
    if found or deployment is None:
        raise DeploymentError(_report(found))
    return deployment


def _examined(expanded: Expanded, places: Places) -> tuple[Deployment | None, list[Problem]]:
    """The deployment that a tree is, and the problems of what is in it: those of fields by themselves, else between
    fields, else of the world that they make. Raises TooManyComparisons."""
    assert expanded.tree is not None, "it can be examined"
    data = plain(expanded.tree)

    def first(*findings: Iterable[Finding]) -> list[Finding]:
        return list(islice(places.distinct(chain(*findings), expanded.broken), PROBLEMS_MAX + 1))

    deployment, of_fields = _validated(data)
    within = [*first(of_fields), *first(_unused_findings(data, expanded))]
    if deployment is None or within:
        return deployment, [*map(places.problem, within)]
    ends = Names(deployment.endpoints())
    for known, stage in stages(deployment):
        deployment = known
        found = [(check, finding) for check in stage for finding in first(check.find(known, ends))]
        if found:
            return None, [places.problem(finding, is_made=not check.of_entries) for check, finding in found]
    return deployment, []


def _validated(data: Any) -> tuple[Deployment | None, Iterator[Finding]]:
    """The deployment that plain data is, and what the components of its robots and what the schema refuse."""
    data, findings = read_components(data, DEPLOYMENT_KEYS)
    try:
        deployment = Deployment.model_validate(data)
    except ValidationError as error:
        return None, chain(findings, schema_findings(error))
    return (None if findings else deployment), iter(findings)


def _unused_findings(data: Any, expanded: Expanded) -> Iterator[Finding]:
    """Yield the errors of unused templates that no further key could mend, nor another entity, as it could a tag."""
    for name, (whole, _) in expanded.unused.items():
        section = next((of for key, of in SECTION_OF_KEY.items() if key in whole.values), None)
        if section is None:
            continue
        deployment, findings = _validated({**data, section: {name: plain(whole)}})
        for finding in chain(findings, () if deployment is None else needs(deployment, Names(()))):
            if finding.location[:2] == (section, name) and finding.at != "missing" and finding.location[-1] != "tag":
                yield replace(finding, location=(TEMPLATES, *finding.location[1:]))


def _report(found: Sequence[Problem]) -> list[str]:
    """The problems in the order of the file, each once, bounded."""
    lines = [str(problem) for problem in sorted(set(found))]
    if len(lines) <= PROBLEMS_MAX:
        return lines
    return [*lines[:PROBLEMS_MAX], f"and more: only the first {PROBLEMS_MAX} problems are shown"]
