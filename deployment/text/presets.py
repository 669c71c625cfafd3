"""Presets: a kit's section with `preset: NAME` has all that the kit knows under that name and the section does not say.

What is written in the section counts; null takes away what the preset has. The key `preset` itself is gone then, as
templates are from what is like them.
"""

from __future__ import annotations

from typing import Any, Final

from foosim.common.errors import BadValue
from foosim.common.names import nearest_quoted
from foosim.deployment.text.report import Report
from foosim.deployment.text.templates import merged, without
from foosim.deployment.text.yaml import Fields, Items, Leaf, Place, Tree, plain
from foosim.world.forms import registry
from foosim.world.forms.forms import Kit

PRESET: Final = "preset"


def with_preset(name: str, section: Tree, report: Report) -> Tree:
    """Return a section over the preset that it names, itself where it names none or is that of no kit with presets.

    What comes from the preset has the place of its name. Of an unknown one, which is reported, the first stands in.
    """
    if not isinstance(section, Fields) or PRESET not in section.values:
        return section
    kit = registry.lookup("kit", name) if name.isidentifier() else None
    if not isinstance(kit, Kit) or not kit.presets:
        return section
    value = section.values[PRESET]
    chosen = plain(value)
    if not isinstance(chosen, str) or chosen not in kit.presets:
        nearest = nearest_quoted(chosen, kit.presets) if isinstance(chosen, str) else None
        bad = BadValue(f"unknown preset, valid are {', '.join(kit.presets)}", chosen, nearest)
        report.add_value(value.place, (name, PRESET), bad)
        chosen = next(iter(kit.presets))
    return merged(_tree(kit.presets[chosen], value.place), without(section, PRESET))


def _tree(data: Any, place: Place) -> Tree:
    """Return plain data as a tree, all of it at one place."""
    if isinstance(data, dict):
        return Fields(place, {key: _tree(value, place) for key, value in data.items()}, dict.fromkeys(data, place))
    if isinstance(data, list):
        return Items(place, [_tree(value, place) for value in data])
    return Leaf(place, data)
