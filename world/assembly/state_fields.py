"""What robots whose state follows from their settings, as that of one from a file does, lack for what they carry."""

from __future__ import annotations

from collections.abc import Iterator

from foosim.common.errors import ABSENT, BadValue
from foosim.common.finding import Finding, Location
from foosim.world.forms import registry
from foosim.world.forms.misfits import component_problems
from foosim.world.layout import find_motion
from foosim.world.spec import WorldSpec


def field_findings(spec: WorldSpec) -> Iterator[Finding]:
    """Yield settings of which no state follows, and components that need what it does not have.

    Robots whose state is that of their model are checked with the file; of these, the files must have been given.
    """
    for name, robot in spec.robots.items():
        model = registry.model_of(robot)
        if model.declared is not None:
            continue
        place: Location = ("robots", name)
        try:
            having = model.fields_of(robot, spec)
        except BadValue as bad:
            yield Finding(
                (*place, "model"), bad.problem, robot.model if bad.value is ABSENT else bad.value, bad.nearest
            )
            continue
        if model.motion:
            motion = find_motion(model)
            missing = [field for field in (*motion.needs, *motion.writes) if field not in having]
            if missing:
                what = f"a model whose motion {motion.name} needs {', '.join(missing)}, which it has not"
                yield Finding((*place, "model"), what, robot.model)
        parts = (("sensors", "sensor", robot.sensors), ("actuators", "actuator", robot.actuators))
        for section, form, settings in (*parts, ("rules", "entity_rule", robot.rules)):
            for label, its in settings.items():
                for problem in component_problems(registry.find(form, its.kind), model, having):
                    yield Finding((*place, section, label, "kind"), problem, its.kind)
