"""The arithmetic fingerprint: the same on every call, another one when any function gives another last bit."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest

from foosim.protocol import fingerprint


def fresh() -> bytes:
    return fingerprint.library_fingerprint.__wrapped__()


def test_it_is_a_digest_that_does_not_change() -> None:
    assert len(fingerprint.library_fingerprint()) == 32
    assert fresh() == fresh() == fingerprint.library_fingerprint()


def test_another_process_of_this_machine_has_the_same() -> None:
    code = "from foosim.protocol.fingerprint import library_fingerprint as f; print(f().hex())"
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert other.stdout.strip() == fingerprint.library_fingerprint().hex()


@pytest.mark.parametrize("name", ["sin", "cos", "exp", "log", "atan2", "hypot"])
def test_one_last_bit_in_4096_points_changes_it(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    right = getattr(math, name)
    calls = []

    def nearly(*arguments: float) -> float:
        calls.append(arguments)
        value: float = right(*arguments)
        return math.nextafter(value, math.inf) if len(calls) == 2048 else value

    monkeypatch.setattr(math, name, nearly)
    assert fresh() != fingerprint.library_fingerprint()
    assert len(calls) == 4096


@pytest.mark.parametrize("name", ["sin", "cos", "exp", "log", "sqrt", "arctan2", "hypot"])
def test_one_last_bit_of_numpy_changes_it(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    right = getattr(np, name)

    def nearly(*arguments: object) -> np.ndarray:
        values: np.ndarray = right(*arguments)
        values[2048] = np.nextafter(values[2048], np.inf)
        return values

    monkeypatch.setattr(np, name, nearly)
    assert fresh() != fingerprint.library_fingerprint()
