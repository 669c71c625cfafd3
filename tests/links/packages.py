"""A package with link models of its own, as pip leaves one in a folder: a module, and the metadata beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Final

MODULE: Final = '''
from math import sqrt

from foosim.common.keyed_random import chance_threshold, unit_interval
from foosim.vhub.network.custom_models import Judged


class Fog:
    """Loses packets by their way, and holds up every nth that gets through."""

    def __init__(self, parameters):
        unknown = parameters.keys() - {"lost_per_m", "every", "late_ns"}
        if unknown:
            raise ValueError(f"unknown {', '.join(sorted(unknown))}")
        self.lost_per_m = float(parameters.get("lost_per_m", 0.0))
        self.every, self.late_ns = int(parameters.get("every", 0)), int(parameters.get("late_ns", 0))

    def judge(self, passage, memory):
        seen = {"passed": 0, "lost": 0} if memory is None else memory
        chance = min(1.0, self.lost_per_m * passage.distance_m)
        if passage.words[0] < chance_threshold(chance):
            return Judged(True, 0, {**seen, "lost": seen["lost"] + 1})
        passed = seen["passed"] + 1
        late = self.every and passed % self.every == 0
        return Judged(False, self.late_ns if late else 0, {**seen, "passed": passed})


class Probe:
    """Answers by what it is told to: everything that a model may get wrong, and what it is given."""

    seen = []

    def __init__(self, parameters):
        self.answer = parameters.get("answer", "fine")

    def judge(self, passage, memory):
        Probe.seen.append((passage, memory))
        answers = {
            "fine": lambda: Judged(False, 0, {"number": passage.sequence, "list": (1, 2.5, None, "text", True)}),
            "raises": lambda: {}["nothing"],
            "none": lambda: None,
            "early": lambda: Judged(False, -1),
            "never": lambda: Judged(False, 10**20),
            "float": lambda: Judged(False, float("nan")),
            "word": lambda: Judged("yes"),
            "set": lambda: Judged(False, 0, {1, 2}),
            "keys": lambda: Judged(False, 0, {1: 2}),
            "infinite": lambda: Judged(False, 0, [float("inf")]),
            "huge": lambda: Judged(False, 0, 2**70),
            "long": lambda: Judged(False, 0, "x" * 5000),
            "object": lambda: Judged(False, 0, self),
        }
        return answers[self.answer if passage.sequence >= 3 else "fine"]()


def shapeless(parameters):
    return object()
'''


def install(folder: Path, version: str = "1.2", name: str = "foggy", models: str = "fog = foggy:Fog") -> Path:
    """Make a package in a folder, which is then to be on the path; return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "foggy.py").write_text(MODULE)
    about = folder / f"{name}-{version}.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    (about / "entry_points.txt").write_text(f"[foosim.link_models]\n{models}\n")
    return folder


ALL: Final = """
fog = foggy:Fog
probe = foggy:Probe
shapeless = foggy:shapeless
broken = foggy:nothing
lost = gone:Model
"""
"""Its models, and entry points that lead nowhere."""
