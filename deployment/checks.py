"""Checks between the fields of a deployment: references to names, and numbers that depend on each other.

It reads the plain data of a file, not the models, so that these problems are found beside those of single fields, in
one go: whatever is missing or malformed is passed over here, since the schema reports it. loader.py turns findings into
lines with places; what concerns the network is in network_checks.py and radio_checks.py, rates and offsets are in
timing_checks.py.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import translate
from typing import Any, Final

from pydantic import ValidationError

from foosim.common import limits, names, units
from foosim.common.errors import BadValue, Refused, describe
from foosim.common.finding import Finding, Location, path_text
from foosim.common.plain_data import PlainData
from foosim.deployment.schema import Deployment
from foosim.deployment.schema_errors import settings_findings
from foosim.deployment.text.selection import TooManyComparisons
from foosim.world.assembly.misfits import find_kit_model, kit_problems, needs_kit, rule_problems
from foosim.world.forms import registry
from foosim.world.forms.failures import failure_of
from foosim.world.forms.forms import Engine, Kit, Model, WorldRule
from foosim.world.layout import WORLD
from foosim.world.spec import KITS

DEPLOYMENT_KEYS: Final = frozenset(
    field.alias or name for name, field in Deployment.model_fields.items() if name != KITS
)
"""The keys of a deployment that are no kit's."""


def check_references(data: object) -> Iterator[Finding]:
    """All problems between the parts of a deployment's plain data, found lazily."""
    view = View(data)
    between = (_names, _people, _hosts, _robots, _nodes, _players, _hears, _on, _capture, _deadlines)
    for check in (_kits, *between, _scenery):
        yield from check(view)


class View(PlainData):
    """The plain data of a deployment, with its endpoints."""

    def __init__(self, data: object, endpoints: Sequence[str] | None = None) -> None:
        super().__init__(data)
        self.robots = self.mapping("robots")
        self.hosts = self.mapping("hosts")
        self.nodes = self.mapping("nodes")
        self.players = self.mapping("players")
        self.clients = self.mapping("clients")
        self.endpoints = [*self.robots, *self.players, *self.clients] if endpoints is None else endpoints
        self._matched: dict[str, list[str]] = {}
        self._compared = 0

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

    def tick_ns(self) -> int | None:
        try:
            return units.parse_ns(self.get("tick")) or None
        except BadValue:
            return None


def kits_of(view: PlainData) -> Iterator[tuple[str, Kit]]:
    """Yield the kits whose sections a deployment has."""
    for key in view.mapping():
        if view.get(key) is not None and key not in DEPLOYMENT_KEYS:
            try:
                kit = registry.lookup("kit", key)
            except Refused:
                continue
            if kit is not None:
                assert isinstance(kit, Kit), kit
                yield key, kit


def _kits(view: View) -> Iterator[Finding]:
    """Settings of a kit fit each other; what it brings into the world can be there, and has names of its own."""
    kits = dict(kits_of(view))
    for key, kit in kits.items():
        check = getattr(kit.made, "check", None)
        try:
            yield from [*check(view)] if check is not None else []
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # SystemExit, too: a kit may do anything
            if kit.is_own:
                raise
            yield Finding((key,), f"kit {key}: check fails: {failure_of(error, kit.module)}", key, at="key")
        for problem in (*kit_problems(key, kit, kits, (WORLD,)), *_rules_of_kit(key, kit, kits)):
            yield Finding((key,), f"kit {key}: {problem}", key, at="key")
    for label in view.mapping("rules"):
        others = [key for key, kit in kits.items() if label in kit.rules]
        if others:
            what = f"a rule that the kit {others[0]} has already: each world with a {others[0]} has it"
            yield Finding(("rules", label), what, label, at="key")


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
            for finding in settings_findings(error, rule.settings, ()):
                path = path_text(finding.location if finding.at == "value" else finding.location[:-1])
                text = describe(finding.what, finding.value, finding.nearest)
                yield f"its rule {label}: {path}{': ' if path else ''}{text}"
        else:
            assert isinstance(rule, WorldRule), rule
            for problem in (*needs_kit(rule, kits), *rule_problems(rule)):
                yield f"its rule {label}: {problem}"


def _names(view: View) -> Iterator[Finding]:
    """Entities, endpoints, and the processes that a run starts, have names of their own."""
    entities: dict[str, str] = {}
    endpoints: dict[str, str] = {}
    processes: dict[str, str] = {}
    for section, scopes, reserved in (
        ("robots", (entities, endpoints), reserved_entities(view)),
        ("objects", (entities,), reserved_entities(view)),
        ("nodes", (processes,), names.PROCESS_NAMES_RESERVED),
        ("players", (endpoints, processes), names.PROCESS_NAMES_RESERVED),
        ("clients", (endpoints, processes), names.PROCESS_NAMES_RESERVED),
    ):
        for name in view.mapping(section):
            if name in reserved:
                yield Finding((section, name), "a reserved name", name, at="key")
            other = next((scope[name] for scope in scopes if name in scope), None)
            if other is not None:
                yield Finding((section, name), f"a name that is also one of {other}", name, at="key")
            for scope in scopes:
                scope.setdefault(name, section)
    yield from _processes(view, processes)


def reserved_entities(view: PlainData) -> tuple[str, ...]:
    """Return names that no robot and no object can have: the world itself, and what its kits put into it."""
    return (WORLD, *(name for _, kit in kits_of(view) for name in kit.entities))


def _people(view: View) -> Iterator[Finding]:
    """An operator and a viewer of one name would receive each other's answers."""
    operators = view.get("access", "operators")
    known = operators if isinstance(operators, list) else ["admin"]
    for index, name in view.texts("access", "viewers"):
        if name in known:
            yield Finding(("access", "viewers", index), "a viewer who is an operator, too", name)


def _processes(view: View, taken: Mapping[str, str]) -> Iterator[Finding]:
    """A process that roles share has a name of its own, is in one place, and is started by `up`."""
    places: dict[str, tuple[Any, Any]] = {}
    roles: list[Location] = [("supervisor",), ("vhub",)]
    roles += [("nodes", node) for node in view.mapping("nodes")]
    roles += [("players", player) for player in view.players]
    for role in roles:
        process, location = view.get(*role, "process"), (*role, "process")
        if not isinstance(process, str):
            continue
        if process in names.PROCESS_NAMES_RESERVED:
            yield Finding(location, "a reserved name", process)
        elif process in taken:
            yield Finding(location, f"a name that is also one of {taken[process]}", process)
        place = view.get(*role, "host"), view.get(*role, "label")
        if places.setdefault(process, place) != place:
            yield Finding(location, "a process whose roles are not all on the same host", process)
        launch = view.get(*role, "launch")
        if role[0] in ("nodes", "players") and launch in ("manual", "systemd"):
            what = f"a process for a {role[0][:-1]} with `launch: {launch}`, which has its own"
            yield Finding(location, what, process)
        is_apart = process == view.get("supervisor", "process") != view.get("vhub", "process")
        if role[0] == "players" and is_apart:  # it would start before it is known where to connect
            yield Finding(location, "a player shares the supervisor's process only together with the vHub", process)


def _hosts(view: View) -> Iterator[Finding]:
    """Processes are placed on hosts that exist, by name or by label; a unit of systemd needs such a place."""
    labels = {label for host in view.hosts for _, label in view.texts("hosts", host, "labels")}
    places: list[Location] = [(section, name) for section in ("nodes", "players") for name in view.mapping(section)]
    for place in (*places, ("vhub",)):
        host, label = view.get(*place, "host"), view.get(*place, "label")
        if isinstance(host, str) and host not in view.hosts:
            yield Finding((*place, "host"), "unknown host", host, view.nearest(host, view.hosts))
        if isinstance(label, str) and host is not None:
            yield Finding((*place, "label"), "a label beside a host: one of them says where", label)
        elif isinstance(label, str) and label not in labels:
            nearest = view.nearest(label, labels)
            yield Finding((*place, "label"), "a label that no host has", label, nearest)
        if host is None and label is None and view.get(*place, "launch") == "systemd":
            yield Finding((*place, "launch"), "a unit of systemd needs a host or a label", "systemd")


def _robots(view: View) -> Iterator[Finding]:
    """Channels have names of their own."""
    for name in view.robots:
        yield from _channels(view, name)


def _channels(view: View, robot: str) -> Iterator[Finding]:
    """The components of a robot have names of their own, and none is called like the channel that every robot has."""
    model = view.get("robots", robot, "model")
    actuators = view.mapping("robots", robot, "actuators")
    if view.get("robots", robot, "actuators") is None and isinstance(model, str):
        actuators = _usual_actuators(model, view.get("robots", robot, "dynamics"))
    for section, others in (("sensors", actuators), ("actuators", {})):
        for channel in view.mapping("robots", robot, section):
            location = ("robots", robot, section, channel)
            if channel == names.CHANNEL_ECHO:
                yield Finding(location, "a reserved name", channel, at="key")
            elif channel in others:
                yield Finding(location, f"a name that is also one of {robot}'s actuators", channel, at="key")


def has_body(view: PlainData, model: object) -> bool:
    """Whether robots of a model are somewhere; of one that is not known, or not for this world, it is taken so."""
    try:
        found = registry.find_model(model) if isinstance(model, str) else None
    except Refused:
        return True
    return found is None or found.has_body or bool(found.kit and view.get(found.kit) is None)


def _usual_actuators(model: str, dynamics: object) -> Mapping[str, Any]:
    """Return the actuators of robots of a model, with these dynamics, that say nothing of theirs."""
    try:
        return registry.find_model(model).variant(dynamics).actuators
    except Refused:
        return {}


def _nodes(view: View) -> Iterator[Finding]:
    """Every robot has exactly one owner."""
    owner: dict[str, str] = {}
    if not view.robots:
        return
    for node in view.nodes:
        for index, robot in view.texts("nodes", node, "robots"):
            location = ("nodes", node, "robots", index)
            if robot not in view.robots:
                yield Finding(location, "unknown robot", robot, view.nearest(robot, view.robots))
            elif robot in owner:
                what = (
                    "listed twice" if owner[robot] == node else f"a robot with two owners, also of node {owner[robot]}"
                )
                yield Finding(location, what, robot)
            owner.setdefault(robot, node)
    for robot in view.robots:
        if robot not in owner and view.nodes:
            yield Finding(("robots", robot), "a robot that no node owns", robot, at="key")


def _players(view: View) -> Iterator[Finding]:
    """Players name robots that exist, and channels that those have."""
    for player in view.players if view.robots else ():
        for robot in view.mapping("players", player, "robots"):
            location: Location = ("players", player, "robots", robot)
            if robot not in view.robots:
                yield Finding(location, "unknown robot", robot, view.nearest(robot, view.robots), at="key")
                continue
            sensors = view.get("robots", robot, "sensors")
            if not isinstance(sensors, dict):
                continue
            channels = [*sensors, names.CHANNEL_ECHO]
            seen = set()
            for index, channel in view.texts(*location):
                if channel not in channels:
                    nearest = view.nearest(channel, channels)
                    yield Finding((*location, index), f"{robot} has no such channel", channel, nearest)
                elif channel in seen:
                    yield Finding((*location, index), "a channel that is listed twice", channel)
                seen.add(channel)


def _hears(view: View) -> Iterator[Finding]:
    """A player's `hears`: selectors that match another endpoint, channels that one of these has."""
    said: dict[str, set[str]] = {}
    for player in view.players if view.robots else ():
        for glob in view.mapping("players", player, "hears"):
            location: Location = ("players", player, "hears", glob)
            if not names.is_selector(glob):
                continue
            matched = view.matched(glob)
            if all(name == player for name in matched):
                nearest = view.nearest(glob, [name for name in view.endpoints if name != player])
                yield Finding(location, "a selector that matches no other endpoint", glob, nearest, at="key")
                continue
            if glob not in said:
                said[glob] = {channel for name in matched for channel in view.mapping("robots", name, "sensors")}
            if any(name not in view.robots and name != player for name in matched):
                continue
            sensors = said[glob]
            for index, channel in view.texts(*location):
                if channel not in (*sensors, names.CHANNEL_ECHO):
                    nearest = view.nearest(channel, [*sensors, names.CHANNEL_ECHO])
                    yield Finding((*location, index), f"{glob} has no such channel", channel, nearest)


def _on(view: View) -> Iterator[Finding]:
    """Players and clients are on board of robots that exist."""
    for section in ("players", "clients"):
        for name in view.mapping(section) if view.robots else ():
            robot = view.get(section, name, "on")
            if isinstance(robot, str) and robot not in view.robots:
                yield Finding((section, name, "on"), "unknown robot", robot, view.nearest(robot, view.robots))


def _capture(view: View) -> Iterator[Finding]:
    """`keep_last` deletes whole files."""
    last = view.get("capture", "last")
    if last is not None and all(view.get("capture", key) is None for key in ("split_size", "split_time")):
        what = "whole files are let go: needs split_size or split_time"
        yield Finding(("capture", "last"), what, last)


def _deadlines(view: View) -> Iterator[Finding]:
    """The deadline that reports a late process is before the one that drops it."""
    try:
        named_ns = units.parse_ns(view.get("deadlines", "tick_named"))
        lost_ns = units.parse_ns(view.get("deadlines", "tick_lost"))
    except BadValue:
        return
    if named_ns > lost_ns:
        yield Finding(("deadlines", "tick_named"), "longer than tick_lost", view.get("deadlines", "tick_named"))


def _scenery(view: View) -> Iterator[Finding]:
    """Some engines have no meshes, only free bodies feel surfaces; waves cross a material, or have a loss."""
    engine = view.get("engine")
    no_meshes = isinstance(engine, str) and _is_without_meshes(engine)
    has_rigid = any(model.can_be_free for model in _models(view))
    objects = view.mapping("objects")
    for name in view.mapping("scenery"):
        for owner, things in (("a robot's", view.robots), ("an object's", objects)):
            if name in things:
                yield Finding(("scenery", name), f"a name that is also {owner}", name, at="key")
        if not has_rigid:
            surface = view.get("scenery", name, "surface")
            if surface is not None:
                what = "a surface for free bodies, in a world without any"
                yield Finding(("scenery", name, "surface"), what, surface)
        elif no_meshes and view.get("scenery", name, "shape") == "mesh":
            what = f"the engine {engine} has no meshes (boxes and cylinders it has, and the engine bullet has all)"
            yield Finding(("scenery", name, "shape"), what, "mesh", "'box'")
        yield from _radio(view, ("scenery", name, "radio"))


def _models(view: View) -> Iterator[Model]:
    """Yield the models of robots and objects, of what kits put into the world, and of what can be added, where there
    are such; each as the variant of it that is meant."""
    named: set[tuple[str, Any]] = set()
    for section in ("robots", "objects"):
        for entity in view.mapping(section):
            dynamics = view.get(section, entity, "dynamics")
            for _, model in view.texts(section, entity, "model"):
                named.add((model, dynamics if isinstance(dynamics, str) else ""))
    for _, kit in kits_of(view):
        named |= {(model, "") for model in (*kit.entities.values(), *kit.addable)}
    for name, dynamics in sorted(named):
        found = find_kit_model(name)
        if found is not None:
            yield found.variant(dynamics)


def _is_without_meshes(engine: str) -> bool:
    """Whether an engine is known to have no meshes; what is wrong with its name is found elsewhere."""
    try:
        found = registry.find("engine", engine)
    except Refused:
        return False
    assert isinstance(found, Engine), found
    return not found.meshes


def _radio(view: View, radio: Location) -> Iterator[Finding]:
    """Waves cross a material, or have a fixed loss: exactly one is given."""
    given = {key: value for key, value in view.mapping(*radio).items() if value is not None}
    if isinstance(view.get(*radio), dict) and not given.keys() & {"is", "loss"}:
        yield Finding((*radio, "is"), "missing key of a material, unless it has a loss", "is", at="missing")
    for key in ("is", "thickness"):
        if key in given and "loss" in given:
            yield Finding((*radio, key), "a loss holds whatever it is made of: not beside one", key, at="key")
