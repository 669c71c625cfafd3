"""The guide's examples of one's own: each file as it is written there, in an empty folder, with foosim as installed."""

from __future__ import annotations

import json
import os
import re
import subprocess
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

ROOT: Final = Path(__file__).parents[2]
GUIDE: Final = ROOT / "docs" / "how-to" / "extending.md"
REHEARSE: Final = "from foosim.cli import main; main()"
SUPERVISOR: Final = "from foosim.cli import main; main()"
PACKAGE: Final = "pyproject.toml"
BASES: Final = ("omni.py", "omni_motion.py", "omni_drive.py", "yard.py", "rounds.py", "yard.yaml")


class Use(NamedTuple):
    """How the guide uses an example: in which deployment, with which settings, as which form, beside which files."""

    deployment: str
    form: str
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
    "omni_motion.py": Use("yard.yaml", "motion omni_motion:Glide", files=BASES),
    "omni_drive.py": Use("yard.yaml", "actuator omni_drive:OmniDrive", files=BASES),
    "yard.py": Use("yard.yaml", "scene yard:yard", files=BASES),
    "yards.py": Use("yard.yaml", "kit yard", ("scene=null", "yard={side: 8 m}"), BASES, is_package=True),
}
"""Of each example: how it is used. Those of one deployment are tested together."""
RUNS: Final = (("powers.py", "low_pass.py"), ("laps.py", "service.py"), ("omni.py",), ("yards.py",))
"""The examples whose worlds differ; those of one deployment are in one world, where each breaks laws as alone."""
FORCED: Final = "engine=pure"
TICKS: Final = {"deploy/table.yaml": 120, "deploy/warehouse.yaml": 20, "yard.yaml": 100}


def examples() -> dict[str, str]:
    """The files that the guide has, by name."""
    return dict(re.findall(r"```\w+\n# ([\w.]+)\n(.*?)```", GUIDE.read_text(), re.DOTALL))


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


def run(folder: Path, code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    command = [sys.executable, "-P", "-c", code, *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def test_the_guide_says_how_each_is_used() -> None:
    said = " ".join(GUIDE.read_text().split())
    assert sorted({*USES, *BASES, PACKAGE}) == sorted(examples())
    assert all(setting in said for use in USES.values() for setting in use.sets)
    assert tomllib.loads(examples()[PACKAGE])["tool"]["setuptools"]["py-modules"] == [
        *("yards", "yard", "omni", "omni_motion", "omni_drive", "rounds")
    ]


@pytest.mark.parametrize("name", ["laps.py", "omni.py"])
def test_an_example_is_the_same_world_on_any_number_of_nodes(tmp_path: Path, name: str) -> None:
    """In an empty folder, on one and on three nodes, in processes of their own; the check below has two, too."""
    deployment, sets = planted(tmp_path, name)
    results: list[Any] = []
    for nodes in ("1", "3"):
        done = run(tmp_path, REHEARSE, deployment, *sets, "--for", "400ms", "--nodes", nodes, "--json")
        assert done.returncode == 0, done.stderr
        results.append(json.loads(done.stdout))
    assert len({result["digest"]["chain"] for result in results}) == 1
    assert ("laps" in results[0]) == (name == "laps.py")


@pytest.mark.parametrize("names", RUNS, ids=" and ".join)
def test_the_check_of_components_finds_nothing_in_an_example(tmp_path: Path, names: tuple[str, ...]) -> None:
    """Whichever form it is asked for, it compares all of the world."""
    deployments, settings = zip(*[planted(tmp_path, name) for name in names], strict=True)
    (deployment,), sets = {*deployments}, [word for words in settings for word in words]
    form, ticks = USES[names[-1]].form, str(TICKS[USES[names[-1]].deployment])
    checked = ("check-component", form, "--in", deployment, "--set", FORCED, *sets, "--ticks", ticks)
    done = run(tmp_path, SUPERVISOR, *checked)
    assert done.returncode == 0 and "the same world on 1, 2 and 3 nodes" in done.stdout, done.stdout + done.stderr


ONE: Final = [name for name in USES if not USES[name].files]


@pytest.mark.parametrize("name", ONE)
def test_the_path_without_it_is_refused_with_its_place(tmp_path: Path, name: str) -> None:
    use = USES[name]
    refused = run(tmp_path, REHEARSE, str(ROOT / use.deployment), *use.arguments, "--for", "1s")
    assert refused.returncode == 2
    assert "--set:1:" in refused.stderr and "cannot be imported: ModuleNotFoundError" in refused.stderr


FRAMES: Final = """
import json
from pathlib import Path
from foosim.rehearsal.run import rehearse
from foosim.rehearsal.system import Settings
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.world.assembly.world import WorldMarks
frames = []
sets = [*SETS, "engine=pure"]
text = Path(FILE).read_text()
assert not rehearse(text, FILE, TICKS, 1, sets, Settings(on_commit=frames.append)).json["failed"]
spec = load_deployment(apply_sets(text, FILE, sets), FILE)
marks = WorldMarks(spec, frames[-1].layout).between(frames[0], frames[-1])
slots = {
    f"{entity.name} {slot}": [list(frame.vector(entity.name, slot, count)) for frame in frames]
    for entity in frames[0].layout.entities if entity.name in WANTED
    for slot, count in entity.counts.items()
}
print(json.dumps([slots, [text for _, _, text in marks]]))
"""


def histories(
    folder: Path, name: str, ticks: int, wanted: tuple[str, ...], more: tuple[str, ...] = ()
) -> tuple[dict[str, list[list[float]]], list[str]]:
    """Return the numbers of each slot of some entities at each tick, and what was marked."""
    deployment, _ = planted(folder, name)
    sets = (*USES[name].sets, *more)
    given = f"FILE, SETS, TICKS, WANTED = {deployment!r}, {sets!r}, {ticks}, {wanted!r}\n"
    done = run(folder, given + FRAMES)
    assert done.returncode == 0, done.stderr
    slots, marks = json.loads(done.stdout)
    return slots, marks


def test_the_low_pass_follows_with_its_time_constant(tmp_path: Path) -> None:
    """Against the recursion over the joints that the encoder reads: every 5th tick, at 2 ms a tick."""
    slots, _ = histories(tmp_path, "low_pass.py", 1200, ("red.goal",))
    joints = [[0.0, 0.0], *slots["red.goal joint_positions"]]
    smooth = slots["red.goal encoder.low_pass.smooth"]
    expected = joints[0]
    for tick, found in enumerate(smooth):
        if tick % 5 == 0:
            expected = [old + 10 / 30 * (new - old) for old, new in zip(expected, joints[tick], strict=True)]
        assert found == pytest.approx(expected)
    assert any(abs(number) > 0.01 for number in smooth[-1])


def test_wear_is_the_way_of_the_wheels(tmp_path: Path) -> None:
    slots, marks = histories(tmp_path, "service.py", 100, ("rover01",))
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


def test_bases_go_round_and_turn(tmp_path: Path) -> None:
    slots, _ = histories(tmp_path, "omni.py", 2000, (*RADII,))
    for name in RADII:
        xs, ys, _ = zip(*slots[f"{name} position"], strict=True)
        assert min(max(xs) - min(xs), max(ys) - min(ys)) > 3.5 and max(map(abs, (*xs, *ys))) < 2.5, name
        assert slots[f"{name} heading"][-1][0] > 1.0
        assert {number for (number,) in slots[f"{name} quarantined"]} == {0.0}
    assert least_gap(slots) > 0.5


def test_bases_that_are_sent_into_each_other_stop_before_that(tmp_path: Path) -> None:
    places = {"alpha": "-1", "beta": "1", "gamma": "0"}
    sets = [f"robots.{name}.x={x} m" for name, x in places.items()]
    sets += [f"robots.{name}.y={y} m" for name, y in zip(RADII, (0, 0, 2), strict=True)]
    slots, _ = histories(tmp_path, "omni.py", 500, (*RADII,), tuple(sets))
    assert 0.0 < least_gap(slots) < 0.1


def test_a_kit_of_ones_own_is_a_section_that_checks_places(tmp_path: Path) -> None:
    deployment, _ = planted(tmp_path, "yards.py")
    refused = run(tmp_path, REHEARSE, deployment, "--set", "scene=null", "--set", "yard={side: 3 m}", "--for", "1s")
    assert refused.returncode == 2
    assert "robots.alpha.model: starts outside of the yard's 3.0 m" in refused.stderr
    named = run(tmp_path, SUPERVISOR, "components", "model", "omni")
    assert named.returncode == 0 and "model omni, of omni:Omni" in named.stdout


def test_the_reference_has_rules_and_a_scene_that_are_valid(tmp_path: Path) -> None:
    """Those that it shows, in the guide's yard and in the warehouse."""
    page = (ROOT / "docs" / "reference" / "deployment.md").read_text()
    section = page[page.index("## Kits, rules, scene") : page.index("## Components of robots")]
    of_world, of_robot = re.findall(r"(?:^    .*\n)+", section, re.MULTILINE)
    yard, _ = planted(tmp_path, "omni.py")
    files = examples()
    for name in ("laps.py", "service.py"):
        (tmp_path / name).write_text(files[name])
    text = re.sub(r"scene: .*\n", dedent(of_world), files["yard.yaml"])
    Path(yard).write_text(text)
    sets = [f"robots.rover01.rules={json.dumps(safe_load(of_robot)['robots']['rover01']['rules'])}"]
    for deployment, more in ((yard, []), (str(ROOT / "deploy" / "warehouse.yaml"), sets)):
        arguments = [word for setting in more for word in ("--set", setting)]
        done = run(tmp_path, REHEARSE, deployment, *arguments, "--for", "100ms", "--json")
        assert done.returncode == 0, done.stderr
        assert ("laps" in json.loads(done.stdout)) == (deployment == yard)


def test_versions_of_what_is_not_foosims_follow_its_source(tmp_path: Path) -> None:
    """Nodes compare them, and captures have them."""
    code = """
import json
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.world.assembly.used_forms import foreign_versions
text = open(FILE).read()
print(json.dumps(foreign_versions(load_deployment(apply_sets(text, FILE, SETS), FILE))))
"""
    use = USES["laps.py"]
    code = f"FILE, SETS = {str(ROOT / use.deployment)!r}, {use.sets!r}\n" + code
    seen = []
    for source in (examples()["laps.py"], examples()["laps.py"] + "# changed\n"):
        (tmp_path / "laps.py").write_text(source)
        done = run(tmp_path, code)
        assert done.returncode == 0, done.stderr
        (version,) = json.loads(done.stdout).items()
        seen.append(version)
    assert [name for name, _ in seen] == ["rule laps:Laps"] * 2 and seen[0][1] != seen[1][1]
