"""Which forms a world is made of, and the versions of those that are not foosim's own.

Two nodes with different versions of a form would compute different worlds, and a capture is only repeated by the form
that it was made with.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from hashlib import blake2b
from typing import Any, Final

from foosim.world.assembly.sources import distributions, sources_of
from foosim.world.forms import registry
from foosim.world.forms.forms import Form, Model
from foosim.world.forms.settings import ActuatorSettings, SensorSettings
from foosim.world.layout import find_motion, kits_named, world_rules
from foosim.world.spec import WorldSpec

OWN: Final = "foosim."
DIGEST_BYTES: Final = 8


def forms_of(spec: WorldSpec) -> list[Form]:
    """Return the forms that a world is made of, each once, by form and name."""
    found = {(form.form, form.name): form for form in _forms_of(spec)}
    return [form for _, form in sorted(found.items())]


def _forms_of(spec: WorldSpec) -> Iterator[Form]:
    yield registry.find("engine", spec.engine)
    for kit in kits_named(spec):
        yield kit
        for name in (*kit.entities.values(), *kit.addable):
            yield from _with_motion(registry.find_model(name))
    for rule in world_rules(spec).values():
        yield registry.find("rule", rule.kind)
    if spec.scene is not None:
        yield registry.find("scene", spec.scene.kind)
    for thing in spec.objects.values():
        yield from _with_motion(registry.model_of(thing))
    for robot in spec.robots.values():
        yield from _with_motion(registry.model_of(robot))
        for sensor in robot.sensors.values():
            yield from _with_modifiers("sensor", sensor)
        for actuator in robot.actuators.values():
            yield from _with_modifiers("actuator", actuator)
        for of_entity in robot.rules.values():
            yield registry.find("entity_rule", of_entity.kind)


def _with_motion(model: Model) -> Iterator[Form]:
    yield model
    if model.motion:
        yield find_motion(model)


def _with_modifiers(form: str, settings: SensorSettings | ActuatorSettings) -> Iterator[Form]:
    yield registry.find(form, settings.kind)
    for modifier in settings.modifiers:
        yield registry.find("modifier", modifier.kind)


def foreign_versions(spec: WorldSpec) -> dict[str, str]:
    """Return the versions of the forms of a world that are not foosim's own, by form and class.

    A version is that of the package, if there is one, and a digest of its sources (`sources`).
    """
    foreign = [form for form in forms_of(spec) if not form.module.startswith(OWN)]
    return {f"{form.form} {form.module}:{form.made.__qualname__}": _version(form.made) for form in foreign}


@cache
def _version(made: Callable[..., Any]) -> str:
    digest = blake2b(digest_size=DIGEST_BYTES)
    for module, source in sources_of(made).items():
        digest.update(f"{len(module)} {module} {len(source)} ".encode() + source)
    version = _package_version(made.__module__.partition(".")[0])
    return f"{version} {digest.hexdigest()}".lstrip()


def _package_version(package: str) -> str:
    """Return the version of the distribution that a package is of, empty where there is none."""
    from importlib.metadata import PackageNotFoundError, version

    for distribution in distributions().get(package, ()):
        try:
            return version(distribution)
        except PackageNotFoundError:
            continue
    return ""
