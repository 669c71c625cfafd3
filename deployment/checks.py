"""Checks between the fields of a deployment: references to names, and numbers that depend on each other.

It reads the plain data of a file, not the models, so that these problems are found beside those of single fields, in
one go: whatever is missing or malformed is passed over here, since the schema reports it. deployment_file.py turns
findings into lines with places; what concerns the network is in
network_references.py, rates and offsets are in timing_references.py.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fnmatch import translate
from fractions import Fraction
from typing import Any, Final

from foosim.common import limits, names, units
from foosim.common.errors import BadValue
from foosim.common.finding import Finding, Location, path_text
from foosim.common.names import LINE_NAMES, nearest_name
from foosim.deployment.text.selection import TooManyComparisons
from foosim.world.forms.models import MODELS

# Bounds of the checks; the schema refuses larger values.
TEXTS_MAX: Final = 4096
NEAREST_MAX: Final = 128
"""How often a nearest name is looked for: among thousands of names that takes 20 ms, and not all problems are shown."""

WORLD_OF_MODEL: Final[Mapping[str, str]] = {"rod": "table", "camera": "table", "rover": "hall", "station": "hall"}
"""The kind of world that a model of robot is for."""
BODILESS: Final = "camera"
"""The model of robots that have no body."""


def check_references(data: object) -> Iterator[Finding]:
    """All problems between the parts of a deployment's plain data, found lazily."""
    view = View(data)
    between = (_names, _people, _hosts, _robots, _nodes, _players, _hears, _on, _capture, _deadlines)
    for check in (_world, *between, _lines, _shapes, _hall, _scenery):
        yield from check(view)


def quoted(nearest: str | None) -> str | None:
    return None if nearest is None else repr(nearest)


class View:
    """Tolerant access to plain data: a value of an unexpected kind reads as empty."""

    def __init__(self, data: object, endpoints: Sequence[str] | None = None) -> None:
        self.data = data
        self.robots = self.mapping("robots")
        self.hosts = self.mapping("hosts")
        self.nodes = self.mapping("nodes")
        self.players = self.mapping("players")
        self.clients = self.mapping("clients")
        self.endpoints = [*self.robots, *self.players, *self.clients] if endpoints is None else endpoints
        self._matched: dict[str, list[str]] = {}
        self._compared = 0
        self._nearest = 0

    def get(self, *path: str | int) -> Any:
        value = self.data
        for step in path:
            if isinstance(value, dict) and isinstance(step, str):
                value = value.get(step)
            elif isinstance(value, list) and isinstance(step, int) and step < len(value):
                value = value[step]
            else:
                return None
        return value

    def mapping(self, *path: str | int) -> Mapping[str, Any]:
        value = self.get(*path)
        return value if isinstance(value, dict) else {}

    def texts(self, *path: str | int) -> list[tuple[int, str]]:
        """The texts of a list, or the single text in place of it, with their indices."""
        value = self.get(*path)
        items = value if isinstance(value, list) else [value]
        return [(index, item) for index, item in enumerate(items[:TEXTS_MAX]) if isinstance(item, str)]

    def length(self, *path: str, world: str = "table") -> Fraction | None:
        """A length of the table (or hall) in metres, exact; None if it is not one."""
        try:
            return units.parse(self.get(world, *path), units.LENGTH)
        except BadValue:
            return None

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
        """The valid name most similar to a wrong one, in quotes; it is looked for so many times."""
        self._nearest += 1
        return quoted(nearest_name(value, choices)) if self._nearest <= NEAREST_MAX else None

    def tick_ns(self) -> int | None:
        try:
            return units.parse_ns(self.get("tick")) or None
        except BadValue:
            return None


def _world(view: View) -> Iterator[Finding]:
    """There is one world, a table or a hall, and robots are in the kind of world that they are for."""
    given = [kind for kind in WORLD_OF_MODEL.values() if view.get(kind) is not None]
    if len({*given}) > 1:
        yield Finding(("hall",), "a hall beside a table: a world is one of them", "hall", at="key")
    if not given:
        if not isinstance(view.data, dict):
            return
        yield Finding(("table",), "missing key of a world, which is a table or a hall", "table", at="missing")
        return
    for name in view.robots:
        model = view.get("robots", name, "model")
        needed = WORLD_OF_MODEL.get(model) if isinstance(model, str) else None
        if needed is not None and needed not in given:
            yield Finding(("robots", name, "model"), f"a robot of a {needed} in a world without one", model)


def _names(view: View) -> Iterator[Finding]:
    """Endpoints, and the processes that a run starts, have names of their own."""
    endpoints: dict[str, str] = {}
    processes: dict[str, str] = {}
    for section, scopes, reserved in (
        ("robots", (endpoints,), names.ENTITY_NAMES_RESERVED),
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
        if role[0] == "nodes" and launch in ("manual", "systemd"):
            yield Finding(location, f"a process for a node with `launch: {launch}`, which has its own", process)
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
    """Lines exist and have one rod a team; channels have names of their own."""
    rods: dict[tuple[str, str], str] = {}
    lines = view.get("table", "lines")
    for name in view.robots:
        yield from _channels(view, name)
        team, line = view.get("robots", name, "team"), view.get("robots", name, "line")
        if not (isinstance(team, str) and isinstance(line, str)):
            continue
        if line in LINE_NAMES and isinstance(lines, dict) and line not in lines:
            yield Finding(("robots", name, "line"), "not in table.lines", line, view.nearest(line, lines))
        first = rods.setdefault((team, line), name)
        if first != name:
            yield Finding(("robots", name, "line"), f"{team}'s line is already the rod {first}", line)


def _channels(view: View, robot: str) -> Iterator[Finding]:
    """The components of a robot have names of their own, and none is called like the channel that every robot has."""
    model = view.get("robots", robot, "model")
    actuators = view.mapping("robots", robot, "actuators")
    if view.get("robots", robot, "actuators") is None and isinstance(model, str) and model in MODELS:
        actuators = MODELS[model].actuators
    for section, others in (("sensors", actuators), ("actuators", {})):
        for channel in view.mapping("robots", robot, section):
            location = ("robots", robot, section, channel)
            if channel == names.CHANNEL_ECHO:
                yield Finding(location, "a reserved name", channel, at="key")
            elif channel in others:
                yield Finding(location, f"a name that is also one of {robot}'s actuators", channel, at="key")


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


def _lines(view: View) -> Iterator[Finding]:
    """Figures stay off the side walls, rods span the field, at either end of the stroke."""
    width, foot, rod = view.length("field", "width"), view.length("rod", "foot", "width"), view.length("rod", "length")
    for line in view.mapping("table", "lines"):
        figures = view.get("table", "lines", line, "figures")
        pitch, stroke = view.length("lines", line, "pitch"), view.length("lines", line, "half_stroke")
        if width is None or stroke is None:
            continue
        location = ("table", "lines", line, "half_stroke")
        value = view.get(*location)
        if foot is not None and pitch is not None and isinstance(figures, int) and 1 <= figures <= 11:
            free = (width - pitch * (figures - 1) - foot) / 2
            if stroke > free:
                yield Finding(location, "figures would reach the side wall", value, _millimetres(free))
        if rod is not None and rod / 2 - stroke < width / 2:
            yield Finding(location, "the rod would leave the field uncovered", value, _millimetres((rod - width) / 2))


def _shapes(view: View) -> Iterator[Finding]:
    """The table's lengths describe a table that can be built."""
    for small, big, why in (
        (("rod", "inner_radius"), ("rod", "radius"), ""),
        (("rod", "foot_radius"), ("rod", "axis_height"), "the feet would reach the floor: "),
        (("rod", "figure_com_below_axis"), ("rod", "foot_radius"), ""),
        (("goal", "width"), ("field", "width"), ""),
        (("goal", "height"), ("walls", "height"), ""),
    ):
        yield from _too_big(view, small, big, why)
    for side in ("depth", "width", "height"):
        yield from _too_big(view, ("ball", "radius"), ("goal", side), "the ball would not fit: ", 2)


def _too_big(view: View, small: Location, big: Location, why: str, times: int = 1) -> Iterator[Finding]:
    """A length of the table of which `times` as much is not below another one; `why` that is wrong."""
    least, most = (view.length(*map(str, where)) for where in (small, big))
    if least is None or most is None or times * least < most:
        return
    small, big = ("table", *small), ("table", *big)
    twice, half = ("twice that is ", "twice ") if times > 1 else ("", "")
    below = f"{why}{twice}not below {path_text(big)} ({_mm(most)}), valid is below {_mm(most / times)}"
    above = f"{why}not above {half}{path_text(small)} ({_mm(least)}), valid is above {_mm(least * times)}"
    yield Finding(small, below, view.get(*small), other=Finding(big, above, view.get(*big)))


def _hall(view: View) -> Iterator[Finding]:
    """A rover's parts fit each other, and it fits into the hall."""
    rover: Location = ("hall", "rover")
    radius, track = view.length("rover", "radius", world="hall"), view.length("rover", "drive", "track", world="hall")
    sides = [side for name in ("length", "width") if (side := view.length(name, world="hall")) is not None]
    if radius is not None and sides and 2 * radius > min(sides):
        yield Finding((*rover, "radius"), "more than half of the hall's least side", view.get(*rover, "radius"))
    if radius is not None and track is not None and track > 2 * radius:
        what = "the wheels would be outside of the rover: more than twice its radius"
        yield Finding((*rover, "drive", "track"), what, view.get(*rover, "drive", "track"))
    empty = view.get(*rover, "battery", "empty")
    try:
        below = units.parse(empty, units.VOLTAGE) < units.parse(view.get(*rover, "battery", "full"), units.VOLTAGE)
    except BadValue:
        return
    if not below:
        yield Finding((*rover, "battery", "empty"), "not below the full battery's voltage", empty)


def _scenery(view: View) -> Iterator[Finding]:
    """The pure engine has no meshes, a hall no ball that feels surfaces; waves cross a material, or have a loss."""
    for name in view.mapping("scenery"):
        if name in view.robots:
            yield Finding(("scenery", name), "a name that is also a robot's", name, at="key")
        if view.get("table") is None:
            surface = view.get("scenery", name, "surface")
            if surface is not None:
                yield Finding(("scenery", name, "surface"), "a surface for a ball, in a world without one", surface)
        elif view.get("engine") == "pure" and view.get("scenery", name, "shape") == "mesh":
            what = "the engine pure has no meshes (boxes and cylinders it has, and the engine bullet has all)"
            yield Finding(("scenery", name, "shape"), what, "mesh", "'box'")
        yield from _radio(view, ("scenery", name, "radio"))


def _radio(view: View, radio: Location) -> Iterator[Finding]:
    """Waves cross a material, or have a fixed loss: exactly one is given."""
    given = {key: value for key, value in view.mapping(*radio).items() if value is not None}
    if isinstance(view.get(*radio), dict) and not given.keys() & {"is", "loss"}:
        yield Finding((*radio, "is"), "missing key of a material, unless it has a loss", "is", at="missing")
    for key in ("is", "thickness"):
        if key in given and "loss" in given:
            yield Finding((*radio, key), "a loss holds whatever it is made of: not beside one", key, at="key")


def _millimetres(length: Fraction) -> str | None:
    return None if length <= 0 else f"'{_mm(length)}'"


def _mm(length: Fraction) -> str:
    return f"{float(length * 1000):g} mm"
