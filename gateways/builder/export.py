"""From what a MORSE script made to the text of a deployment, or to all problems."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from importlib.resources import files
from itertools import pairwise
from math import hypot
from typing import Any, Final

import yaml

from foosim.common.errors import UnknownName
from foosim.common.limits import NAME_LENGTH_MAX
from foosim.common.names import CHANNEL_ECHO
from foosim.common.units import NS_PER_S, format_ns, format_rate
from foosim.gateways.frames import euler
from foosim.gateways.table import ROWS
from foosim.world.component_types import registry
from foosim.world.scene import Quaternion, Vector, from_rpy, multiply, rotate

BASE_HZ: Final = 60.0
"""Rate of MORSE's steps, and of a component without one of its own."""
LINE_LENGTH_MAX: Final = 150
SUBSTEPS: Final = 2
POSES_HZ: Final = 50
ROBOT_TAG: Final = "robot_tag"
"""What all robots of MORSE have."""
KEYBOARD: Final = "Keyboard"
LEVEL: Final = "abstraction_level"
MIDDLEWARE: Final = ("add_stream", "add_service", "add_interface", "add_default_interface")
OWN: Final = ("#", "label", "at")
"""Keys of a robot that no template has."""
MODULE: Final = "foosim.gateways.builder"
PLAIN: Final = re.compile(r"-?[\w./%+]+(?:[ -][\w./%+-]+)*")
"""Texts that need no quotes."""
WORD: Final = re.compile(r"[-.\d][\d._e+-]*|true|false|null|yes|no|on|off|y|n", re.I)
"""What some version of YAML reads as anything but a text."""

Tree = dict[str, Any]
"""A mapping of a deployment, or what `record` has written of one thing."""
Part = tuple[Tree, str, Tree]
"""A component, its name below its robot, its place on it."""


def data(name: str) -> Any:
    """Return a table of the builder."""
    return yaml.safe_load(files(MODULE).joinpath(name).read_text(encoding="utf-8"))


def written(tree: Tree, indent: str = "") -> Iterator[str]:
    """Yield the lines of YAML. The key `#` is a comment; a mapping without comments inside is one line if it fits."""
    for key, value in tree.items():
        line, is_tree = _flow(value), isinstance(value, dict)
        end = f"  # {value['#']}" if is_tree and "#" in value else ""
        if is_tree and (not indent or '"#"' in json.dumps([*value.values()]) or len(line) > LINE_LENGTH_MAX):
            yield f"{indent}{key}:{end}"
            yield from written(value, f"{indent}  ")
        elif key != "#":
            yield f"{indent}{key}: {line}{end}"


def _flow(value: Any) -> str:
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key}: {_flow(one)}' for key, one in value.items() if key != '#')}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(_flow, value))}]"
    if isinstance(value, str) and PLAIN.fullmatch(value) and not WORD.fullmatch(value):
        return value
    return json.dumps(value)


def name_of(text: str, taken: Iterable[str] = ()) -> str:
    """Return a valid name like one of MORSE, and unlike all names in `taken`."""
    lower = re.sub(r"[^a-z0-9_-]", "-", text.lower())
    plain = (lower if lower[:1].isalpha() else f"n{lower}")[:NAME_LENGTH_MAX]
    others = (f"{plain[: NAME_LENGTH_MAX - 5]}-{count}" for count in range(2, 10_000))
    return next(name for name in (plain, *others) if name not in taken)


def pose(position: Iterable[float], angles: Iterable[float]) -> Tree:
    """Return the setting `at` for a place (m) and roll, pitch, yaw (rad), without zeros; nothing for none at all."""
    units = {"x": "m", "y": "m", "z": "m", "roll": "rad", "pitch": "rad", "yaw": "rad"}
    given = zip(units.items(), (*position, *angles), strict=True)
    at = {key: f"{one:.9g} {unit}" for (key, unit), one in given if round(one, 9)}
    return {"at": at} if at else {}


def formatted(templates: Mapping[str, str], values: Mapping[str, Any]) -> Tree:
    """Return settings with values in their braces; settings without values are left out."""
    named = {key: set(re.findall(r"{(\w+)}", text)) for key, text in templates.items()}
    given = {key: text for key, text in templates.items() if named[key] <= values.keys()}
    return {key: yaml.safe_load(text.format_map(values)) for key, text in given.items()}


def first_of(args: list[Any], kwargs: Tree, default: Any = None) -> Any:
    """Return the first parameter of a call."""
    return [*args, *kwargs.values(), default][0]


class Builder:
    """What a script made, as sections of a deployment."""

    def __init__(self, script: str, recorded: Tree) -> None:
        """`script` is the name of the file."""
        self.script, self.things = script, recorded["things"]
        self.on: Final[dict[int | None, list[Tree]]] = {}
        for thing in self.things:
            self.on.setdefault(thing["parent"], []).append(thing)
        self.problems = [f"{place}: {text}" for place, text in recorded["problems"]]
        self.notes: Final[list[str]] = []
        self.table, self.scenes, self.classes = data("components.yaml"), data("scenes.yaml"), data("robots.yaml")
        self.world: Tree = {}
        self.robots: Final[dict[str, Tree]] = {}
        self.names: Final[dict[str, str]] = {}
        """The names of robots here, by those of MORSE."""
        self.served: Final[dict[str, dict[str, None]]] = {}
        """Robots by the kind of gateway that serves them."""
        self.about: Final[dict[str, Tree]] = {"names": {}, "classes": {}, "alter": {}, "ports": {}}
        """Settings of gateways for robots, and for components by `ROBOT.CHANNEL`."""
        self.fastest_hz, self.base_hz, self.is_fixed, self.has_keyboard = BASE_HZ, 0.0, False, False
        self.pace: str = "realtime"
        self.sync: Tree = {}
        self.given: Tree = {}
        """Properties of the environment."""
        self.chargers: Final[list[Tree]] = []
        self.distribution: dict[str, list[str]] = {}

    def say(self, place: str, text: str) -> None:
        """Add a problem."""
        self.problems.append(f"{place}: {text}")

    def absent(self, place: str, what: str, name: str, choices: Iterable[str]) -> None:
        """Add the problem of an unsupported name, with the supported ones."""
        self.say(place, str(UnknownName(f"{what} is not supported", name, choices)))

    def text(self, nodes: int | None) -> str:
        """Return the deployment, and fill `problems`."""
        environments = [thing for thing in self.things if thing["category"] == "environment"]
        if len(environments) != 1 and not self.problems:
            self.say(self.script, f"a script makes one Environment; this one has made {len(environments)}")
        if not any(thing["category"] == "robots" for thing in self.things) and not self.problems:
            self.say(self.script, "a script makes robots; this one has made none")
        makers = {"robots": self.robot, "objects": self.object, "zones": self.zone, "environment": self.environment}
        for category in ("environment", "zones", "robots", "objects"):
            for thing, name in [(thing, name) for thing, name in self.children(None) if thing["category"] == category]:
                try:
                    makers[category](thing, name)
                except (TypeError, ValueError, LookupError, ArithmeticError, AttributeError) as error:
                    self.say(thing["place"], f"{thing['morse']} has a wrong value: {error!r}")
        for thing, _ in self.children(None):
            if thing["category"] in ("sensors", "actuators"):
                self.say(thing["place"], f"{thing['morse']} is on no robot")
        for thing in self.things:
            if thing["category"] == "absent" and (thing["morse"] != "bpymorse" or thing["calls"]):
                place = thing["calls"][0][1] if thing["calls"] else thing["place"]
                self.say(place, f"{thing['morse']}: {self.table['classes']['absent'][thing['morse']]}")
        sections = "\n".join(written(self.sections(nodes)))
        head = [f"From the MORSE script {self.script}, by `foosim morse export`.", *self.notes]
        return "\n".join([*(f"# {line}" for line in head), "", sections, ""])

    def children(self, parent: int | None) -> Iterator[tuple[Tree, str]]:
        """Yield what is directly on a thing, with MORSE's names: of equal ones the others get `_001` and so on."""
        count: Counter[str] = Counter()
        for thing in self.on.get(parent, []):
            name = thing["basename"] or thing["morse"]
            yield thing, f"{name}_{count[name]:03}" if count[name] else name
            count[name] += 1

    def below(self, parent: int, place: Vector, turned: Quaternion, above: str = "") -> Iterator[Part]:
        """Yield all components on a thing with their names and their places on the robot."""
        for thing, name in self.children(parent):
            x, y, z = (a + b for a, b in zip(place, rotate(turned, thing["location"]), strict=True))
            orientation = multiply(turned, from_rpy(*thing["rotation_euler"]))
            yield thing, above + name, pose((x, y, z), reversed(euler(orientation)))
            yield from self.below(thing["number"], (x, y, z), orientation, f"{above}{name}.")

    # --- what a script makes -----------------------------------------------------------------------------------------

    def robot(self, thing: Tree, name: str) -> None:
        """Add a robot with its components; its model is the first of its family that takes all its actuators."""
        its, morse = self.classes["robots"][thing["morse"]], thing["morse"]
        models, origin, ours = self.classes["families"][its["family"]], its["origin"], name_of(name, self.robots)
        (x, y, z), (roll, pitch, yaw) = thing["location"], thing["rotation_euler"]
        if roll or pitch or thing["scale"] != [1.0] * 3:
            self.notes.append(f"{thing['place']}: {name} stands upright and has the size of its class.")
        at = pose((x, y, 0.0 if its["family"] == "ground" else z - origin), (0.0, 0.0, yaw))
        robot: Tree = {"#": f"{thing['place']}, {morse}", "model": "", **at, "tags": [], "sensors": {}, "actuators": {}}
        self.names[name], self.robots[ours] = ours, robot
        self.tagged(thing, name, ours, robot)
        parts = [*self.below(thing["number"], (0.0, 0.0, origin), (0.0, 0.0, 0.0, 1.0))]
        parts.sort(key=lambda part: part[0]["morse"] == KEYBOARD)  # it drives by another actuator, if there is one
        entries = [self.component(part, label, at, ours, robot) for part, label, at in parts]
        for call in thing["calls"]:
            self.call(thing, ours, *call)
        fits = [model for model in models if all(model in entry.get("models", models) for entry in entries)]
        if not fits:
            wanted = ", ".join(part["morse"] for part, _, _ in parts if part["category"] == "actuators")
            self.say(thing["place"], f"no model of {morse} takes all of {wanted}")
        for model in fits[:1]:
            size = {} if model == "quadrotor" else its["size"]
            robot |= {**models[model], **size, **its.get("models", {}).get(model, {}), **robot, "model": model}

    def tagged(self, thing: Tree, name: str, ours: str, made: Tree) -> None:
        """Add the label and the tags of MORSE's properties."""
        label = thing["given"].get("Label", (name,))[0]
        made |= {"label": label} if label != ours else {}
        for key, (value, place) in thing["given"].items():
            if key == "Type" or value is True:
                made["tags"] = [*made["tags"], name_of(value if key == "Type" else key)]
            elif key != "Label" and value is not False:
                self.notes.append(f"{place}: the property {key} of {name} has no effect here.")
        if label != name and ours in self.robots:
            self.about["names"][ours] = name

    def object(self, thing: Tree, name: str) -> None:
        """Add an object of the world. Zones charge batteries."""
        x, y, z = thing["scale"]
        entry = self.table["classes"]["objects"][thing["morse"]]
        ours = name_of(name, {*self.robots, *self.world.get("objects", {})})
        made = {"#": f"{thing['place']}, {thing['morse']}", **entry["fixed"], "tags": []}
        made |= formatted(entry["settings"], {"x": x, "y2": 2 * y, "x2": 2 * x, "z2": 2 * z})
        made |= pose(thing["location"], thing["rotation_euler"])
        self.tagged(thing, name, ours, made)
        for call in thing["calls"]:
            self.call(thing, "", *call)
        self.world["objects"] = {**self.world.get("objects", {}), ours: made}

    def zone(self, thing: Tree, name: str) -> None:
        """Add a place that charges batteries: the circle around a zone's box."""
        kind = first_of(thing["args"], thing["kwargs"])
        if kind != "Charging":
            self.absent(thing["place"], "the type of zone", kind, ["Charging"])
        x, y, _ = (f"{one:g} m" for one in thing["location"])
        self.chargers.append({"x": x, "y": y, "radius": f"{hypot(*thing['size'][:2]):g} m"})

    def component(self, part: Tree, label: str, at: Tree, robot: str, made: Tree) -> Tree:
        """Add a sensor or an actuator to a robot; return its entry in the table, empty for what is neither."""
        category, morse = part["category"], part["morse"]
        if category not in ("sensors", "actuators"):
            if category in ("robots", "zones", "environment"):
                self.say(part["place"], f"{morse} on a robot is not supported")
            for call in part["calls"]:
                self.call(part, robot, *call)
            return {}
        channel = name_of(label, {*made["sensors"], *made["actuators"], CHANNEL_ECHO})
        entry: Tree = self.table["classes"][category][morse]
        its: Tree = {"#": f"{part['place']}, {morse}", "kind": "", **({"label": label} if label != channel else {})}
        values = {"frequency": entry.get("rate", BASE_HZ), **entry.get("defaults", {})}
        values |= {key: value for key, (value, _) in part["given"].items()}
        for method, place, args, kwargs in part["calls"]:
            if method in ("frequency", "level"):
                values[method] = first_of(args, kwargs)
            elif method == "alter":
                self.altered(morse, entry, place, first_of(args, kwargs), kwargs, its, f"{robot}.{channel}")
            else:
                self.call(part, f"{robot}.{channel}", method, place, args, kwargs)
        entry = self.levelled(part, entry, values)
        if values.get("resolution"):
            values["rays"] = round(values["scan_window"] / values["resolution"]) + 1
        self.fastest_hz = max(self.fastest_hz, values["frequency"])
        its |= {"kind": entry["kind"], **({"rate": values["frequency"]} if category == "sensors" else {})}
        its |= formatted(entry.get("settings", {}), values)
        its |= at if "at" in registry.find(category[:-1], entry["kind"]).settings.model_fields else {}
        its |= {"tag": name_of(its["tag"])} if "tag" in its else {}
        row = entry.get("row", morse)
        if row in [one.morse for one in ROWS if one.kind == entry["kind"] and one.only.items() <= its.items()][1:]:
            self.about["classes"][f"{robot}.{channel}"] = row
        made |= formatted(entry.get("robot", {}), values)
        for section, its_own in formatted(entry.get("world", {}), values).items():
            self.world[section] = {**self.world.get(section, {}), **its_own}
        made["rules"] = {**made.get("rules", {}), **formatted(entry.get("rules", {}), values)}
        if "battery" in entry.get("rules", {}):
            power = f"{2 * values['DischargingRate']:g} kW"  # it charges as fast as it discharges
            made["rules"]["battery"]["chargers"] = [{**place, "power": power} for place in self.chargers]
        if morse != KEYBOARD or all(one["kind"] != entry["kind"] for one in made["actuators"].values()):
            made[category][channel] = its
        self.has_keyboard |= morse == KEYBOARD
        return entry

    def levelled(self, part: Tree, entry: Tree, values: Tree) -> Tree:
        """Return the entry of a component at its level. Properties that it does not have are noted."""
        level, levels = values.get("level", values.get(LEVEL)), entry.get("levels", {})
        if level is not None and level not in levels:
            self.absent(part["place"], f"the level of {part['morse']}", level, levels)
        entry = {**entry, **levels.get(level, {})}
        for key, (_, place) in part["given"].items():
            if f"{{{key}}}" not in json.dumps(entry) and key not in (LEVEL, *entry.get("defaults", {})):
                self.notes.append(f"{place}: the property {key} of {part['morse']} has no effect here.")
        return entry

    def altered(self, morse: str, entry: Tree, place: str, name: str, about: Tree, its: Tree, full: str) -> None:
        """Add a modifier of MORSE: noise to a component, a frame of reference to its gateways."""
        frames, noise = self.table["frames"], entry.get("noise", {})
        if name in frames:
            offsets = {f"UTM{key[0].upper()}Offset": one for key, one in about.items()}
            numbers = "".join(f" {float({**self.given, **offsets}.get(f'UTM{axis}Offset', 0))!r}" for axis in "XYZ")
            self.about["alter"].setdefault(full, []).append(f"UTM{numbers}" if name == "UTM" else name)
        elif name in noise:
            std = formatted(noise[name], self.table["noise"] | about)
            its.setdefault("modifiers", []).append({"kind": "gaussian_noise", "std": std})
        else:
            self.absent(place, f"the modifier of {morse}", name, [*frames, *noise])

    def call(self, thing: Tree, full: str, method: str, place: str, args: list[Any], kwargs: Tree) -> None:
        """Judge a call of any thing, `ROBOT.CHANNEL` or other: of a middleware, without an effect, or unknown."""
        if method in MIDDLEWARE:
            middleware, kinds = first_of(args, kwargs, ""), self.table["middlewares"]
            if middleware not in kinds:
                self.absent(place, "the middleware", middleware, kinds)
            elif full:
                self.served.setdefault(kinds[middleware], {})[full.partition(".")[0]] = None
            if middleware == "yarp" and "port" in kwargs:
                self.about["ports"][full] = kwargs["port"]
            elif args[1:] or (args and kwargs):
                self.notes.append(f"{place}: further parameters of {method} have no effect here.")
        elif method in self.table["ignored"].split():
            self.notes.append(f"{place}: {thing['morse']}.{method} has no effect here.")
        elif method not in self.table["needless"].split():
            self.say(place, f"{thing['morse']}.{method} is not supported")

    def environment(self, thing: Tree, name: str) -> None:
        """Add scene, time and place of the world."""
        scene = first_of(thing["args"], thing["kwargs"], "empty")
        if scene not in self.scenes:
            self.absent(thing["place"], "the scene", scene, self.scenes)
        self.world |= self.scenes.get(scene, {})
        given = {"altitude": 0, "angle_against_north": 90, **{key: one for key, (one, _) in thing["given"].items()}}
        self.given = given
        if {"longitude", "latitude"} <= given.keys():
            heading = f"{180 - given['angle_against_north']:g} deg"
            self.world["origin"] = formatted(self.table["origin"], given) | {"heading": heading}
        for method, place, args, kwargs in thing["calls"]:
            first = first_of(args, kwargs)
            if method == "set_time_strategy":
                self.is_fixed = first == "FixedSimulationStep"
            elif method == "set_time_scale":
                faster = kwargs.get("accelerate_by", args[1] if args[1:] else None)
                self.pace = f"{faster or 1 / first:g}x"
            elif method == "simulator_frequency":
                self.base_hz = float(first or BASE_HZ)
            elif method == "configure_multinode":
                self.distribution = kwargs.get("distribution", args[3] if args[3:] else {})
                if kwargs.get("protocol", first) == "hla":
                    self.say(place, "HLA is not supported; nodes exchange frames by foosim's own protocol")
            elif method == "configure_stream_manager" and kwargs.get("time_sync"):
                self.sync = {"port": kwargs.get("sync_port", 6000)}
            elif method in self.table["environment"]:
                self.world |= formatted(self.table["environment"][method], {"value": first})
            else:
                self.call(thing, "", method, place, args, kwargs)

    # --- sections ----------------------------------------------------------------------------------------------------

    def sections(self, nodes: int | None) -> Tree:
        """Return all sections."""
        base_hz = self.base_hz or (BASE_HZ if self.is_fixed else self.fastest_hz)
        substeps = self.world.setdefault("substeps", SUBSTEPS)
        tick_ns = int(NS_PER_S / Fraction(str(base_hz)) / substeps) * substeps
        if tick_ns * base_hz != NS_PER_S:
            self.notes.append(f"A tick is a step of MORSE, 1/{base_hz:g} s, rounded down to nanoseconds.")
        sensors = [(name, one) for name, robot in self.robots.items() for one in robot["sensors"].values()]
        for name, sensor in sensors:
            if sensor["rate"] > base_hz:
                self.notes.append(f"{sensor['#']} of {name}: at most {base_hz:g} Hz, the rate of the steps.")
            sensor["rate"] = format_rate(Fraction(str(min(sensor["rate"], base_hz))))
        for robot in self.robots.values():
            robot["tags"] += [ROBOT_TAG] if any(one.get("tag") == ROBOT_TAG for _, one in sensors) else []
            for key in [key for key in ("tags", "rules") if not robot.get(key)]:
                robot.pop(key, None)
        is_rigid = "objects" in self.world or any(robot["model"] == "quadrotor" for robot in self.robots.values())
        every = max(1, round(base_hz / POSES_HZ))
        return {
            "format": 2,
            "world": name_of(self.script.rpartition(".")[0] or self.script),
            "seed": 1,
            "tick": format_ns(tick_ns),
            "pace": "fast" if self.is_fixed else self.pace,
            **({} if is_rigid else {"engine": "pure"}),
            **{key: one for key, one in self.world.items() if key != "templates"},
            **self.fleets(),
            "nodes": self.nodes(nodes),
            **({"clients": {"console": {"console": True}}} if self.has_keyboard else {}),
            "gateways": self.gateways(format_rate(Fraction(NS_PER_S, tick_ns))),
            "capture": {"poses": format_rate(Fraction(NS_PER_S, tick_ns * every))},
        }

    def fleets(self) -> Tree:
        """Return the robots: what several have in common is a template."""
        alike: dict[str, list[str]] = {}
        for name, robot in self.robots.items():
            alike.setdefault(json.dumps({key: one for key, one in robot.items() if key not in OWN}), []).append(name)
        templates: Tree = {**self.world.get("templates", {})}
        robots = dict(self.robots)
        for text, names in [(text, names) for text, names in alike.items() if names[1:]]:
            template = name_of(robots[names[0]]["#"].split()[-1], templates)
            templates[template] = json.loads(text)
            for name in names:
                robots[name] = {"like": template, **{key: robots[name][key] for key in OWN if key in robots[name]}}
        return {**({"templates": templates} if templates else {}), "robots": robots}

    def nodes(self, count: int | None) -> Tree:
        """Return the nodes with their robots."""
        names = [*self.robots]
        found: Tree = {}
        for node, robots in ({} if count else self.distribution).items():
            for robot in [robot for robot in robots if robot not in self.names]:
                self.absent(self.script, f"a robot of node {node}", robot, self.names)
            found[name_of(node, found)] = {"robots": [self.names[robot] for robot in robots if robot in self.names]}
        if not found:
            ends = [len(names) * part // (count or 1) for part in range((count or 1) + 1)]
            return {f"n{node}": {"robots": names[a:b]} for node, (a, b) in enumerate(pairwise(ends), 1)}
        given = {robot for node in found.values() for robot in node["robots"]}
        next(iter(found.values()))["robots"] += [name for name in names if name not in given]
        return found

    def gateways(self, rate: str) -> Tree:
        """Return the gateways; without any middleware MORSE has its socket."""
        found: Tree = {}
        for kind, robots in (self.served or {"socket": {}}).items():
            found[kind] = {"kind": kind} | ({"robots": [*robots]} if self.served.keys() - {kind} else {})
            for section, about in self.about.items():
                its = {
                    key: one for key, one in about.items() if "robots" not in found[kind] or key.split(".")[0] in robots
                }
                found[kind] |= {section: its} if its and (section != "ports" or kind == "yarp") else {}
        if self.sync:
            found.setdefault("socket", {"kind": "socket"})["sync"] = {**self.sync, "rate": rate}
        return found
