"""The guide's examples of one's own: each file as it is written there, in an empty folder, with foosim as installed."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import pytest

ROOT: Final = Path(__file__).parents[2]
GUIDE: Final = ROOT / "docs" / "how-to" / "extending.md"
REHEARSE: Final = "from foosim.cli.rehearse import main; main()"
SETTINGS: Final[Mapping[str, tuple[str, str]]] = {
    "currents.py": (
        "table.yaml",
        'robots.red.goal.sensors.current={kind: "currents:MotorCurrent", rate: 100 Hz, torque_per_ampere: 50 mN m}',
    ),
    "laps.py": ("warehouse.yaml", 'rules={laps: {kind: "laps:Laps"}}'),
}
"""Of each example: the deployment and the setting that use it."""


def examples() -> dict[str, str]:
    """The files that the guide has, by name."""
    return dict(re.findall(r"```python\n# (\w+\.py)\n(.*?)```", GUIDE.read_text(), re.DOTALL))


def run(folder: Path, code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    command = [sys.executable, "-P", "-c", code, *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def test_the_guide_says_how_each_is_used() -> None:
    said = " ".join(GUIDE.read_text().split())
    assert sorted(examples()) == sorted(SETTINGS)
    assert all(setting in said for _, setting in SETTINGS.values())


@pytest.mark.parametrize("name", SETTINGS)
def test_an_example_is_one_file_in_an_empty_folder(tmp_path: Path, name: str) -> None:
    """The same world on one, two and three nodes, in processes of their own."""
    (tmp_path / name).write_text(examples()[name])
    deployment, setting = SETTINGS[name]
    where = (str(ROOT / "deploy" / deployment), "--set", setting)
    results: list[Any] = []
    for nodes in ("1", "2", "3"):
        done = run(tmp_path, REHEARSE, *where, "--for", "400ms", "--nodes", nodes, "--json")
        assert done.returncode == 0, done.stderr
        results.append(json.loads(done.stdout))
    assert len({result["digest"]["chain"] for result in results}) == 1
    assert ("laps" in results[0]) == (name == "laps.py")


@pytest.mark.parametrize("name", SETTINGS)
def test_the_path_without_it_is_refused_with_its_place(tmp_path: Path, name: str) -> None:
    deployment, setting = SETTINGS[name]
    refused = run(tmp_path, REHEARSE, str(ROOT / "deploy" / deployment), "--set", setting, "--for", "1s")
    assert refused.returncode == 2
    assert "--set:1:" in refused.stderr and "cannot be imported: ModuleNotFoundError" in refused.stderr


def test_versions_of_what_is_not_foosims_follow_its_source(tmp_path: Path) -> None:
    """Nodes compare them, and captures have them."""
    code = """
import json
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.world.assembly.used_forms import foreign_versions
text = open(FILE).read()
print(json.dumps(foreign_versions(load_deployment(apply_sets(text, FILE, [SETTING]), FILE))))
"""
    deployment, setting = SETTINGS["laps.py"]
    code = f"FILE, SETTING = {str(ROOT / 'deploy' / deployment)!r}, {setting!r}\n" + code
    seen = []
    for source in (examples()["laps.py"], examples()["laps.py"] + "# changed\n"):
        (tmp_path / "laps.py").write_text(source)
        done = run(tmp_path, code)
        assert done.returncode == 0, done.stderr
        (version,) = json.loads(done.stdout).items()
        seen.append(version)
    assert [name for name, _ in seen] == ["rule laps:Laps"] * 2 and seen[0][1] != seen[1][1]
