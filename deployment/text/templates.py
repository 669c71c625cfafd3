"""Templates: what entries have that are `like` one of them.

`templates:` of a deployment has partial entries by name. An entry that is `like` a template has the template's keys;
its own come over them: a mapping over a mapping is merged key by key, anything else replaces what the template has, and
`null` takes it away. A template may be like another one. Nodes are shared, so that an entry without keys of its own
costs nothing, and keep their places: what is wrong with a template is wrong there.

A kit's section with `preset: NAME` is in the same way over all that the kit knows under that name.
"""

from __future__ import annotations

from typing import Any, Final

from foosim.common import limits
from foosim.common.errors import BadValue
from foosim.common.finding import Location
from foosim.common.names import NAME_RULE, is_name, nearest_quoted
from foosim.deployment.text.report import Report
from foosim.deployment.text.yaml import Fields, Items, Leaf, Place, Tree, plain
from foosim.world.component_types import registry
from foosim.world.component_types.descriptions import Kit

TEMPLATES: Final = "templates"
LIKE: Final = "like"
PRESET: Final = "preset"
OF_ENTRIES: Final = ("count", "spacing", "each")
"""Keys of entries, invalid in templates: an entry has its own count."""


def merged(base: Tree, own: Tree) -> Tree:
    """Return a node over another one; neither is changed, and what only one of them has is shared."""
    if not (isinstance(base, Fields) and isinstance(own, Fields)):
        return own
    fields = Fields(own.place, dict(base.values), dict(base.keys))
    for key, value in own.values.items():
        if key not in base.values:
            fields.values[key], fields.keys[key] = value, own.keys[key]
        elif isinstance(value, Leaf) and value.value is None:
            del fields.values[key], fields.keys[key]
        else:
            fields.values[key], fields.keys[key] = merged(base.values[key], value), own.keys[key]
    return fields


def without(fields: Fields, *keys: str) -> Fields:
    """Return a mapping without some keys; its nodes are shared."""
    left = {key: value for key, value in fields.values.items() if key not in keys}
    return Fields(fields.place, left, {key: fields.keys[key] for key in left})


class Templates:
    """The templates of a deployment's tree. Their errors are reported once."""

    def __init__(self, tree: Fields, report: Report) -> None:
        self._report = report
        self._written: dict[str, Fields] = {}
        self._keys: dict[str, Place] = {}
        self._refused: set[str] = set()
        self._whole: dict[str, Fields | None] = {}
        self._used: set[str] = set()
        self._reported: set[Place] = set()
        section = tree.values.get(TEMPLATES)
        if isinstance(section, Fields):
            self._read(section)
        elif section is not None:
            report.add(section.place, (TEMPLATES,), "not a mapping", plain(section))

    def _read(self, section: Fields) -> None:
        if len(section.values) > limits.TEMPLATES_MAX:
            what = f"more than {limits.TEMPLATES_MAX} templates"
            self._report.add(section.place, (TEMPLATES,), what, len(section.values))
            self._report.stop()
        for name, template in section.values.items():
            path: Location = (TEMPLATES, name)
            if not is_name(name):
                self._report.add(section.keys[name], (TEMPLATES,), f"not a template's name ({NAME_RULE})", name)
            elif not isinstance(template, Fields):
                self._report.add(template.place, path, "not a mapping", plain(template))
            else:
                for key in OF_ENTRIES:
                    if key in template.values:
                        what = "a key of entries, which a template does not have"
                        self._report.add(template.keys[key], path, what, key)
                self._written[name] = without(template, *OF_ENTRIES)
                self._keys[name] = section.keys[name]
                continue
            self._refused.add(name)

    @property
    def names(self) -> list[str]:
        """The names of the templates."""
        return list(self._written)

    def applied(self, entry: Tree, path: tuple[str, str]) -> Tree:
        """Return an entry of a section merged with its template. Without a valid template the entry is broken."""
        like = entry.values.get(LIKE) if isinstance(entry, Fields) else None
        if like is None or not isinstance(entry, Fields):
            return entry
        template, own = self._meant(like, (*path, LIKE), ()), without(entry, LIKE)
        if template is None:
            self._report.broken.add(path)
            return own
        return merged(template, own)

    def whole(self, name: str, chain: tuple[str, ...] = ()) -> Fields | None:
        """Return a template merged with its own template; None, reported, without a valid one."""
        if name not in self._whole:
            template = self._written[name]
            like = template.values.get(LIKE)
            found: Tree | None = template
            if like is not None:
                base = self._meant(like, (TEMPLATES, name, LIKE), (*chain, name))
                found = None if base is None else merged(base, without(template, LIKE))
            assert found is None or isinstance(found, Fields), "two mappings"
            self._whole[name] = found
        return self._whole[name]

    def _meant(self, like: Tree, path: Location, chain: tuple[str, ...]) -> Fields | None:
        """Return the whole template that `like` names, at a path; `chain` are the templates that are like it."""
        name, nearest = plain(like), None
        if not isinstance(name, str):
            what = "not the name of a template"
        elif name in self._refused:
            return None
        elif name not in self._written:
            what, nearest = "unknown template", nearest_quoted(name, self._written)
        elif name in chain:
            what = f"a template that is like itself ({' is like '.join([*chain[chain.index(name) :], name])})"
        elif len(chain) >= limits.LIKE_DEPTH_MAX:
            what = f"more than {limits.LIKE_DEPTH_MAX} templates that are like one another"
        else:
            self._used.add(name)
            return self.whole(name, chain)
        if like.place not in self._reported:  # by another entry of a fleet
            self._reported.add(like.place)
            self._report.add(like.place, path, what, name, nearest)
        return None

    def unused(self) -> dict[str, tuple[Fields, Place]]:
        """Return the whole templates that nothing is like, each with the place of its name."""
        found = {name: (self.whole(name), self._keys[name]) for name in self._written if name not in self._used}
        return {name: (whole, place) for name, (whole, place) in found.items() if whole is not None}


def with_preset(name: str, section: Tree, report: Report) -> Tree:
    """Return a section over the preset that it names, itself where it names none or is that of no kit with presets.

    Values of the preset have the place of its name. An unknown preset is reported, and replaced by the first.
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
