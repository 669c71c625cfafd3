"""What commands import: a start pays for what it uses."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TABLE = str(ROOT / "deploy" / "table.yaml")
RUN = """
import sys
from foosim.cli import main
sys.argv = sys.argv[1:]
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
print(*sys.modules, file=sys.stderr)
"""
HEAVY = {
    *("numpy", "pybullet", "mujoco", "zenoh", "cryptography", "mcap", "rich", "yaml", "ssl"),
    "foosim.deployment.schema",
}


@pytest.mark.parametrize(
    ("words", "needed"),
    [
        (["--help"], set()),
        (["up", "--help"], set()),
        (["check", TABLE], {"yaml", "foosim.deployment.schema"}),
    ],
)
def test_a_command_imports_what_it_needs(words: list[str], needed: set[str]) -> None:
    done = subprocess.run(
        [sys.executable, "-c", RUN, "foosim", *words],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": ""},
    )
    assert HEAVY & set(done.stderr.split()) == needed


@pytest.mark.parametrize(
    ("module", "spared"),
    [
        ("foosim.launcher.begin", {"numpy", "pybullet", "cryptography", "foosim.vhub.recording.recovery"}),
        ("foosim.client.main", {"numpy", "pybullet", "cryptography", "mcap"}),
        ("foosim.supervisor.main", {"pybullet", "google.protobuf"}),
        ("foosim.node.main", {"mcap", "google.protobuf"}),
    ],
)
def test_a_process_imports_what_its_roles_need(module: str, spared: set[str]) -> None:
    code = f"import sys, {module}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not spared & set(done.stdout.split())
