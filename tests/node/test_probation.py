"""Meshes on trial: what fails in the throw-away process fails there alone, and is told with the file's name."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Final

import pytest

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.node.physics import mesh_trial
from foosim.node.physics.mesh_trial import check_models
from foosim.world.matter.mesh import AssetError

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
SHARD: Final = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n"
THINGS: Final = (
    "{a: {shape: mesh, file: a.obj, scale: 0.02, surface: walls}, z: {shape: mesh, file: z.obj, surface: walls}, "
    "block: {shape: box, x: 1 m, length: 1 cm, width: 2 cm, height: 3 cm, surface: goal}}"
)
TEXT: Final = apply_sets(TABLE.read_text(), "t", [f"scenery={THINGS}"])
FILES: Final = {"a.obj": SHARD, "z.obj": SHARD + b"v 9 9 9\n"}


def deployment() -> Deployment:
    return load_deployment(TEXT, "t").with_assets(FILES)


def broken(statements: str) -> list[str]:
    """A throw-away process in which building the world with the mesh of `z` alone does something else."""
    program = f"""if True:
        import ctypes, os, resource, sys, time
        from foosim.node.physics import mesh_trial
        real = mesh_trial._try
        def tried(deployment):
            if "z" in deployment.scenery:
                {statements}
            real(deployment)
        mesh_trial._try = tried
        mesh_trial.main()
    """
    return [sys.executable, "-c", program]


def test_good_meshes_pass() -> None:
    check_models(deployment(), "t", TEXT)


def test_without_meshes_there_is_no_trial() -> None:
    plain = load_deployment(TABLE.read_text(), "t")
    check_models(plain, "t", TABLE.read_text(), ["/absent"])


@pytest.mark.parametrize(
    ("statements", "reason"),
    [
        ("ctypes.string_at(0)", "the process was ended by SIGSEGV"),
        ("resource.setrlimit(resource.RLIMIT_CPU, (1, -1)) or [None for _ in iter(int, 1)]", "5 s of processor time"),
        ("bytearray(1 << 30)", "MemoryError"),
        ("os.open('/etc/passwd', os.O_RDONLY)", "the process ended with 1"),
    ],
)
def test_a_mesh_that_fails_is_named_with_the_reason(statements: str, reason: str) -> None:
    with pytest.raises(AssetError) as refusal:
        check_models(deployment(), "t", TEXT, broken(statements))
    assert str(refusal.value).startswith("z.obj: scenery.z failed its trial with the engine bullet: ")
    assert reason in str(refusal.value)


def test_a_trial_that_never_ends_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mesh_trial, "WALL_S", 0.1)
    with pytest.raises(AssetError, match=r"^t: its scenery failed its trial .* or 0\.1 s$"):
        check_models(deployment(), "t", TEXT, [sys.executable, "-c", "import time; time.sleep(1000)"])
