"""The settings of a form at their limits and beyond, as its schema says them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

from foosim.cli.components import as_json
from foosim.world.forms.forms import ComponentType
from tests.forms.worlds import Place, World

QUANTITY: Final = re.compile(r"[\w ]+, (\S+) (.+?) to (\S+) (.+?): a number and one of .*")
NUMBER: Final = re.compile(r"(number|integer)(?:, at least ([\d.]+))?(?:, at most ([\d.]+))?")
NOTHING: Final[tuple[Any, ...]] = ("nonsense", "1 furlong", [], True, "nan", "inf")
"""What is no setting that has limits: each of these has one of them."""


class Edge(NamedTuple):
    """A value of a setting; whether it is within the limits."""

    place: Place
    value: Any
    is_within: bool

    @property
    def label(self) -> str:
        """As pytest and messages name it."""
        return f"{'.'.join(map(str, self.place))}={self.value!r}"


def edges(form: ComponentType, world: World) -> Iterator[Edge]:
    """Yield the limits of each of a form's settings that has any, and what lies just beyond."""
    if not world.place:
        return
    for count, setting in enumerate(as_json(form)["settings"]):
        place = _placed(setting["key"].split("."), world)
        quantity, number = QUANTITY.fullmatch(setting["value"]), NUMBER.fullmatch(setting["value"])
        if quantity is not None:
            low, unit, high, other = quantity.groups()
            yield Edge(place, f"{low} {unit}", is_within=True)
            yield Edge(place, f"{high} {other}", is_within=True)
            yield Edge(place, f"{_less(float(low)):.9g} {unit}", is_within=False)
            yield Edge(place, f"{-_less(-float(high)):.9g} {other}", is_within=False)
        elif number is not None:
            kind, least, most = number.groups()
            made, step = (int, 1) if kind == "integer" else (float, 0.001)
            for limit, beyond in ((least, -step), (most, step)):
                if limit is not None:
                    yield Edge(place, made(limit), is_within=True)
                    yield Edge(place, made(limit) + beyond, is_within=False)
        else:
            continue
        yield Edge(place, NOTHING[count % len(NOTHING)], is_within=False)
    yield Edge(("unheard_of",), "1 m", is_within=False)


def _less(number: float) -> float:
    return number - max(abs(number) * 0.01, 0.001)


def _placed(keys: list[str], world: World) -> Place:
    """Return the place of a setting; of one that any name may have, in the first that the world has."""
    section: Any = world.data
    for key in world.place:
        section = section[key]
    place: list[str | int] = []
    for key in keys:
        name = next(iter(section)) if key == "NAME" else key
        place.append(name)
        section = section.get(name, {}) if isinstance(section, dict) else {}
    return tuple(place)
