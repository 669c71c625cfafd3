"""Fleets: an entry with `count: N` is N of them, NAME-1 to NAME-N, each by `spacing` beside the one before.

With `spare: M` there are M more, which are absent until they are added; without a count there are only these.

An entry that is written under the name of one of them holds what is different about it. Lengths are added exactly.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from foosim.common import limits, units
from foosim.common.errors import BadValue, Refused
from foosim.common.finding import Location
from foosim.deployment.text.report import Report
from foosim.deployment.text.templates import Templates, merged, without
from foosim.deployment.text.yaml import Fields, Leaf, Place, Scalar, Tree, plain
from foosim.world.forms import registry

COUNT: Final = "count"
SPARE: Final = "spare"
SPACING: Final = "spacing"
AXES: Final = ("x", "y", "z")
AT: Final = "at"
"""The pose of an entry that has one: what is spaced stands there."""

_MEMBER: Final = re.compile(r"(?P<fleet>.+)-(?P<number>[1-9][0-9]{0,8})")
_UNIT: Final = re.compile(r"[A-Za-z]+ *$")


@dataclass(frozen=True, slots=True)
class Step:
    """How much further along an axis each one stands: an exact length in metres, as it is written where."""

    exact_m: Fraction
    leaf: Leaf
    key: Place


@dataclass(frozen=True, slots=True)
class Fleet:
    """An entry that makes several, the last ones of them spares. `raw` is what it says of each, without count and
    spacing."""

    path: tuple[str, str]
    count: int
    """With the spares."""
    present: int
    raw: Fields
    spacing: Mapping[str, Step]


def fleet_and_number(name: str, fleets: Mapping[str, Fleet]) -> tuple[Fleet, int] | None:
    """Return the fleet that a name is made by, and its number in it."""
    found = _MEMBER.fullmatch(name)
    fleet = None if found is None else fleets.get(found["fleet"])
    if found is None or fleet is None or int(found["number"]) > fleet.count:
        return None
    return fleet, int(found["number"])


def read_fleets(section: Fields, name: str, entries_max: int, report: Report) -> dict[str, Fleet]:
    """Return the fleets of a section by their keys. Raises Stopped: where one is wrong it is not known who there is."""
    fleets: dict[str, Fleet] = {}
    known = len(report.problems)
    for key, entry in section.values.items():
        if not isinstance(entry, Fields):
            continue
        path = name, key
        spare = entry.values.get(SPARE)
        has_spares = spare is not None and not isinstance(plain(spare), bool)
        if COUNT in entry.values or has_spares:
            present = _count(entry.values[COUNT], (*path, COUNT), entries_max, report) if COUNT in entry.values else 0
            spares = _count(spare, (*path, SPARE), entries_max, report) if spare is not None and has_spares else 0
            count = present + spares
            spacing = _spacing(entry.values.get(SPACING), (*path, SPACING), report)
            if (longest := len(f"{key}-{count}")) > limits.NAME_LENGTH_MAX:
                what = f"its names have up to {longest} characters, more than {limits.NAME_LENGTH_MAX}"
                report.add(section.keys[key], path, what, f"{key}-{count}")
            gone = (COUNT, SPACING, SPARE) if has_spares else (COUNT, SPACING)
            fleets[key] = Fleet(path, count, present, without(entry, *gone), spacing)
        elif SPACING in entry.values:
            report.add(entry.keys[SPACING], path, "a spacing of what has no count", SPACING)
    _check_names(section, name, fleets, entries_max, report)
    if len(report.problems) > known:
        report.stop()
    return fleets


def _check_names(section: Fields, name: str, fleets: Mapping[str, Fleet], entries_max: int, report: Report) -> None:
    """Report a fleet whose own name is made by another one, and too many entries."""
    made = {key: found[0] for key in section.values if (found := fleet_and_number(key, fleets)) is not None}
    for key in made.keys() & fleets.keys():
        entry, other = section.values[key], made[key].path[1]
        assert isinstance(entry, Fields), "a fleet"
        by = COUNT if COUNT in entry.keys else SPARE
        report.add(entry.keys[by], (name, key), f"a {by} of what the count of {other} makes", by)
    total = len(section.values.keys() - fleets.keys() - made.keys()) + sum(fleet.count for fleet in fleets.values())
    if total > entries_max and fleets:
        key, fleet = max(fleets.items(), key=lambda item: item[1].count)
        entry = section.values[key]
        assert isinstance(entry, Fields), "a fleet"
        what = f"with it there are {total} {name}, more than {entries_max}"
        by = COUNT if COUNT in entry.values else SPARE
        report.add(entry.values[by].place, (*fleet.path, by), what, fleet.count)


def _count(node: Tree, path: Location, count_max: int, report: Report) -> int:
    """Return a count; 1, reported, where it is none."""
    count = plain(node)
    if type(count) is not int or not 1 <= count <= count_max:
        report.add(node.place, path, f"not a whole number from 1 to {count_max}", count)
        return 1
    return count


def _spacing(node: Tree | None, path: Location, report: Report) -> dict[str, Step]:
    """Return the steps by axis, without those, reported, that are none."""
    steps: dict[str, Step] = {}
    if not isinstance(node, Fields):
        if node is not None:
            report.add(node.place, path, "not a mapping", plain(node))
        return steps
    for axis, value in node.values.items():
        try:
            if axis not in AXES:
                report.add(node.keys[axis], path, f"not one of {', '.join(AXES)}", axis)
            else:
                exact_m = units.parse(plain(value), units.LENGTH)
                assert isinstance(value, Leaf), "a text"
                steps[axis] = Step(exact_m, value, node.keys[axis])
        except BadValue as bad:
            report.add_value(value.place, (*path, axis), bad)
    return steps


def members(section: Fields, fleet: Fleet, templates: Templates, report: Report) -> Iterator[tuple[str, Place, Tree]]:
    """Yield what a fleet makes: name, place of the key, and entry. Raises Stopped where all are too large."""
    usual = None
    for number in range(1, fleet.count + 1):
        name = f"{fleet.path[1]}-{number}"
        own = section.values.get(name)
        if own is not None:
            place, entry = section.keys[name], member(fleet, number, own, templates)
        else:
            usual = usual or templates.applied(fleet.raw, fleet.path)
            place, entry = section.keys[str(fleet.path[1])], _moved(usual, fleet.spacing, number - 1)
            if number > fleet.present and isinstance(entry, Fields):
                entry = _as_spare(entry)
            if fleet.path in report.broken:
                report.broken.add((fleet.path[0], name))
        report.count(entry, place, fleet.path)
        yield name, place, entry


def member(fleet: Fleet, number: int, own: Tree | None, templates: Templates) -> Tree:
    """Return one entry of a fleet, with what is written of it alone."""
    raw = fleet.raw if own is None else merged(fleet.raw, own)
    entry = templates.applied(raw, (fleet.path[0], f"{fleet.path[1]}-{number}"))
    if number > fleet.present and isinstance(entry, Fields) and SPARE not in entry.values:
        entry = _as_spare(entry)
    placed = own.values if isinstance(own, Fields) else {}
    if isinstance(placed.get(AT), Fields):
        placed = placed[AT].values  # type: ignore[union-attr]
    return _moved(entry, {axis: step for axis, step in fleet.spacing.items() if axis not in placed}, number - 1)


def _as_spare(entry: Fields) -> Fields:
    """Return an entry that is absent until it is added."""
    at = entry.place
    return Fields(at, {**entry.values, SPARE: Leaf(at, True)}, {**entry.keys, SPARE: at})


def _moved(entry: Tree, spacing: Mapping[str, Step], steps: int) -> Tree:
    """Return an entry further along the axes, by a number of steps."""
    if steps == 0 or not spacing or not isinstance(entry, Fields):
        return entry
    there = entry.values.get(AT)
    if there is None and _stands_at_a_pose(entry):
        there = Fields(entry.place, {}, {})
    if isinstance(there, Fields):
        keys = {AT: next(iter(spacing.values())).key, **entry.keys}
        return Fields(entry.place, {**entry.values, AT: _moved(there, spacing, steps)}, keys)
    moved = Fields(entry.place, dict(entry.values), dict(entry.keys))
    for axis, step in spacing.items():
        there = entry.values.get(axis)
        if there is None:
            moved.values[axis], moved.keys[axis] = Leaf(step.leaf.place, _further("0 m", step, steps)), step.key
        elif isinstance(there, Leaf):
            moved.values[axis] = Leaf(there.place, _further(there.value, step, steps))
    return moved


def _stands_at_a_pose(entry: Fields) -> bool:
    """Whether the model of an entry has its place in `at`; what is wrong with the model is found elsewhere."""
    model = entry.values.get("model")
    try:
        return isinstance(model, Leaf) and AT in registry.find_model(str(model.value)).settings.model_fields
    except Refused:
        return False


def _further(text: Scalar, step: Step, steps: int) -> Scalar:
    """Return a length that is so many steps further, in its own unit; one that is none stays, for the schema."""
    try:
        exact_m = units.parse(text, units.LENGTH) + steps * step.exact_m
    except BadValue:
        return text
    found = _UNIT.search(str(text))
    assert found is not None, "a length has a unit"
    unit = found[0].strip()
    return f"{_decimal(exact_m / units.LENGTH.units[unit])} {unit}"


def _decimal(value: Fraction) -> str:
    """Return a fraction whose denominator has no prime factors but 2 and 5 as a decimal number."""
    places = value.denominator.bit_length()
    digits = f"{abs(value.numerator) * 10**places // value.denominator:0{places + 1}d}"
    text = f"{digits[:-places]}.{digits[-places:]}".rstrip("0").rstrip(".")
    return f"-{text}" if value < 0 else text
