"""Components whose settings their robots or the world do not fit: a link or joint that is not there, Earth where there
is none."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from foosim.common.finding import Finding
from foosim.common.keyed_random import draw_key
from foosim.world.components.misfit import Misfit
from foosim.world.components.view import Mounting
from foosim.world.forms import registry
from foosim.world.layout import build_layout
from foosim.world.spec import WorldSpec

SECTION_OF: Final = {"sensor": "sensors", "actuator": "actuators", "entity_rule": "rules"}


def unfit_components(spec: WorldSpec) -> Iterator[Finding]:
    """Yield what is wrong with components of a world whose single settings are right, each at its place."""
    having = [
        (name, form, channel, settings, made)
        for name, robot in spec.robots.items()
        for form, components in (("sensor", robot.sensors), ("actuator", robot.actuators), ("entity_rule", robot.rules))
        for channel, settings in components.items()
        if hasattr(made := registry.find(form, settings.kind).made, "check")
    ]
    if not having:
        return
    layout = build_layout(spec)
    for name, form, channel, settings, made in having:
        key = draw_key(spec.seed, form, name, channel)
        try:
            made.check(settings, Mounting(spec, layout, layout[name], channel, key, is_owners=form == "sensor"))
        except Misfit as error:
            place = ("robots", name, SECTION_OF[form], channel, *error.path)
            yield Finding(place, error.problem, error.value, error.nearest)
