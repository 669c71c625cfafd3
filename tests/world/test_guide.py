"""The guides' examples of one's own: each file as it is written there, in an empty folder that is on Python's path."""

from __future__ import annotations

import json
import re
import sys
import tomllib
from collections.abc import Mapping
from itertools import combinations
from math import hypot
from pathlib import Path
from textwrap import dedent
from typing import Any, Final, NamedTuple

import pytest
from yaml import safe_load

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from foosim.world.assembly.versions import foreign_versions
from foosim.world.assembly.world import WorldMarks
from tests.conftest import Command, Typed
from tests.frames import Frames
from tests.own_components import folder_on_path, forget_modules

ROOT: Final = Path(__file__).parents[2]
GUIDES: Final = [ROOT / "docs" / "how-to" / name for name in ("write_a_sensor.md", "extending.md")]
PACKAGE: Final = "pyproject.toml"
BASES: Final = ("omni.py", "omni_drive.py", "yard.py", "rounds.py", "yard.yaml")


class Use(NamedTuple):
    """How the guide uses an example: its deployment, settings, component and other files."""

    deployment: str
    component: str
    sets: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    is_package: bool = False

    @property
    def arguments(self) -> list[str]:
        """The settings as a command has them."""
        return [word for setting in self.sets for word in ("--set", setting)]


USES: Final[Mapping[str, Use]] = {
    "powers.py": Use(
        "deploy/table.yaml",
        "sensor motor_power",
        ('robots.red.goal.sensors.power={kind: "powers:MotorPower", rate: 100 Hz, efficiency: 80 %}',),
    ),
    "low_pass.py": Use(
        "deploy/table.yaml",
        "modifier low_pass",
        ('robots.red.goal.sensors.encoder.modifiers=[{kind: "low_pass:LowPass", time: 20 ms}]',),
    ),
    "laps.py": Use("deploy/warehouse.yaml", "rule laps", ('rules={laps: {kind: "laps:Laps"}}',)),
    "service.py": Use(
        "deploy/warehouse.yaml",
        "entity_rule service",
        ('robots.rover01.rules={battery: {kind: battery}, service: {kind: "service:Service", interval: 50 cm}}',),
    ),
    "omni.py": Use("yard.yaml", "model omni", files=BASES),
    "omni_drive.py": Use("yard.yaml", "actuator omni_drive:OmniDrive", files=BASES),
    "yard.py": Use("yard.yaml", "scene yard:yard", files=BASES),
    "yards.py": Use("yard.yaml", "kit yard", ("scene=null", "yard={side: 8 m}"), BASES, is_package=True),
}
"""Of each example: how it is used. Those of one deployment are tested together."""
RUNS: Final = (("powers.py", "low_pass.py"), ("laps.py", "service.py"), ("omni.py",), ("yards.py",))
"""The examples whose worlds differ; those of one deployment are in one world, where each breaks laws as alone."""
FORCED: Final = "engine=pure"
TICKS: Final = {"deploy/table.yaml": 60, "deploy/warehouse.yaml": 20, "yard.yaml": 50}


def guides() -> str:
    return "".join(page.read_text() for page in GUIDES)


def examples() -> dict[str, str]:
    """The files that the guide has, by name."""
    return dict(re.findall(r"```\w+\n# ([\w.]+)\n(.*?)```", guides(), re.DOTALL))


def planted(folder: Path, name: str) -> tuple[str, list[str]]:
    """Write an example and what it needs into a folder; return its deployment and the settings that use it."""
    use, files = USES[name], examples()
    for file in {name, *use.files}:
        (folder / file).write_text(files[file])
    if use.is_package:
        install(folder, files[PACKAGE])
    deployment = folder / use.deployment if use.deployment in use.files else ROOT / use.deployment
    return str(deployment), use.arguments


def install(folder: Path, project: str) -> None:
    """Leave in a folder what pip leaves there of a package whose modules are in the folder."""
    about = tomllib.loads(project)["project"]
    left = folder / f"{about['name']}-{about['version']}.dist-info"
    left.mkdir()
    (left / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {about['name']}\nVersion: {about['version']}\n")
    points = about["entry-points"]["foosim.world"]
    (left / "entry_points.txt").write_text("\n".join(["[foosim.world]", *(f"{n} = {m}" for n, m in points.items())]))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder, on the path of this process and of those that it starts."""
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return folder_on_path(tmp_path, monkeypatch)


@pytest.fixture
def rehearsed(typed: Typed, folder: Path) -> Command:
    return typed("rehearse")


@pytest.fixture
def supervisor(typed: Typed, folder: Path) -> Command:
    return typed()


def test_the_guide_says_how_each_is_used() -> None:
    said = " ".join(guides().split())
    assert sorted({*USES, *BASES, PACKAGE}) == sorted(examples())
    assert all(setting in said for use in USES.values() for setting in use.sets)
    assert tomllib.loads(examples()[PACKAGE])["tool"]["setuptools"]["py-modules"] == [
        *("yards", "yard", "omni", "omni_drive", "rounds")
    ]


@pytest.mark.parametrize("name", ["laps.py", "omni.py"])
def test_an_example_is_the_same_world_on_any_number_of_nodes(folder: Path, rehearsed: Command, name: str) -> None:
    """On one and on three nodes; the check below has two, and another process, too."""
    deployment, sets = planted(folder, name)
    results: list[Any] = []
    for nodes in ("1", "3"):
        done = rehearsed(deployment, *sets, "--for", "400ms", "--nodes", nodes, "--json")
        assert done.code == 0, done.err
        results.append(json.loads(done.out))
    assert len({result["digest"]["chain"] for result in results}) == 1
    assert ("laps" in results[0]) == (name == "laps.py")


@pytest.mark.parametrize("names", RUNS, ids=" and ".join)
def test_the_check_of_components_finds_nothing_in_an_example(
    folder: Path, supervisor: Command, names: tuple[str, ...]
) -> None:
    """Whichever component is named, it compares all of the world."""
    deployments, settings = zip(*[planted(folder, name) for name in names], strict=True)
    (deployment,), sets = {*deployments}, [word for words in settings for word in words]
    component, ticks = USES[names[-1]].component, str(TICKS[USES[names[-1]].deployment])
    done = supervisor("check-component", component, "--in", deployment, "--set", FORCED, *sets, "--ticks", ticks)
    assert done.code == 0 and "the same world on 1, 2 and 3 nodes" in done.out, done


ONE: Final = [name for name in USES if not USES[name].files]


@pytest.mark.parametrize("name", ONE)
def test_the_path_without_it_is_refused_with_its_place(rehearsed: Command, name: str) -> None:
    use = USES[name]
    refused = rehearsed(ROOT / use.deployment, *use.arguments, "--for", "1s")
    assert refused.code == 2
    assert "--set:1:" in refused.err and "there is no module" in refused.err


def histories(
    folder: Path, name: str, ticks: int, wanted: tuple[str, ...], more: tuple[str, ...] = ()
) -> tuple[dict[str, list[list[float]]], list[str]]:
    """Return the numbers of each slot of some entities at each tick, and what was marked."""
    file, _ = planted(folder, name)
    text = apply_sets(Path(file).read_text(), file, [*USES[name].sets, *more, FORCED])
    keeping = Frames()
    assert not rehearse(text, file, ticks, settings=Settings(on_commit=keeping)).json["failed"]
    frames = keeping.frames
    layout = frames[0].layout
    slots = {
        f"{entity.name} {slot}": [list(frame.vector(entity.name, slot, count)) for frame in frames]
        for entity in layout.entities
        if entity.name in wanted
        for slot, count in entity.counts.items()
    }
    marks = WorldMarks(load_deployment(text, file), frames[-1].layout).between(frames[0], frames[-1])
    return slots, [mark for _, _, mark in marks]


def test_the_low_pass_follows_with_its_time_constant(folder: Path) -> None:
    """Against the recursion over the joints that the encoder reads: every 5th tick, at 2 ms a tick."""
    slots, _ = histories(folder, "low_pass.py", 1200, ("red.goal",))
    joints = [[0.0, 0.0], *slots["red.goal joint_positions"]]
    smooth = slots["red.goal encoder.low_pass.smooth"]
    expected = joints[0]
    for tick, found in enumerate(smooth):
        if tick % 5 == 0:
            expected = [old + 10 / 30 * (new - old) for old, new in zip(expected, joints[tick], strict=True)]
        assert found == pytest.approx(expected)
    assert any(abs(number) > 0.01 for number in smooth[-1])


def test_wear_is_the_way_of_the_wheels(folder: Path) -> None:
    slots, marks = histories(folder, "service.py", 100, ("rover01",))
    speeds = slots["rover01 wheel_speeds"]
    way = sum((abs(left) + abs(right)) / 2.0 * 0.02 for left, right in speeds)
    assert slots["rover01 service.worn"][-1] == pytest.approx([way]) and way > 0.5
    assert marks == ["rover01 is due for service"]


RADII: Final = {"alpha": 0.25, "beta": 0.25, "gamma": 0.4}


def least_gap(slots: Mapping[str, list[list[float]]]) -> float:
    """Return how near two bases came to each other, hull to hull (m)."""
    return min(
        hypot(x - u, y - v) - RADII[one] - RADII[other]
        for one, other in combinations(RADII, 2)
        for (x, y, _), (u, v, _) in zip(slots[f"{one} position"], slots[f"{other} position"], strict=True)
    )


def test_bases_go_round_and_turn(folder: Path) -> None:
    slots, _ = histories(folder, "omni.py", 2000, (*RADII,))
    for name in RADII:
        xs, ys, _ = zip(*slots[f"{name} position"], strict=True)
        assert min(max(xs) - min(xs), max(ys) - min(ys)) > 3.5 and max(map(abs, (*xs, *ys))) < 2.5, name
        assert slots[f"{name} heading"][-1][0] > 1.0
        assert {number for (number,) in slots[f"{name} quarantined"]} == {0.0}
    assert least_gap(slots) > 0.5


def test_bases_that_are_sent_into_each_other_stop_before_that(folder: Path) -> None:
    places = {"alpha": "-1", "beta": "1", "gamma": "0"}
    sets = [f"robots.{name}.x={x} m" for name, x in places.items()]
    sets += [f"robots.{name}.y={y} m" for name, y in zip(RADII, (0, 0, 2), strict=True)]
    slots, _ = histories(folder, "omni.py", 500, (*RADII,), tuple(sets))
    assert 0.0 < least_gap(slots) < 0.1


def test_a_kit_of_ones_own_is_a_section_that_checks_places(
    folder: Path, rehearsed: Command, supervisor: Command
) -> None:
    deployment, _ = planted(folder, "yards.py")
    refused = rehearsed(deployment, "--set", "scene=null", "--set", "yard={side: 3 m}", "--for", "1s")
    assert refused.code == 2
    assert "robots.alpha.model: starts outside of the yard's 3.0 m" in refused.err
    named = supervisor("components", "model", "omni")
    assert named.code == 0 and "model omni, of omni:Omni" in named.out


def test_the_reference_has_rules_and_a_scene_that_are_valid(folder: Path, rehearsed: Command) -> None:
    """Those that it shows, in the guide's yard and in the warehouse."""
    page = (ROOT / "docs" / "reference" / "deployment.md").read_text()
    section = page[page.index("## Kits, rules, scene") : page.index("## Components of robots")]
    of_world, of_robot = re.findall(r"(?:^    .*\n)+", section, re.MULTILINE)
    yard, _ = planted(folder, "omni.py")
    files = examples()
    for name in ("laps.py", "service.py"):
        (folder / name).write_text(files[name])
    text = re.sub(r"scene: .*\n", dedent(of_world), files["yard.yaml"])
    Path(yard).write_text(text)
    sets = [f"robots.rover01.rules={json.dumps(safe_load(of_robot)['robots']['rover01']['rules'])}"]
    for deployment, more in ((yard, []), (str(ROOT / "deploy" / "warehouse.yaml"), sets)):
        arguments = [word for setting in more for word in ("--set", setting)]
        done = rehearsed(deployment, *arguments, "--for", "100ms", "--json")
        assert done.code == 0, done.err
        assert ("laps" in json.loads(done.out)) == (deployment == yard)


def test_versions_of_what_is_not_foosims_follow_its_source(folder: Path) -> None:
    """Nodes compare them, and captures have them."""
    use = USES["laps.py"]
    file = ROOT / use.deployment
    seen = []
    for source in (examples()["laps.py"], examples()["laps.py"] + "# changed\n"):
        (folder / "laps.py").write_text(source)
        sys.modules.pop("laps", None)
        forget_modules()
        text = apply_sets(file.read_text(), file.name, use.sets)
        (version,) = foreign_versions(load_deployment(text, file.name)).items()
        seen.append(version)
    assert [name for name, _ in seen] == ["rule laps:Laps"] * 2 and seen[0][1] != seen[1][1]
