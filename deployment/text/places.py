"""Where the problems of an expanded deployment are in its text, and which of them are one.

Findings name locations in the expanded data. The place is that of what was written there: a template's line for what an
entry has from it. What is wrong with a template would be found again with each entry that is like it, and with each
member of a fleet; it is reported once, at its place.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any, Final

from foosim.common.errors import describe
from foosim.common.finding import Finding, Location, with_written
from foosim.deployment.text.expand import ENTRIES
from foosim.deployment.text.made import AXES, SPACING
from foosim.deployment.text.templates import TEMPLATES
from foosim.deployment.text.yaml import SETS_RANK, Fields, Items, Place, Problem, Tree, plain

FINDINGS_MAX: Final = 2_000
"""Findings that are read, with repeated ones: each may have thousands of names to compare."""
_AS_WRITTEN: Final = (TEMPLATES, "nodes")
"""Sections whose locations are those in the text: an index of a node's list has no meaning when it is expanded."""

Key = tuple[Place, str]


class Places:
    """The places of one deployment's findings.

    `written` is the tree as it is in the text, `expanded` what the findings are about.
    """

    def __init__(self, written: Tree, expanded: Tree, templates: Mapping[str, tuple[Fields, Place]]) -> None:
        self._written = written
        self._expanded = expanded
        if templates and isinstance(expanded, Fields):
            entries = Fields(expanded.place, {name: whole for name, (whole, _) in templates.items()})
            entries.keys = {name: place for name, (_, place) in templates.items()}
            values, keys = {**expanded.values, TEMPLATES: entries}, {**expanded.keys, TEMPLATES: expanded.place}
            self._expanded = Fields(expanded.place, values, keys)

    def problem(self, finding: Finding, *, is_made: bool = False) -> Problem:
        """Return the problem of a finding. `is_made`: it is of an entry as made, for any maker."""
        finding = with_written(finding, self._data)
        place, is_key, depth = self._find(finding)
        if finding.other is not None:
            there = self._find(finding.other)
            if place.rank < there[0].rank and there[0].rank > SETS_RANK:  # it was set after the file
                finding, (place, is_key, depth) = finding.other, there
        written = self._locations.get((place, is_key), ())
        if is_key and written[2:-1] == (SPACING,):
            axes = ", ".join(axis for axis in AXES if axis in finding.valid) or "none"
            finding = replace(finding, location=written, what=f"unknown key (there are: {axes})", nearest=None)
        location = finding.location
        if written[:1] and written[0] in _AS_WRITTEN and not (is_made and written[0] == TEMPLATES):
            location = (*written, *location[depth:])
        return Problem(place, replace(finding, location=location).text)

    def distinct(self, findings: Iterable[Finding], broken: Collection[Location]) -> Iterator[Finding]:
        """Yield the findings without repeated ones and those of broken entries; lazily, from at most `FINDINGS_MAX`."""
        met: set[Key] = set()
        for number, finding in enumerate(findings):
            if number == FINDINGS_MAX:
                return
            key = self._find(finding)[0], _nameless(with_written(finding, self._data))
            if key not in met and finding.location[:2] not in broken:
                met.add(key)
                yield finding

    def _find(self, finding: Finding) -> tuple[Place, bool, int]:
        """Return the place of the value, the key, or the mapping without the key; the nearest enclosing one of none.

        Also whether it is a key's, and how many steps of the location lead there.
        """
        node, place, depth = self._expanded, self._expanded.place, 0
        is_key = False
        for step in finding.location:
            if isinstance(node, Fields) and isinstance(step, str) and step in node.values:
                place, node, is_key = node.keys[step], node.values[step], True
            elif isinstance(node, Items) and isinstance(step, int) and step < len(node.items):
                node = node.items[step]
                place, is_key = node.place, False
            else:
                return node.place, False, depth
            depth += 1
        return (place, is_key, depth) if finding.at == "key" else (node.place, False, depth)

    @cached_property
    def _data(self) -> Any:
        return plain(self._expanded)

    @cached_property
    def _locations(self) -> dict[tuple[Place, bool], Location]:
        """What is written at a place, by whether it is a key's."""
        return {(place, is_key): location for place, is_key, location in _walk(self._written, ())}


def _walk(node: Tree, location: Location) -> Iterator[tuple[Place, bool, Location]]:
    """Yield the place of each value and key of a tree, whether it is a key's, and the location."""
    yield node.place, False, location
    if isinstance(node, Fields):
        for key, value in node.values.items():
            yield node.keys[key], True, (*location, key)
            yield from _walk(value, (*location, key))
    elif isinstance(node, Items):
        for index, item in enumerate(node.items):
            yield from _walk(item, (*location, index))


def _nameless(finding: Finding) -> str:
    """Return the text of a finding without the name of its entry and the name that this is for."""
    if finding.location[:1] == ("nodes",):
        return finding.what  # of each robot that a selector matches
    text = describe(finding.what, finding.value)
    if finding.location[:1] and finding.location[0] in ENTRIES:
        for name in (*finding.location[1:2], *finding.location[3:4]):
            text = text.replace(str(name), "*") if isinstance(name, str) else text
    return text
