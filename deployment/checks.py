"""Checks between the fields of a deployment: references to names, and numbers that depend on each other.

They read the typed deployment, when each of its fields is right by itself. A finding's value is what is written at its
location; loader.py turns findings into lines with places. What concerns the network is in network_checks.py and
radio_checks.py, rates and offsets are in timing_checks.py.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fnmatch import translate
from typing import Any, Final

from pydantic import ValidationError

from foosim.common import limits, names
from foosim.common.errors import BadValue
from foosim.common.finding import Finding, Location
from foosim.common.names import nearest_quoted
from foosim.deployment.schema import Deployment
from foosim.deployment.schema_errors import settings_findings
from foosim.deployment.text.selection import TooManyComparisons
from foosim.world.assembly.misfits import checked_spares, find_kit_model, kit_problems, needs_kit, rule_problems
from foosim.world.forms import registry
from foosim.world.forms.failures import failure_of
from foosim.world.forms.forms import Kit, Model, WorldRule
from foosim.world.layout import WORLD
from foosim.world.matter.materials import RadioMaterial
from foosim.world.scenery import SceneryMesh
from foosim.world.spec import KITS

DEPLOYMENT_KEYS: Final = frozenset(
    field.alias or name for name, field in Deployment.model_fields.items() if name != KITS
)
"""The keys of a deployment that are no kit's."""
NEAREST_MAX: Final = 128
"""How often a nearest name is looked for: among thousands of names that takes 20 ms, and not all problems are shown."""


class Names:
    """The names of a deployment's endpoints, and the comparisons with them, which are bounded."""

    def __init__(self, endpoints: Sequence[str]) -> None:
        self.endpoints = endpoints
        self._matched: dict[str, list[str]] = {}
        self._compared = self._nearest = 0

    def matched(self, glob: str) -> Sequence[str]:
        """The endpoints that a selector matches, with which it is compared once. Raises TooManyComparisons."""
        found = self._matched.get(glob)
        if found is None:
            self._compared += len(self.endpoints)
            if self._compared > limits.COMPARISONS_MAX:
                raise TooManyComparisons
            match = re.compile(translate(glob)).match
            found = self._matched[glob] = [name for name in self.endpoints if match(name)]
        return found

    def nearest(self, value: str, choices: Iterable[str]) -> str | None:
        """The valid name most similar to a wrong one, in quotes."""
        self._nearest += 1
        return nearest_quoted(value, choices) if self._nearest <= NEAREST_MAX else None


def check_references(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """All problems between the parts of a deployment, found lazily."""
    yield from _kits(deployment)
    yield from _names(deployment)
    yield from _processes(deployment)
    yield from _hosts(deployment, ends)
    yield from _nodes(deployment, ends)
    yield from _players(deployment, ends)
    yield from _hears(deployment, ends)
    yield from _settings(deployment, ends)
    yield from _scenery(deployment)


def _kit_forms(deployment: Deployment) -> dict[str, Kit]:
    """Return the kits whose sections a deployment has."""
    return {name: kit for name in deployment.kits if isinstance(kit := registry.find("kit", name), Kit)}


def _kits(deployment: Deployment) -> Iterator[Finding]:
    """Settings of a kit fit each other; what it brings into the world can be there, and has names of its own."""
    kits = _kit_forms(deployment)
    spares = {key: checked_spares(deployment, kit) for key, kit in kits.items()}
    entities = {key: {**kit.entities, **spares[key][0]} for key, kit in kits.items()}
    for key, kit in kits.items():
        made: Any = kit.factory
        try:
            yield from [*made.check(deployment.kits[key], deployment)]
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # SystemExit, too: a kit may do anything
            if kit.is_own:
                raise
            yield Finding((key,), f"kit {key}: check fails: {failure_of(error, kit.module)}", at="key")
        of_entities = kit_problems(key, entities, kits, (WORLD,))
        for problem in (*spares[key][1], *of_entities, *_rules_of_kit(key, kit, kits)):
            yield Finding((key,), f"kit {key}: {problem}", at="key")
    for label in deployment.rules:
        others = [key for key, kit in kits.items() if label in kit.rules]
        if others:
            what = f"a rule that the kit {others[0]} has already: each world with a {others[0]} has it"
            yield Finding(("rules", label), what, at="key")


def _rules_of_kit(name: str, kit: Kit, kits: Mapping[str, Kit]) -> Iterator[str]:
    """Yield what is wrong with the rules that a kit brings."""
    for label, settings in kit.rules.items():
        for other in kits:
            if other < name and label in kits[other].rules:
                yield f"its rule {label} has a name that is also one of the kit {other}'s"
        try:
            rule = registry.find("rule", settings["kind"])
            rule.settings.model_validate(dict(settings))
        except BadValue as error:
            yield f"its rule {label}: {error}"
        except ValidationError as error:
            yield from (f"its rule {label}: {finding.text}" for finding in settings_findings(error, rule.settings, ()))
        else:
            assert isinstance(rule, WorldRule), rule
            for problem in (*needs_kit(rule, kits), *rule_problems(rule)):
                yield f"its rule {label}: {problem}"


def _names(deployment: Deployment) -> Iterator[Finding]:
    """Entities, endpoints, processes that a run starts, and the channels of a robot, have names of their own."""
    entities: dict[str, str] = {}
    endpoints: dict[str, str] = {}
    processes: dict[str, str] = {}
    kits = _kit_forms(deployment).values()
    reserved = (WORLD, *(name for kit in kits for name in (*kit.entities, *checked_spares(deployment, kit)[0])))
    for section, scopes, refused in (
        ("robots", (entities, endpoints), reserved),
        ("objects", (entities,), reserved),
        ("nodes", (processes,), names.PROCESS_NAMES_RESERVED),
        ("players", (endpoints, processes), names.PROCESS_NAMES_RESERVED),
        ("clients", (endpoints, processes), names.PROCESS_NAMES_RESERVED),
    ):
        for name in getattr(deployment, section):
            if name in refused:
                yield Finding((section, name), "a reserved name", at="key")
            other = next((scope[name] for scope in scopes if name in scope), None)
            if other is not None:
                yield Finding((section, name), f"a name that is also one of {other}", at="key")
            for scope in scopes:
                scope.setdefault(name, section)
    for name, robot in deployment.robots.items():
        for section, others in (("sensors", robot.actuators), ("actuators", {})):
            for channel in getattr(robot, section):
                location = ("robots", name, section, channel)
                if channel == names.CHANNEL_ECHO:
                    yield Finding(location, "a reserved name", at="key")
                elif channel in others:
                    yield Finding(location, f"a name that is also one of {name}'s actuators", at="key")


def _processes(deployment: Deployment) -> Iterator[Finding]:
    """A process that roles share has a name of its own, is in one place, and is started by `up`."""
    sections = {name: section for section in ("clients", "players", "nodes") for name in getattr(deployment, section)}
    places: dict[str, tuple[Any, Any]] = {}
    for role, about in (("supervisor",), deployment.supervisor), *_placed(deployment):
        process, location = about.process, (*role, "process")
        if process is None:
            continue
        if process in names.PROCESS_NAMES_RESERVED:
            yield Finding(location, "a reserved name")
        elif process in sections:
            yield Finding(location, f"a name that is also one of {sections[process]}")
        place = getattr(about, "host", None), getattr(about, "label", None)
        if places.setdefault(process, place) != place:
            yield Finding(location, "a process whose roles are not all on the same host")
        launch = getattr(about, "launch", "local")
        if launch != "local":
            yield Finding(location, f"a process for a {role[0][:-1]} with `launch: {launch}`, which has its own")
        is_apart = process == deployment.supervisor.process != deployment.vhub.process
        if role[0] == "players" and is_apart:  # it would start before it is known where to connect
            yield Finding(location, "a player shares the supervisor's process only together with the vHub")


def _placed(deployment: Deployment) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield the roles whose processes are placed on hosts, by location."""
    yield ("vhub",), deployment.vhub
    for section in ("nodes", "players"):
        yield from (((section, name), about) for name, about in getattr(deployment, section).items())


def _hosts(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """Processes are placed on hosts that exist, by name or by label; a unit of systemd needs such a place."""
    hosts = deployment.hosts
    labels = {label for host in hosts.values() for label in host.labels}
    for role, about in _placed(deployment):
        if about.host is not None and about.host not in hosts:
            yield Finding((*role, "host"), "unknown host", nearest=ends.nearest(about.host, hosts))
        if about.label is not None and about.host is not None:
            yield Finding((*role, "label"), "a label beside a host: one of them says where")
        elif about.label is not None and about.label not in labels:
            yield Finding((*role, "label"), "a label that no host has", nearest=ends.nearest(about.label, labels))
        if about.host is None and about.label is None and getattr(about, "launch", "") == "systemd":
            yield Finding((*role, "launch"), "a unit of systemd needs a host or a label")


def _nodes(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """Every robot has exactly one owner."""
    owner: dict[str, str] = {}
    for node, about in deployment.nodes.items():
        for index, robot in enumerate(about.robots):
            location = ("nodes", node, "robots", index)
            if robot not in deployment.robots:
                yield Finding(location, "unknown robot", robot, ends.nearest(robot, deployment.robots))
            elif robot in owner:
                other = owner[robot]
                what = "listed twice" if other == node else f"a robot with two owners, also of node {other}"
                yield Finding(location, what, robot)
            owner.setdefault(robot, node)
    for robot in deployment.robots:
        if robot not in owner:
            yield Finding(("robots", robot), "a robot that no node owns", at="key")


def _players(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """Players name robots that exist, and channels that those have."""
    for player, about in deployment.players.items():
        for robot, chosen in about.robots.items():
            location: Location = ("players", player, "robots", robot)
            if robot not in deployment.robots:
                yield Finding(location, "unknown robot", nearest=ends.nearest(robot, deployment.robots), at="key")
                continue
            channels = [*deployment.robots[robot].sensors, names.CHANNEL_ECHO]
            for index, channel in enumerate(chosen):
                if channel not in channels:
                    nearest = ends.nearest(channel, channels)
                    yield Finding((*location, index), f"{robot} has no such channel", nearest=nearest)
                elif channel in chosen[:index]:
                    yield Finding((*location, index), "a channel that is listed twice")


def _hears(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """A player's `hears`: selectors that match another endpoint, channels that one of these has."""
    robots = deployment.robots
    said: dict[str, set[str]] = {}
    for player, about in deployment.players.items():
        for glob, channels in about.hears.items():
            location: Location = ("players", player, "hears", glob)
            matched = ends.matched(glob)
            if all(name == player for name in matched):
                nearest = ends.nearest(glob, [name for name in ends.endpoints if name != player])
                yield Finding(location, "a selector that matches no other endpoint", nearest=nearest, at="key")
                continue
            if glob not in said:
                said[glob] = {channel for name in matched if name in robots for channel in robots[name].sensors}
            if any(name not in robots and name != player for name in matched):
                continue
            valid = {*said[glob], names.CHANNEL_ECHO}
            for index, channel in enumerate(channels):
                if channel not in valid:
                    nearest = ends.nearest(channel, valid)
                    yield Finding((*location, index), f"{glob} has no such channel", nearest=nearest)


def _settings(deployment: Deployment, ends: Names) -> Iterator[Finding]:
    """Settings that depend on one another: of players and clients on board, people, the capture, deadlines."""
    for section in ("players", "clients"):
        for name, about in getattr(deployment, section).items():
            if about.on is not None and about.on not in deployment.robots:
                nearest = ends.nearest(about.on, deployment.robots)
                yield Finding((section, name, "on"), "unknown robot", nearest=nearest)
    consoles = [name for name, client in deployment.clients.items() if client.console]
    for name in consoles[1:]:
        yield Finding(("clients", name, "console"), f"a second one: {consoles[0]} is the console's")
    for name in consoles:
        client = deployment.clients[name]
        if client.lockstep:
            yield Finding(("clients", name, "lockstep"), "the console is not in lockstep: the run would wait for it")
        if client.on is not None:
            yield Finding(("clients", name, "on"), "the console is on board of no robot")
    for index, name in enumerate(deployment.access.viewers):  # who would receive each other's answers
        if name in deployment.access.operators:
            yield Finding(("access", "viewers", index), "a viewer who is an operator, too")
    if deployment.capture.last_ns is not None and not deployment.capture.is_split:
        yield Finding(("capture", "last"), "whole files are let go: needs split_size or split_time")
    deadlines = deployment.deadlines
    is_written = deadlines.model_fields_set >= {"tick_named_ns", "tick_lost_ns"}
    if is_written and deadlines.tick_named_ns > deadlines.tick_lost_ns:
        yield Finding(("deadlines", "tick_named"), "longer than tick_lost")


def _scenery(deployment: Deployment) -> Iterator[Finding]:
    """Some engines have no meshes, only free bodies feel surfaces; waves cross a material, or have a loss."""
    engine = registry.find_engine(deployment.engine)
    has_rigid = any(model.can_be_free for model in _models(deployment))
    for name, thing in deployment.scenery.items():
        for owner, things in (("a robot's", deployment.robots), ("an object's", deployment.objects)):
            if name in things:
                yield Finding(("scenery", name), f"a name that is also {owner}", at="key")
        if not has_rigid:
            if "surface" in thing.model_fields_set:
                yield Finding(("scenery", name, "surface"), "a surface for free bodies, in a world without any")
        elif not engine.meshes and isinstance(thing, SceneryMesh):
            valid = "boxes and cylinders it has; bullet and mujoco have all"
            what = f"the engine {deployment.engine} has no meshes ({valid})"
            yield Finding(("scenery", name, "shape"), what, nearest="'box'")
        if thing.radio is not None:
            yield from _radio(thing.radio, ("scenery", name, "radio"))


def _models(deployment: Deployment) -> Iterator[Model]:
    """Yield the models of robots and objects, and of what kits put into the world."""
    yield from map(registry.model_of, (*deployment.robots.values(), *deployment.objects.values()))
    for kit in _kit_forms(deployment).values():
        names = (*kit.entities.values(), *checked_spares(deployment, kit)[0].values())
        yield from (model for name in names if (model := find_kit_model(name)))


def _radio(radio: RadioMaterial, location: Location) -> Iterator[Finding]:
    """Waves cross a material, or have a fixed loss: exactly one is given."""
    if radio.is_ is None and radio.loss_db is None:
        yield Finding((*location, "is"), "missing key of a material, unless it has a loss", at="missing")
    for key, value in (("is", radio.is_), ("thickness", radio.thickness_m)):
        if value is not None and radio.loss_db is not None:
            yield Finding((*location, key), "a loss holds whatever it is made of: not beside one", at="key")
