"""One kit of a world defines the physics of rigid bodies; a second definition is refused with its place."""

from __future__ import annotations

from typing import Any

import pytest

from foosim.deployment.loader import load_deployment
from foosim.world.assembly import sections
from foosim.world.assembly.sections import findings_of, gravity_of, physics_of
from foosim.world.fixed_scenery import kits_of
from tests.deployed import DEPLOYMENT, TABLE


def test_the_tables_kit_defines_gravity() -> None:
    assert list(findings_of(DEPLOYMENT)) == [] and physics_of(DEPLOYMENT).gravity == 9.81


def test_gravity_is_the_kits_or_standard_gravity() -> None:
    hall = TABLE.with_stem("warehouse")
    assert gravity_of(DEPLOYMENT) == 9.81
    assert gravity_of(load_deployment(hall.read_text(), hall.name)) == 9.80665


def test_two_definitions_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    ((_, kit),) = kits_of(DEPLOYMENT)
    given: list[tuple[str, Any]] = [("table", kit), ("zoo", kit)]
    monkeypatch.setattr(sections, "kits_of", lambda spec: given)
    (twice,) = findings_of(DEPLOYMENT)
    assert (twice.location, twice.what) == (("zoo",), "defines the physics of rigid bodies, as table does already")
    given.clear()
    assert list(findings_of(DEPLOYMENT)) == [], "without a kit that says it, the deployment's physics are felt"
