"""Bounds of a world's entities, checked in every frame: what their models and the world's kits say."""

from __future__ import annotations

from foosim.deployment.schema import Deployment
from foosim.world.assembly.world import models_of
from foosim.world.fixed_scenery import kits_of
from foosim.world.frame import Frame


def strays(deployment: Deployment, frame: Frame) -> list[str]:
    """Return descriptions of the entities of a frame that are in the world and out of bounds."""
    found: list[str] = []
    for index, model in models_of(deployment, frame.layout).items():
        entity = frame.layout.entities[index]
        if hasattr(model, "out_of_bounds") and not entity.is_absent(frame.numbers):
            wrong = model.out_of_bounds(frame.numbers)
            found += [f"{entity.name} {wrong}"] if wrong else []
    for _, kit in kits_of(deployment):
        if hasattr(kit, "strays"):
            found += kit.strays(frame)
    return found
