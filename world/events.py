"""Events of a world in a deployment: fields set, entities added and removed at a given or drawn time."""

from __future__ import annotations

import re
from typing import Annotated, Final, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from foosim.common import names, units
from foosim.common.errors import BadValue
from foosim.common.spec_base import SpecBase
from foosim.common.units import Quantity, custom_error

EVENTS_MAX: Final = 1024
FIELDS_MAX: Final = 32
_CHOICE: Final = re.compile(r"([1-9][0-9]{0,4}) of (\S+)")


def _selector(text: str) -> str:
    if not names.is_selector(text):
        raise custom_error(BadValue("no name of an entity, in which * and ? may stand for others", text))
    return text


def _choice(text: str) -> str:
    found = _CHOICE.fullmatch(text)
    if found is None or not names.is_selector(found[2]):
        raise custom_error(BadValue("no choice, such as `2 of rover-*`", text))
    return text


Time = Annotated[int, Quantity(units.TIME, "0 s", "1000000 s")]
Selector = Annotated[str, AfterValidator(_selector)]
Choice = Annotated[str, AfterValidator(_choice)]
Value = bool | str | dict[str, str]


class WorldEvent(SpecBase):
    """Sets fields of entities (`foosim set`), adds or removes them, at the first tick not before a time.

    The time is `at`, or drawn for each entity from those `between` two. The entities are all that `entity` matches, or
    a drawn number of them by `choose` (`2 of rover-*`). Draws follow from the seed and the place in the list. `add` is
    a pose, or `true` for the place in the deployment. A present entity is not added, an absent one neither set nor
    removed. A pose is set without a check of its place: bodies that overlap are pushed apart.
    """

    at_ns: Time | None = Field(default=None, alias="at")
    between: Annotated[list[Time], Field(min_length=2, max_length=2)] | None = None
    entity: Selector | None = None
    choose: Choice | None = None
    fields: dict[str, Value] | None = Field(default=None, alias="set", min_length=1, max_length=FIELDS_MAX)
    add: Literal[True] | str | dict[str, str] | None = None
    remove: Literal[True] | None = None

    @model_validator(mode="after")
    def _says_when_and_what(self) -> Self:
        if (self.at_ns is None) is (self.between is None):
            raise custom_error(BadValue("an event has a time: either `at` or `between`"))
        if (self.entity is None) is (self.choose is None):
            raise custom_error(BadValue("an event has entities: either `entity` or `choose`"))
        if self.between is not None and self.between[0] > self.between[1]:
            raise custom_error(BadValue("the second time of `between` is before the first one"))
        if [self.fields, self.add, self.remove].count(None) != 2:
            raise custom_error(BadValue("an event does one thing: `set`, `add` or `remove`"))
        return self

    @property
    def span_ns(self) -> tuple[int, int]:
        """The first and the last time that may be drawn."""
        low, high = self.between or (self.at_ns, self.at_ns)
        assert low is not None and high is not None, "checked with the fields"
        return low, high

    @property
    def chosen(self) -> tuple[int | None, str]:
        """The count of drawn entities (None: all), and the pattern of their names."""
        if self.choose is None:
            assert self.entity is not None, "checked with the fields"
            return None, self.entity
        count, _, selector = self.choose.partition(" of ")
        return int(count), selector
