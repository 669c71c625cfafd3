"""Expands a deployment's tree: abbreviations of the text are written out, before the schema and the checks.

Abbreviations are templates (`like`), fleets (`count`), entries for each robot (`each`), presets of kits (`preset`), and
selectors in the place of robots' names: in the lists of nodes, where `rest` is whatever no other entry names, and as
keys of a player's robots.
The expanded tree has the places of what was written. It shares the nodes that several entries have in common, so that
it is never changed. Everything else in the tree is passed on as it is, wrong or not.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Final, TypeGuard

from foosim.common import limits
from foosim.common.errors import BadValue
from foosim.common.finding import Location
from foosim.common.names import nearest_quoted
from foosim.deployment.text.includes import INCLUDE
from foosim.deployment.text.made import COUNT, EACH, SPACING, SPARE, BadSign, Change, counted, filled_entry, put
from foosim.deployment.text.report import Report, Stopped
from foosim.deployment.text.selection import Chosen, Population, TooManyComparisons, is_several
from foosim.deployment.text.templates import LIKE, TEMPLATES, Templates, merged, with_preset, without
from foosim.deployment.text.yaml import DEPTH_MAX, Fields, Items, Leaf, Place, Problem, Tree, measure, plain
from foosim.world.component_types.settings import client_on
from foosim.world.scenery import SCENERY_MAX

REST: Final = "rest"
ROBOTS: Final = "robots"
FLEETS: Final[dict[str, int]] = {
    ROBOTS: limits.ENTITIES_MAX,
    "objects": limits.ENTITIES_MAX,
    "scenery": SCENERY_MAX,
}
"""Sections whose entries may have a count, and how many entries there are at most."""
FOR_ROBOTS: Final[dict[str, int]] = {"players": limits.CLIENTS_MAX, "clients": limits.CLIENTS_MAX}
"""The same of those whose entries may be for each robot."""
GATEWAYS: Final = "gateways"
CLIENTS: Final = "clients"
SYNC: Final = "sync"
"""The key of a gateway that makes its own client one in lockstep, with its rate."""
ENTRIES: Final = (*FLEETS, *FOR_ROBOTS)
"""Sections whose entries may be like templates."""


@dataclass(frozen=True, slots=True)
class Expanded:
    """An expanded tree, None where a problem leaves none, and the problems.

    Further errors in `broken` entries (section and name) follow from a problem. `unused` templates are whole, with the
    places of their names.
    """

    tree: Tree | None
    problems: list[Problem] = field(default_factory=list)
    broken: frozenset[tuple[str, str]] = frozenset()
    unused: Mapping[str, tuple[Fields, Place]] = field(default_factory=dict)


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
        example = filled_entry(template, signs, "node")
        return example if isinstance(example, Fields) else template
    return template


class Expansion:
    """The expansion of one tree, part by part: each is computed at its first use. Methods raise Stopped."""

    def __init__(self, tree: Fields, report: Report) -> None:
        self._tree = tree
        self._report = report
        self._made: dict[str, dict[str, dict[str, Change]]] = {}
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
        keys = dict(self._tree.keys)
        if isinstance(gateways := values.get(GATEWAYS), Fields):
            values[GATEWAYS], values[CLIENTS] = self._with_clients(gateways, values.get(CLIENTS))
            keys.setdefault(CLIENTS, keys[GATEWAYS])
        whole = without(Fields(self._tree.place, values, keys), TEMPLATES, INCLUDE)
        depth, nodes = measure(whole, {})
        if depth > DEPTH_MAX:
            report.add(whole.place, (), f"nested more than {DEPTH_MAX} deep when expanded", depth)
        if nodes > limits.EXPANDED_NODES_MAX:
            report.add(whole.place, (), f"more than {limits.EXPANDED_NODES_MAX} values and keys when expanded", nodes)
        return whole

    def section(self, name: str) -> Tree | None:
        """Return one section, expanded, without invalid templates; None for an absent section."""
        section = self._tree.values.get(name)
        if not isinstance(section, Fields):
            return section
        if name == TEMPLATES:
            wholes = {one: self.templates.whole(one) for one in self.templates.names}
            return Fields(section.place, {one: node for one, node in wholes.items() if node is not None})
        if name == ROBOTS:
            return self._robots
        if name in ENTRIES:
            return self._entries(name, section)
        return self._nodes if name == "nodes" else with_preset(name, section, self._report)

    # --- entries ------------------------------------------------------------------------------------------------------

    @cached_property
    def _robots(self) -> Tree | None:
        section = self._tree.values.get(ROBOTS)
        return self._entries(ROBOTS, section) if isinstance(section, Fields) else section

    @cached_property
    def _population(self) -> Population:
        """The robots' names."""
        return Population(self._robots.values if isinstance(self._robots, Fields) else ())

    def _entries(self, name: str, section: Fields) -> Fields:
        """Return a section with all of its entries, each made one in the place of its maker."""
        if name not in self._made:
            self._made[name] = self._makes(name, section)
        made, whole = self._made[name], Fields(section.place)
        others = {one for changes in made.values() for one in changes}
        for key, entry in section.values.items():
            if key in made and isinstance(entry, Fields):
                spare = entry.values.get(SPARE)
                has_spares = spare is not None and not isinstance(plain(spare), bool)
                raw, path = without(entry, EACH, COUNT, SPACING, *([SPARE] if has_spares else [])), (name, key)
                usual = self.templates.applied(raw, path)
                for one, change in made[key].items():
                    place = section.keys.get(one, section.keys[key])
                    node = self._changed(usual, raw, path, one, change, section.values.get(one))
                    self._report.count(node, place, path)
                    whole.values[one], whole.keys[one] = self._with_robots(node, (name, one)), place
            elif key not in others:
                node = self.templates.applied(entry, (name, key))
                if node is not entry:
                    self._report.count(node, section.keys[key], (name, key))
                whole.values[key], whole.keys[key] = self._with_robots(node, (name, key)), section.keys[key]
        return whole

    def _changed(
        self, usual: Tree, raw: Fields, path: tuple[str, str], one: str, change: Change, own: Tree | None
    ) -> Tree:
        """Return one of the entries that an entry makes, with its own keys."""
        if isinstance(own, Fields) and LIKE in own.values:
            like = Fields(own.place, {LIKE: own.values[LIKE]}, {LIKE: own.keys[LIKE]})
            usual, own = self.templates.applied(merged(raw, like), (path[0], one)), without(own, LIKE)
        elif path in self._report.broken:
            self._report.broken.add((path[0], one))
        try:
            node = change(usual)
            if own is None:
                return node
            return merged(node, change(own) if path[0] in FOR_ROBOTS else own)
        except BadSign as sign:
            self._report.add_value(sign.place, path, sign.bad)
            self._report.stop()

    def _makes(self, name: str, section: Fields) -> dict[str, dict[str, Change]]:
        """Return what entries of a section make, by their keys and the names of these. It is not known what there is
        where that is wrong, so then it is the end."""
        report, most, problems = self._report, (FLEETS | FOR_ROBOTS)[name], len(self._report.problems)
        found: dict[str, dict[str, Change]] = {}
        maker: dict[str, str] = {}
        for key, entry in section.values.items():
            if not isinstance(entry, Fields):
                continue
            path = name, key
            if name in FLEETS:
                changes = counted(entry, path, most, report)
            elif EACH in entry.values:
                changes = self._for_each(entry, path, section.keys[key], maker)
            else:
                continue
            if changes or name in FOR_ROBOTS:
                found[key] = changes
            maker |= dict.fromkeys(changes, key)
            longest = max(changes, key=len, default="")
            if len(longest) > limits.NAME_LENGTH_MAX:
                what = f"it makes a name of {len(longest)} characters, more than {limits.NAME_LENGTH_MAX}"
                report.add(section.keys[key], path, what, longest)
        for key in found.keys() & maker.keys():
            by, place, _ = _maker(section, key)
            report.add(place, (name, key), f"a {by} of what the entry {maker[key]} makes", by)
        total = len(section.values.keys() - found.keys() - maker.keys()) + len(maker)
        if total > most and maker:
            key, changes = max(found.items(), key=lambda item: len(item[1]))
            by, _, place = _maker(section, key)
            report.add(place, (name, key, by), f"with it there are {total} {name}, more than {most}", len(changes))
        if len(report.problems) > problems:
            report.stop()
        return found

    def _for_each(
        self, entry: Fields, path: tuple[str, str], place: Place, known: Mapping[str, str]
    ) -> dict[str, Change]:
        """Return what an entry makes for robots; names in `known` are made already."""
        node, key, found = entry.values[EACH], path[1], dict[str, Change]()
        text = plain(node)
        if not isinstance(text, str):
            self._report.add(node.place, (*path, EACH), "not a selector", text)
        elif self._population.names and "$" not in key:
            what = "the name of what is made for each robot has $robot or $1 in it"
            self._report.add(place, path, what, key, repr(f"{key}-{'$1' if is_several(text) else '$robot'}"))
        elif self._population.names:
            for robot, parts in self._chosen(text, node.place, (*path, EACH)):
                values = {"$": "$", "robot": robot} | {str(number): part for number, part in enumerate(parts, 1)}
                try:
                    one = put(key, place, values)
                except BadSign as sign:
                    self._report.add_value(place, path, sign.bad)
                    break
                if one in found or one in known:
                    what = f"a name that is made twice, also by {known.get(one, key)}"
                    self._report.add(place, path, what, one)
                    break
                found[one] = partial(filled_entry, values=values, node=self._owners.get(robot))
        return found

    def _with_clients(self, gateways: Fields, clients: Tree | None) -> tuple[Fields, Tree]:
        """Return the gateways with the names of their robots, and the clients with theirs."""
        declared = clients if isinstance(clients, Fields) else Fields(gateways.place)
        whole = Fields(gateways.place, dict(gateways.values), gateways.keys)
        found = Fields(declared.place, dict(declared.values), dict(declared.keys))
        for name, entry in gateways.values.items():
            if not isinstance(entry, Fields):
                continue
            place, path = gateways.keys[name], (GATEWAYS, name, ROBOTS)
            given = entry.values.get(ROBOTS, Items(place, [Leaf(place, "*")]))
            if not isinstance(given, Items):
                continue
            robots = self._listed(given, path)
            whole.values[name] = Fields(entry.place, {**entry.values, ROBOTS: robots}, {ROBOTS: place, **entry.keys})
            sync = entry.values.get(SYNC)
            own = {"lockstep": Leaf(place, True), "rate": sync.values["rate"]} if _has_rate(sync) else {}
            made = {name: (own, place)}
            for robot in robots.items:
                if isinstance(robot, Leaf) and isinstance(robot.value, str):
                    made[client_on(name, robot.value)] = {"on": robot}, robot.place
            for one, (values, at) in made.items():
                if one in found.values:
                    self._report.add(at, path[:2], "it makes a client with the name of one that is declared", one)
                found.values[one], found.keys[one] = Fields(at, dict(values), dict.fromkeys(values, at)), at
        return whole, found if isinstance(clients, Fields | None) else clients

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
        """Put the robots of no list in place of `rest`, the first of them."""
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


def _has_rate(sync: Tree | None) -> TypeGuard[Fields]:
    return isinstance(sync, Fields) and "rate" in sync.values


def _maker(section: Fields, key: str) -> tuple[str, Place, Place]:
    """Return the key by which an entry makes others, its place and that of its value."""
    entry = section.values[key]
    assert isinstance(entry, Fields), "it makes others"
    by = next(one for one in (COUNT, EACH, SPARE) if one in entry.values)
    return by, entry.keys[by], entry.values[by].place
