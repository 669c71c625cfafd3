"""Expands a deployment's tree: what is abbreviated in the text is written out, before the schema and the checks see it.

Abbreviations are templates (`like`), fleets (`count`), entries for each robot (`each`), presets of kits (`preset`), and
selectors in the place of robots' names: in the lists of nodes, where `rest` is whatever no other entry names, and as
keys of a player's robots.
The expanded tree has the places of what was written. It shares the nodes that several entries have in common, so that
nobody changes it. Everything else in the tree is passed on as it is, wrong or not.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

from foosim.common import limits
from foosim.common.errors import BadValue
from foosim.common.finding import Location
from foosim.common.names import nearest_quoted
from foosim.deployment.text.each import EACH, BadSign, Each, Filling, put
from foosim.deployment.text.fleets import Fleet, fleet_and_number, members, read_fleets
from foosim.deployment.text.includes import INCLUDE
from foosim.deployment.text.report import Report, Stopped
from foosim.deployment.text.selection import Chosen, Population, TooManyComparisons, is_several
from foosim.deployment.text.templates import LIKE, TEMPLATES, Templates, merged, with_preset, without
from foosim.deployment.text.yaml import DEPTH_MAX, Fields, Items, Leaf, Place, Problem, Tree, measure, plain
from foosim.world.scenery import SCENERY_MAX

REST: Final = "rest"
ROBOTS: Final = "robots"
FLEETS: Final[Mapping[str, int]] = {
    ROBOTS: limits.ENTITIES_MAX,
    "objects": limits.ENTITIES_MAX,
    "scenery": SCENERY_MAX,
}
"""Sections whose entries may have a count, and how many entries there are at most."""
FOR_ROBOTS: Final[Mapping[str, int]] = {"players": limits.CLIENTS_MAX, "clients": limits.CLIENTS_MAX}
"""The same of those whose entries may be for each robot."""
ENTRIES: Final = (*FLEETS, *FOR_ROBOTS)
"""Sections whose entries may be like templates."""


@dataclass(frozen=True, slots=True)
class Expanded:
    """An expanded tree, None where a problem leaves none, and the problems.

    What else is wrong with `broken` entries (section and name) follows from a problem. `unused` templates are of
    nobody's, whole, with the places of their names.
    """

    tree: Tree | None
    problems: list[Problem] = field(default_factory=list)
    broken: frozenset[tuple[str, str]] = frozenset()
    unused: Mapping[str, tuple[Fields, Place]] = field(default_factory=dict)


_Made = tuple[Each, dict[str, str]]
"""What is made for a robot: from which entry, with which values for its signs."""


def expand(tree: Tree) -> Expanded:
    """Return the tree of a whole deployment with nothing abbreviated. It is not changed."""
    if not isinstance(tree, Fields):
        return Expanded(tree)
    report = Report()
    try:
        expansion = Expansion(tree, report)
        whole = expansion.whole()
        unused = {name: (_example(template), place) for name, (template, place) in expansion.templates.unused().items()}
    except Stopped:
        return Expanded(None, list(report.problems))
    return Expanded(whole, list(report.problems), frozenset(report.broken), unused)


def _example(template: Fields) -> Fields:
    """Return a template as it could be for a robot; itself where its signs are wrong."""
    with suppress(BadSign):
        signs = {"$": "$", "robot": "robot"} | dict.fromkeys("123456789", "1")
        example = Filling().entry(template, signs, "node")
        return example if isinstance(example, Fields) else template
    return template


class Expansion:
    """The expansion of one tree, part by part: each is computed when it is asked for. Methods raise Stopped."""

    def __init__(self, tree: Fields, report: Report) -> None:
        self._tree = tree
        self._report = report
        self._filling = Filling()
        self._fleets: dict[str, dict[str, Fleet]] = {}
        self._for_robots: dict[str, dict[str, _Made]] = {}
        self._usual: dict[tuple[str, str], Tree] = {}
        self._named_robots: dict[int, tuple[Fields, Fields]] = {}
        self._unmatched: set[Place] = set()
        self.templates = Templates(tree, report)

    def whole(self) -> Fields:
        """Return the whole tree, expanded."""
        report, values = self._report, dict(self._tree.values)
        if INCLUDE in values:
            what = "a text that came without its files, which has to stand alone"
            report.add(values[INCLUDE].place, (INCLUDE,), what, plain(values[INCLUDE]))
        values |= {name: node for name in values if name != TEMPLATES and (node := self.section(name))}
        whole = without(Fields(self._tree.place, values, self._tree.keys), TEMPLATES, INCLUDE)
        depth, nodes = measure(whole, {})
        if depth > DEPTH_MAX:
            report.add(whole.place, (), f"nested more than {DEPTH_MAX} deep when expanded", depth)
        if nodes > limits.EXPANDED_NODES_MAX:
            report.add(whole.place, (), f"more than {limits.EXPANDED_NODES_MAX} values and keys when expanded", nodes)
        return whole

    def section(self, name: str) -> Tree | None:
        """Return one section, expanded; of templates those that are not wrong. None where there is none."""
        section = self._tree.values.get(name)
        if not isinstance(section, Fields):
            return section
        if name == TEMPLATES:
            wholes = {one: self.templates.whole(one) for one in self.templates.names}
            return Fields(section.place, {one: node for one, node in wholes.items() if node is not None})
        if name == ROBOTS:
            return self._robots
        if name in FLEETS:
            return self._section_of_fleets(name, section)
        if name in FOR_ROBOTS:
            return self._section_for_robots(name, section)
        return self._nodes if name == "nodes" else with_preset(name, section, self._report)

    # --- fleets -------------------------------------------------------------------------------------------------------

    @cached_property
    def _robots(self) -> Tree | None:
        section = self._tree.values.get(ROBOTS)
        return self._section_of_fleets(ROBOTS, section) if isinstance(section, Fields) else section

    @cached_property
    def _population(self) -> Population:
        """The robots' names."""
        return Population(self._robots.values if isinstance(self._robots, Fields) else ())

    def _fleets_of(self, name: str, section: Fields) -> dict[str, Fleet]:
        if name not in self._fleets:
            self._fleets[name] = read_fleets(section, name, FLEETS[name], self._report)
        return self._fleets[name]

    def _section_of_fleets(self, name: str, section: Fields) -> Fields:
        fleets = self._fleets_of(name, section)
        whole = Fields(section.place)
        for key, entry in section.values.items():
            if key in fleets:
                for made, place, node in members(section, fleets[key], self.templates, self._report):
                    whole.values[made], whole.keys[made] = node, place
            elif fleet_and_number(key, fleets) is None:
                whole.values[key], whole.keys[key] = self._like(name, key, entry, section.keys[key]), section.keys[key]
        return whole

    def _like(self, name: str, key: str, entry: Tree, place: Place) -> Tree:
        """Return an entry with what it is like."""
        whole = self.templates.applied(entry, (name, key))
        if whole is not entry:
            self._report.count(whole, place, (name, key))
        return whole

    # --- the lists of nodes -------------------------------------------------------------------------------------------

    @cached_property
    def _nodes(self) -> Tree | None:
        """The nodes, with the names of all their robots."""
        section = self._tree.values.get("nodes")
        if not isinstance(section, Fields) or not self._population.names:
            return section
        whole = Fields(section.place, dict(section.values), section.keys)
        lists: dict[str, Items] = {}
        for node, spec in section.values.items():
            items = spec.values.get(ROBOTS) if isinstance(spec, Fields) else None
            if isinstance(spec, Fields) and isinstance(items, Items):
                lists[node] = self._listed(items, ("nodes", node, ROBOTS))
                whole.values[node] = Fields(spec.place, {**spec.values, ROBOTS: lists[node]}, spec.keys)
        self._put_rest(lists)
        return whole

    def _listed(self, items: Items, path: Location) -> Items:
        """Return a node's list with the names that its selectors match."""
        listed = Items(items.place)
        named: set[str] = set()
        for index, item in enumerate(items.items):
            text = item.value if isinstance(item, Leaf) else None
            if not isinstance(text, str) or not is_several(text):
                listed.items.append(item)
                named.update([text] if isinstance(text, str) else [])
                continue
            for name, _ in self._chosen(text, item.place, (*path, index)):
                if name not in named:
                    named.add(name)
                    listed.items.append(Leaf(item.place, name))
        return listed

    def _put_rest(self, lists: Mapping[str, Items]) -> None:
        """Put the robots that no list names in place of `rest`; the first one that says so has them."""
        if REST in self._population.names:
            return
        listed = {item.value for items in lists.values() for item in items.items if isinstance(item, Leaf)}
        rest = [name for name in self._population.names if name not in listed]
        for node, items in lists.items():
            for index in reversed(range(len(items.items))):
                item = items.items[index]
                if isinstance(item, Leaf) and item.value == REST:
                    if not rest:
                        self._report.add(
                            item.place, ("nodes", node, ROBOTS), "each robot is in another list, none is left", REST
                        )
                    items.items[index : index + 1] = [Leaf(item.place, name) for name in rest]
                    rest = []

    @cached_property
    def _owners(self) -> dict[str, str]:
        """The node of each robot that has one."""
        nodes = self._nodes.values if isinstance(self._nodes, Fields) else {}
        owners: dict[str, str] = {}
        for node, spec in nodes.items():
            items = spec.values.get(ROBOTS) if isinstance(spec, Fields) else None
            for item in items.items if isinstance(items, Items) else ():
                if isinstance(item, Leaf) and isinstance(item.value, str):
                    owners.setdefault(item.value, node)
        return owners

    def _chosen(self, text: str, place: Place, path: Location) -> list[Chosen]:
        """Return the robots that a selector chooses; none, reported, where it is wrong or there are none."""
        try:
            chosen = self._population.chosen(text)
        except BadValue as bad:
            self._report.add_value(place, path, bad)
            return []
        except TooManyComparisons as error:
            self._report.add(place, path, str(error))
            self._report.stop()
        if not chosen and place not in self._unmatched:  # by another entry of a template
            self._unmatched.add(place)
            nearest = nearest_quoted(text, self._population.names)
            self._report.add(place, path, "a selector that matches no robot", text, nearest)
        return chosen

    # --- entries for each robot ---------------------------------------------------------------------------------------

    def _section_for_robots(self, name: str, section: Fields) -> Fields:
        eaches = self._eaches_of(name, section)
        made: dict[str, list[str]] = {}
        for one, (each, _) in eaches.items():
            made.setdefault(each.path[1], []).append(one)
        whole = Fields(section.place)
        for key, entry in section.values.items():
            if EACH in _keys(section, key):
                for one in made.get(key, ()):
                    place = section.keys.get(one, section.keys[key])
                    node = self._filled(name, one, *eaches[one], section.values.get(one))
                    self._report.count(node, place, (name, key))
                    whole.values[one], whole.keys[one] = self._with_robots(node, (name, one)), place
            elif key not in eaches:
                node = self._like(name, key, entry, section.keys[key])
                whole.values[key], whole.keys[key] = self._with_robots(node, (name, key)), section.keys[key]
        return whole

    def _filled(self, section: str, name: str, each: Each, values: Mapping[str, str], own: Tree | None) -> Tree:
        """Return an entry for one robot, with what is written of it alone."""
        raw, path = each.raw, each.path
        if isinstance(own, Fields) and LIKE in own.values:
            like = Fields(own.place, {LIKE: own.values[LIKE]}, {LIKE: own.keys[LIKE]})
            path, own = (section, name), without(own, LIKE)
            whole = self.templates.applied(merged(raw, like), path)
        else:
            whole = self._usual.get(path) or self.templates.applied(raw, path)
            self._usual[path] = whole
        if path in self._report.broken:
            self._report.broken.add((section, name))
        try:
            node = self._owners.get(values["robot"])
            filled = self._filling.entry(whole, values, node)
            return filled if own is None else merged(filled, self._filling.entry(own, values, node))
        except BadSign as sign:
            self._report.add_value(sign.place, path, sign.bad)
            self._report.stop()

    def _eaches_of(self, name: str, section: Fields) -> dict[str, _Made]:
        """Return what a section makes for robots, by name."""
        if name not in self._for_robots:
            found: dict[str, _Made] = {}
            for key, entry in section.values.items():
                if isinstance(entry, Fields) and EACH in entry.values:
                    self._make(name, key, entry, section.keys[key], found)
            self._for_robots[name] = found
        return self._for_robots[name]

    def _make(self, name: str, key: str, entry: Fields, place: Place, found: dict[str, _Made]) -> None:
        """Add what one entry makes. It is not known who there is where that is wrong, so then it is the end."""
        problems, path, node = len(self._report.problems), (name, key), entry.values[EACH]
        text = plain(node)
        if not isinstance(text, str):
            self._report.add(node.place, (*path, EACH), "not a selector", text)
        elif self._population.names and "$" not in key:
            what = "the name of what is made for each robot has $robot or $1 in it"
            self._report.add(place, path, what, key, repr(f"{key}-{'$1' if is_several(text) else '$robot'}"))
        elif self._population.names:
            each = Each(path, without(entry, EACH))
            for robot, parts in self._chosen(text, node.place, (*path, EACH)):
                if not self._add(each, each.values(robot, parts), place, found):
                    break
        if len(self._report.problems) > problems:
            self._report.stop()

    def _add(self, each: Each, values: dict[str, str], place: Place, found: dict[str, _Made]) -> bool:
        """Add what is made for one robot; return whether its name is acceptable."""
        section, key = each.path
        try:
            name = put(key, place, values)
        except BadSign as sign:
            self._report.add_value(place, each.path, sign.bad)
            return False
        what = ""
        if name in found:
            what = f"a name that is made twice, also by {found[name][0].path[1]}"
        elif len(name) > limits.NAME_LENGTH_MAX:
            what = f"the name that it makes for {values['robot']} has more than {limits.NAME_LENGTH_MAX} characters"
        elif len(found) == FOR_ROBOTS[section]:
            what = f"with it there are more than {FOR_ROBOTS[section]} {section}"
        if what:
            self._report.add(place, each.path, what, name)
        else:
            found[name] = each, values
        return not what

    def _with_robots(self, entry: Tree, path: tuple[str, str]) -> Tree:
        """Return a player with the names of all its robots."""
        robots = entry.values.get(ROBOTS) if isinstance(entry, Fields) else None
        if not isinstance(entry, Fields) or not isinstance(robots, Fields) or not any(map(is_several, robots.values)):
            return entry
        _, named = self._named_robots.get(id(robots)) or (robots, None)
        if named is None:
            named = Fields(robots.place)
            for key, channels in robots.values.items():
                place = robots.keys[key]
                names = [key]
                if is_several(key):
                    chosen = self._chosen(key, place, (*path, ROBOTS))
                    names = [name for name, _ in chosen if name not in named.values]
                for name in names:
                    named.values[name], named.keys[name] = channels, place
            self._named_robots[id(robots)] = robots, named
        self._report.count(named, robots.place, (*path, ROBOTS))
        return Fields(entry.place, {**entry.values, ROBOTS: named}, entry.keys)


def _keys(section: Fields, key: str) -> Mapping[str, Tree]:
    entry = section.values[key]
    return entry.values if isinstance(entry, Fields) else {}
