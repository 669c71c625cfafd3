"""Entries that make several: `count: N` makes NAME-1 to NAME-N, `each: SELECTOR` one for each robot that it matches.

Of a count each is by `spacing` beside the one before; lengths are added exactly. With `spare: M` there are M more,
which are absent until they are added; without a count there are only these.

In the name, in texts and in keys of an entry for each robot `$robot` is the robot's name, `$1`, `$2`... are what the
wildcards of the selector match in it, and `$$` is a dollar sign. Where it runs may also follow from `$node`, the
node that owns the robot at the start: nothing else, since the world does not depend on nodes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Final

from foosim.common import units
from foosim.common.errors import BadValue, Refused
from foosim.common.finding import Location
from foosim.deployment.text.report import Report
from foosim.deployment.text.yaml import Fields, Items, Leaf, Place, Scalar, Tree, plain
from foosim.world.component_types import registry

COUNT: Final = "count"
SPARE: Final = "spare"
SPACING: Final = "spacing"
AXES: Final = ("x", "y", "z")
AT: Final = "at"
"""The pose of an entry, which the spacing changes."""
EACH: Final = "each"
NODE: Final = "$node"
PLACES: Final = ("process", "host", "label")
"""Keys for the host of an entry."""

_SIGN: Final = re.compile(r"\$([a-z]+|[0-9]|\$)?")
_UNIT: Final = re.compile(r"[A-Za-z]+ *$")

Change = Callable[[Tree], Tree]
"""Turns the written entry, which is of all that it makes, into one of them."""


# --- count ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Step:
    """The distance along an axis from each entry to the next: an exact length in metres, as written, with its place."""

    exact_m: Fraction
    leaf: Leaf
    key: Place


def counted(entry: Fields, path: tuple[str, str], count_max: int, report: Report) -> dict[str, Change]:
    """Return what an entry with a count or spares makes, by name; nothing of any other entry."""
    spare = entry.values.get(SPARE)
    if spare is not None and isinstance(plain(spare), bool):
        spare = None
    if COUNT not in entry.values and spare is None:
        if SPACING in entry.values:
            report.add(entry.keys[SPACING], path, "spacing without count", SPACING)
        return {}
    present, spares = (
        0 if node is None else _count(node, (*path, key), count_max, report)
        for key, node in ((COUNT, entry.values.get(COUNT)), (SPARE, spare))
    )
    spacing = _spacing(entry.values.get(SPACING), (*path, SPACING), report)
    return {
        f"{path[1]}-{number + 1}": partial(_member, spacing=spacing, number=number, is_spare=number >= present)
        for number in range(present + spares)
    }


def _count(node: Tree, path: Location, count_max: int, report: Report) -> int:
    """Return a count; 1, reported, where it is none."""
    count = plain(node)
    if type(count) is not int or not 1 <= count <= count_max:
        report.add(node.place, path, f"not a whole number from 1 to {count_max}", count)
        return 1
    return count


def _spacing(node: Tree | None, path: Location, report: Report) -> dict[str, Step]:
    """Return the steps by axis; invalid ones are reported and left out."""
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


def _member(entry: Tree, spacing: Mapping[str, Step], number: int, is_spare: bool) -> Tree:
    """Return one of a fleet, by its number from 0."""
    moved = _moved(entry, spacing, number)
    if not is_spare or not isinstance(moved, Fields):
        return moved
    at = moved.place
    return Fields(at, {**moved.values, SPARE: Leaf(at, True)}, {**moved.keys, SPARE: at})


def _moved(entry: Tree, spacing: Mapping[str, Step], steps: int) -> Tree:
    """Return an entry further along the axes, by a number of steps."""
    if steps == 0 or not spacing or not isinstance(entry, Fields):
        return entry
    there = entry.values.get(AT)
    if there is None and _has_a_pose(entry):
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


def _has_a_pose(entry: Fields) -> bool:
    """Whether the model of an entry has its place in `at`; errors of the model are found elsewhere."""
    model = entry.values.get("model")
    try:
        return isinstance(model, Leaf) and AT in registry.find_model(str(model.value)).settings.model_fields
    except Refused:
        return False


def _further(text: Scalar, step: Step, steps: int) -> Scalar:
    """Return a length increased by some steps, in its own unit; an invalid one stays, for the schema."""
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


# --- each -------------------------------------------------------------------------------------------------------------


class BadSign(Exception):
    """A text whose signs cannot be replaced, at its place."""

    def __init__(self, place: Place, bad: BadValue) -> None:
        super().__init__(bad.problem)
        self.place = place
        self.bad = bad


def put(text: str, place: Place, values: Mapping[str, str]) -> str:
    """Return a text with values in place of its signs; raises BadSign."""

    def value(found: re.Match[str]) -> str:
        known = values.get(found[1] or "")
        if known is None:
            valid = ", ".join(f"${sign}" for sign in values)
            raise BadSign(place, BadValue(f"a $ without a meaning here (valid are {valid})", text))
        return known

    return _SIGN.sub(value, text)


def filled_entry(entry: Tree, values: Mapping[str, str], node: str | None) -> Tree:
    """Return an entry with values in place of all signs, and the name of a node where it says where it runs.

    Raises BadSign.
    """
    if not isinstance(entry, Fields) or node is None or not any(key in entry.values for key in PLACES):
        return filled(entry, values)
    placed = {**values, NODE.removeprefix("$"): node}
    return Fields(
        entry.place,
        {key: filled(value, placed if key in PLACES else values) for key, value in entry.values.items()},
        dict(entry.keys),
    )


def filled(node: Tree, values: Mapping[str, str]) -> Tree:
    """Return a node with values in place of all signs, itself where it has none; raises BadSign."""
    if isinstance(node, Leaf):
        has_signs = isinstance(node.value, str) and "$" in node.value
        return Leaf(node.place, put(str(node.value), node.place, values)) if has_signs else node
    if isinstance(node, Items):
        items = [filled(item, values) for item in node.items]
        return Items(node.place, items) if any(map(_is_other, items, node.items)) else node
    fields = Fields(node.place)
    for key, value in node.values.items():
        name, place = put(key, node.keys[key], values), node.keys[key]
        if name in fields.values:
            raise BadSign(place, BadValue(f"a key that is given twice for {values['robot']}", name))
        fields.values[name], fields.keys[name] = filled(value, values), place
    is_same = [*fields.values] == [*node.values] and not any(
        map(_is_other, fields.values.values(), node.values.values())
    )
    return node if is_same else fields


def _is_other(one: Tree, other: Tree) -> bool:
    return one is not other


def without_places_by_node(tree: Fields) -> None:
    """Remove from a written tree the hosts of entries that follow from their robots' nodes."""
    for name in ("templates", "players"):
        section = tree.values.get(name)
        for entry in section.values.values() if isinstance(section, Fields) else ():
            for key in PLACES if isinstance(entry, Fields) else ():
                value = entry.values.get(key)  # type: ignore[union-attr]
                if isinstance(value, Leaf) and isinstance(value.value, str) and NODE in value.value:
                    del entry.values[key], entry.keys[key]  # type: ignore[union-attr]
