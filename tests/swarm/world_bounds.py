"""Bounds of a world's entities, checked in every frame: what their models and the world's kits say."""

from __future__ import annotations

from foosim.deployment.schema import Deployment
from foosim.world.assembly.world import models_of
from foosim.world.fixed_scenery import kits_of
from foosim.world.frame import Frame


def strays(deployment: Deployment, frame: Frame) -> list[str]:
    """Return descriptions of the entities of a frame that are out of bounds."""
    found: list[str] = []
    for index, model in models_of(deployment, frame.layout).items():
        wrong = model.out_of_bounds(frame.numbers) if hasattr(model, "out_of_bounds") else ""
        if wrong:
            found.append(f"{frame.layout.entities[index].name} {wrong}")
    for _, kit in kits_of(deployment):
        if hasattr(kit, "strays"):
            found += kit.strays(frame)
    return found
