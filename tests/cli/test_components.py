"""The commands `components` and `schema`: each component type, and nothing else in their output."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import pytest
from jsonschema import Draft202012Validator

from foosim.cli.components import chosen
from foosim.common.errors import DeploymentError, UnknownName
from foosim.deployment.loader import apply_sets
from foosim.world.component_types.registry import TYPE_NAMES, names
from tests.conftest import Typed
from tests.own_components import folder_on_path

Telling = Callable[..., tuple[str, str]]
TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
BOUNDED: Final = '''
from typing import Annotated

from msgspec import Struct
from pydantic import Field

from foosim.common.spec_base import SpecBase
from foosim.world.component_types.quantities import Metres
from foosim.world.components.base import Sensor
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings

print("said at import")


class Part(SpecBase):
    size: Annotated[float, Field(gt=1)]


class Settings(SensorSettings):
    least: Annotated[float, Field(gt=0, le=2)]
    most: Annotated[int, Field(ge=1, lt=7)] = 3
    times: list[Annotated[float, Field(lt=0)]] = []
    shares: dict[str, float] = {}
    parts: dict[str, Part] = {}


class Number(Struct, frozen=True):
    value: Metres


@sensor("bounded", Settings, Number)
class Bounded(Sensor):
    """Has bounds."""

    def sample(self, view):
        return Number(0.0)
'''


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder on the path with an installed package that prints when it is imported."""
    (tmp_path / "bounded.py").write_text(BOUNDED)
    about = tmp_path / "bounded-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: bounded\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[foosim.world]\nbounded = bounded\n")
    folder_on_path(tmp_path, monkeypatch)


@pytest.fixture
def told(typed: Typed) -> Telling:
    """Return a function that returns what the command writes to standard output and to standard error."""
    command = typed()

    def tell(*words: str) -> tuple[str, str]:
        done = command(*words)
        assert done.code == 0, done.err
        return done.out, done.err

    return tell


TOLD: Final = {
    ("rule", "football"): [
        "slots of each ball: still_ticks, out_ticks, wait_ticks, spot[2], serve, touched_by",
        "writes: ball",
    ],
    ("model", "rover"): [
        "sensors: by name: of sensors, see components sensor (default {})",
        "actuators: by name: of actuators, see components actuator (default {})",
        "rules: by name: of entity_rules, see components entity_rule (default {})",
        "tags: a list, each: string (default [])",
        "a robot",
        "moved by: WheeledMotion",
        "usual actuators: drive (wheel_speeds)",
        "usual rules: battery (battery)",
        "tags: vehicle",
    ],
    ("model", "ball"): ["not a robot, has no owner", "moved by: an engine"],
    ("model", "station"): ["moved by: nothing"],
    ("kit", "table"): ["rules: football (football)", "beside the robots: ball (ball)"],
    ("model", "fire"): ["can be set: at (a pose), radius (0 m to 100 m)", "moved by: Growing", "tags: fire"],
    ("model", "door"): ["can be set: open (0 % to 100 %, or true or false)"],
    ("rule", "wind"): ["can be set: x (-100 m/s to 100 m/s), y (-100 m/s to 100 m/s), z (-100 m/s to 100 m/s)"],
    ("entity_rule", "battery"): ["slots: charge", "slots that are the model's where it has them: charge"],
    ("model", "differential_drive"): [
        "moved by: WheeledMotion",
        "with dynamics: rigid, moved by: an engine; slots: position[3], orientation[4], linear_velocity[3], "
        "angular_velocity[3], contacts[3], partners[4], partner_impulses[4], still_ticks, quarantined, "
        "joint_positions[2], joint_velocities[2], joint_efforts[2], heading, wheel_speeds[2], wheel_travel[2], down, "
        "refused, clamped",
    ],
    ("sensor", "pose"): ["modifiers: a list: of modifiers, see components modifier (default [])"],
}


@pytest.mark.parametrize("about", TOLD)
def test_a_form_is_told_of_with_what_it_brings(told: Telling, about: tuple[str, str]) -> None:
    lines = [line.strip() for line in told("components", *about)[0].splitlines()]
    assert [line for line in TOLD[about] if line not in lines] == []


def test_all_are_told_of_in_json(told: Telling) -> None:
    found: list[dict[str, Any]] = json.loads(told("components", "--json")[0])["components"]
    assert [(one["type"], one["name"]) for one in found] == [
        (type_name, name) for type_name in TYPE_NAMES for name in names(type_name)
    ]
    by_name = {(one["type"], one["name"]): one for one in found}
    rover, football = by_name["model", "rover"], by_name["rule", "football"]
    assert (rover["mover"], rover["is_robot"], rover["tags"]) == ("WheeledMotion", True, ["vehicle"])
    assert rover["actuators"] == {"drive": {"kind": "wheel_speeds"}} and rover["rules"]["battery"]["kind"] == "battery"
    assert football["writes"] == ["ball"] and football["each"]["ball"]["still_ticks"] == 1
    assert by_name["kit", "table"]["entities"] == {"ball": "ball"}


@pytest.mark.usefixtures("site")
def test_bounds_are_told_of_as_they_are(told: Telling) -> None:
    out, _ = told("components", "sensor", "bounded")
    assert [line.strip() for line in out.splitlines() if "rate" not in line and "offset" not in line][3:-1] == [
        "modifiers: a list: of modifiers, see components modifier (default [])",
        "label: 1 to 64 printable characters (optional)",
        "least: number, more than 0, at most 2 (required)",
        "most: integer, at least 1, less than 7 (default 3)",
        "times: a list, each: number, less than 0 (default [])",
        "shares: by name, each: number (default {})",
        "parts.NAME.size: number, more than 1 (required)",
    ]


@pytest.mark.usefixtures("site")
def test_what_modules_print_is_not_in_the_list(told: Telling) -> None:
    out, err = told("components", "--json")
    assert "bounded" in [one["name"] for one in json.loads(out)["components"]] and err == "said at import\n"


@pytest.mark.usefixtures("site")
def test_what_modules_print_is_not_in_the_schema(told: Telling) -> None:
    out, err = told("schema")
    Draft202012Validator.check_schema(json.loads(out))
    assert "bounded" in out and err == "said at import\n"


def test_a_name_in_place_of_a_form_is_told_its_form() -> None:
    with pytest.raises(UnknownName, match=r"unknown component type; is it sensor pose\? \(there are: "):
        chosen("pose", None)


def test_a_section_without_its_package_says_that_there_is_none() -> None:
    with pytest.raises(DeploymentError, match="unknown key; no package that is installed here has a kit of this name"):
        apply_sets(TABLE.read_text(), TABLE.name, ["zzyard={side: 8 m}"])
