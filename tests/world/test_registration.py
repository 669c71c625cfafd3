"""A component is checked when it is registered: refused with its name, its module and its place."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import pytest

from foosim.common.errors import BadValue
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.validate import models_of
from foosim.world.component_types import registry
from foosim.world.component_types.registry import find, find_model
from foosim.world.layout import build_layout
from tests.deployed import TEXT
from tests.own_components import folder_on_path, fresh, install, problems, written


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder on the path."""
    return folder_on_path(tmp_path, monkeypatch)


NAME: Final = "a name is a lower case letter, then lower case letters, digits, - and _, at most 32 in all"
ONE: Final = 'Quantity(units.LENGTH, "0 m", "1 m")'
REFUSED: Final = {
    'sensor("Own", Settings, Number)': f"own_form registers a sensor as 'Own': {NAME}",
    'sensor("own", ActuatorSettings, Number)': "its settings are a class derived from SensorSettings, not ",
    'kit("own", Own)': "its settings are a class derived from SpecBase, not Own",
    'sensor("own", Settings, dict)': "its reading is a class derived from msgspec.Struct, not dict",
    'sensor("own", Settings, Nothing)': "its reading Nothing has no fields",
    'sensor("own", Settings, Number, needs="contacts")': "needs: Expected `array`, got `str`",
    'sensor("own", Settings, Number, kit=3)': "kit: Expected `str`, got `int`",
    'sensor("own", Settings, Number, array_length="rays")': "array_length names no setting, 'rays'",
    'sensor("own", Settings, Number, shown_as="foxglove.Pose")': "shown_as is one of foxglove.LaserScan, ",
    'sensor("own", Settings, Number, shown_as="foxglove.PoseInFrame")': "its reading Number lacks the numbers that ",
    'sensor("own", Settings, Scan, shown_as="foxglove.LaserScan")': "its settings Settings lack bearings, which ",
    'sensor("own", Settings, Number, slots={"kept": 1})': "its slots are declared in its class, as offset = ",
    'modifier("own", ModifierSettings, per_field={"std": 0.0})': "per_field names no setting, 'std' (there are: kind)",
    'rule("own", RuleSettings, settable={"a": 1.0})': "settable: a is set to a Quantity, which has limits, not to ",
    f'model("own", RobotSettings, slots={{"at": 1}}, settable={{"at": {ONE}}})': "settable: at is set by foosim itself",
    f'rule("own", RuleSettings, settable={{"a": {ONE}}})': "settable: a is no slot of one number, ",
    'rule("own", RuleSettings, each={"rod": {"a": 0}})': "each rod: a has 1 to 65536 numbers, or ENTITY, not 0",
    'model("own", RobotSettings, slots={"down": 2})': "down, which foosim writes, is one number, not 2",
    'model("own", RobotSettings, actuators={"drive": "wheel_speeds"})': "actuators: Expected `object`, got `str`",
    'model("own", RobotSettings, variants={"rigid": {"is_rigid": True}})': "it has variants, and its settings have no ",
}
"""Registrations, and what is said of each."""


@pytest.mark.parametrize("registration", REFUSED)
def test_a_registration_that_cannot_be_is_refused_with_name_module_and_place(site: Path, registration: str) -> None:
    path = written(site, f"{registration}(Own)")
    type_name = registration.partition("(")[0]
    line = len(path.read_text().splitlines())
    with pytest.raises(BadValue) as error:
        find(type_name, "own_form:Own")
    found = error.value.problem
    word = "rule of worlds" if type_name == "rule" else type_name
    assert found.startswith("cannot be imported: Refused: ") and REFUSED[registration] in found, found
    assert f"{word} own of own_form: " in found or "own_form registers" in found
    assert found.endswith(f" (own_form.py:{line})")
    assert registry.lookup(type_name, "own") is None


SETTINGS: Final = {"kit": "SpecBase", "model": "RobotSettings"}


@pytest.mark.parametrize("type_name", ["sensor", "actuator", "modifier", "model", "rule", "kit"])
def test_a_class_of_another_type_is_refused(site: Path, type_name: str) -> None:
    value = ", Number" if type_name in ("sensor", "actuator") else ""
    settings = SETTINGS.get(type_name, f"{type_name.title()}Settings")
    written(site, "class Bare: pass", f"{type_name}('own', {settings}{value})(Bare)")
    with pytest.raises(BadValue, match=f"the class Bare is not derived from {type_name.title()} of foosim.components"):
        find(type_name, "own_form:Bare")


MISPLACED: Final = {
    "Model, a = slot(), model('own', RobotSettings)": "the slots of a model are slots= of its registration",
    "Sensor, a = slot(shared=True), sensor('own', Settings, Number)": "slot(shared=True) is valid in rules of entities",
    "Rule, a = need(), rule('own', RuleSettings)": "need() is valid in components of entities only",
}


@pytest.mark.parametrize("declared", MISPLACED)
def test_a_declaration_that_the_type_has_no_use_for_is_refused(site: Path, declared: str) -> None:
    base, line, registration = declared.split(", ", 2)
    written(site, f"class Kept({base}):", f"    {line}", f"{registration}(Kept)")
    with pytest.raises(BadValue) as error:
        find(registration.partition("(")[0], "own_form:Kept")
    assert " own of own_form: " in error.value.problem and MISPLACED[declared] in error.value.problem


@pytest.mark.parametrize(
    ("base", "hook", "registration"),
    [
        ("Sensor", "sample", "sensor('own', Settings, Number)"),
        ("Actuator", "command", "actuator('own', ActuatorSettings, Number)"),
        ("Modifier", "apply", "modifier('own', ModifierSettings)"),
    ],
)
def test_a_class_with_a_misspelt_hook_is_refused(site: Path, base: str, hook: str, registration: str) -> None:
    written(site, f"class Kept({base}):", f"    def {hook}s(self, *given): pass", f"{registration}(Kept)")
    with pytest.raises(BadValue, match=f"the class Kept has no method {hook}, nearest is {hook}s"):
        find(base.lower(), "own_form:Kept")


# --- slots that follow from settings ---------------------------------------------------------------------------------

PLACE: Final = "robots.red.goal.sensors.own"
SLOTS: Final = {
    "a = slot()": "",
    "a = slot(lambda settings, carrier: settings.count)": "",
    "a = slot(0)": "a has 1 to 65536 numbers, or ENTITY, not 0",
    "a, b = slot(65_536), slot()": "65537 numbers in all, at most 65536 are valid",
    "B = slot()": f"'B': {NAME}",
    "samples = slot()": "each sensor has a slot samples already",
    "a = slot(lambda settings, carrier: '1')": "slots are wrong: a has 1 to 65536 numbers, or ENTITY, not '1', 'own'",
    "a = slot(lambda settings, carrier: 1 / 0)": "its slots failed: ZeroDivisionError: division by zero "
    "(own_form.py:LINE), 'own'",
    "a = slot(refuse)": "more than can be kept, '3 s'",
}
"""Declarations of a class, and their problem."""


@pytest.mark.parametrize("slots", SLOTS)
def test_slots_are_checked_and_sizes_follow_from_settings(site: Path, slots: str) -> None:
    refuse = ("def refuse(settings, carrier):", "    raise BadValue('more than can be kept', '3 s')")
    lines = written(site, *refuse, "class Kept(Own):", f"    {slots}", "sensor('own', Settings, Number)(Kept)")
    line = len(lines.read_text().splitlines()) - 1
    sets, problem = (
        [f"{PLACE}={{kind: 'own_form:Kept', rate: 100 Hz, count: 7}}"],
        SLOTS[slots].replace("LINE", str(line)),
    )
    found = problems(*sets)
    assert (problem in found[0] and len(found) == 1) if problem else not found, found
    if not problem:
        counts = build_layout(load_deployment(apply_sets(TEXT, "t.yaml", sets), "t.yaml"))["red.goal"].counts
        assert counts["own.a"] == (7 if "count" in slots else 1)


def test_a_check_that_fails_is_a_problem_of_the_modifier(site: Path) -> None:
    written(site, "Own.check = staticmethod(lambda settings, numbers: 1 / 0)", "modifier('own', ModifierSettings)(Own)")
    (problem,) = problems("robots.red.goal.sensors.encoder.modifiers=[{kind: 'own_form:Own'}]")
    line = len((site / "own_form.py").read_text().splitlines()) - 1
    why = f"ZeroDivisionError: division by zero (own_form.py:{line})"
    assert problem.endswith(f"modifiers[0]: its check fails: {why}, 'own_form:Own'")


# --- models ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("about", "fields"),
    [
        ("", ["down", "refused", "clamped"]),
        ("slots={'x': 1}", ["x", "down", "refused", "clamped"]),
        ("slots={'refused': 1, 'x': 2}", ["refused", "x", "down", "clamped"]),
        ("slots={'x': 1}, motion=Motion", ["x", "down", "refused", "clamped", "quarantined"]),
        ("slots={'x': 1}, is_rigid=True, is_robot=False", ["x", "quarantined"]),
        ("slots={'x': 1}, is_robot=False", ["x"]),
    ],
)
def test_a_model_has_the_fields_that_foosim_needs(site: Path, about: str, fields: list[str]) -> None:
    written(site, f"model('own', RobotSettings, {about})(Own)")
    assert [*find_model("own_form:Own").fields_of(None, None)] == fields


def test_a_model_is_the_variant_of_its_settings(site: Path) -> None:
    settings = ("class Moved(RobotSettings):", "    dynamics: str = 'none'", "")
    about = "slots={'x': 1}, variants={'rigid': {'is_rigid': True, 'slots': {'y': 2}}}"
    written(site, *settings, f"model('own', Moved, {about})(Own)")
    model = find_model("own_form:Own")
    plain, rigid = (model.variant(its) for its in ("none", "rigid"))
    assert plain is model and (rigid.name, rigid.is_rigid) == ("own", True)
    assert [*plain.fields_of(None, None)] == ["x", "down", "refused", "clamped"]
    assert [*rigid.fields_of(None, None)] == ["y", "down", "refused", "clamped", "quarantined"]


# --- modules that cannot be imported ---------------------------------------------------------------------------------


def test_what_a_broken_module_has_imported_before_stays_registered(site: Path) -> None:
    """It stays imported, so that nothing would register it again."""
    code = """
import json
from foosim.common.errors import BadValue
from foosim.world.component_types.registry import find
for kind in ("own_broken:Own", "own_broken:Own"):
    try:
        find("sensor", kind)
    except BadValue as error:
        told = str(error)
print(json.dumps([find("sensor", "encoder").module, find("sensor", "own").module, told]))
"""
    written(site, "sensor('own', Settings, Number)(Own)")
    broken = ("import foosim.library.table.encoder", "import own_form", "class Other(Own): pass",
              "sensor('other', Settings, Number)(Other)", "raise RuntimeError('at import')")  # fmt: skip
    written(site, *broken, name="own_broken")
    encoder, own, told = fresh(code, site)
    assert (encoder, own) == ("foosim.library.table.encoder", "own_form")
    assert told.startswith("cannot be imported: RuntimeError: at import (own_broken.py:")


def test_an_import_error_of_a_package_is_in_the_message_of_each_type(site: Path) -> None:
    """A model, kit or engine that is unknown may be in it."""
    written(site, "raise RuntimeError('at import')")
    install(site, "worn", "0.3", "own_form")
    line = len((site / "own_form.py").read_text().splitlines())
    why = f"own_form of worn 0.3 cannot be imported: RuntimeError: at import (own_form.py:{line})"
    robots = ", ".join(model.name for model in models_of(robots=True))
    assert problems("robots.camera.model=zeppelin") == [
        f"robots.camera.model: unknown model; {why} (there are: {robots}, or any module:Class), 'zeppelin'"
    ]
    assert problems("zoo={fence: 1 m}") == [f"unknown key; {why}, 'zoo'"]
    assert problems("capture.zoo=3") == ["capture: unknown key, 'zoo'"]
    assert problems("robots.red.goal.rules={own: {kind: laps}}") == [
        f"robots.red.goal.rules.own.kind: unknown rule of entities; {why} (there are: battery, burns, or any "
        "module:Class), 'laps'"
    ]
    assert problems("rules={own: {kind: laps}}") == [
        f"rules.own.kind: unknown rule of worlds; {why} (there are: catch, football, teleported, wind, zone, "
        "or any module:Class), 'laps'"
    ]
