"""The supervisor's journal: a fold of its records gives the run, from the start of any of its files."""

from functools import partial
from pathlib import Path
from typing import Any

import pytest

from foosim.common.units import Pace
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.protocol.codec import decode
from foosim.protocol.fingerprint import library_fingerprint
from foosim.protocol.messages import Epoch
from foosim.simulation.system import Settings, System
from foosim.supervisor.core import SupervisorCore
from foosim.supervisor.records import History, fold
from foosim.supervisor.settings import RunSettings
from foosim.world.edits import Push

TEXT = apply_sets(
    (Path(__file__).parent.parent.parent / "deploy" / "table.yaml").read_text(),
    "table.yaml",
    ["engine=pure", "players={}", "table.spare_balls=1"],
)
DEPLOYMENT = load_deployment(TEXT, "table.yaml")
TICKS = 60


class Watched(System):
    """A rehearsal that asks, each time the supervisor has done all it had to, for the head of a further file."""

    def __init__(self) -> None:
        self.records: list[bytes] = []
        self.heads: dict[int, bytes] = {}
        """By the number of records before it."""
        settings = Settings(on_journal=self._note)
        self.settings_of_run = RunSettings("run", "table.yaml", TEXT, Pace("fast"), TICKS)
        super().__init__(self.settings_of_run, settings)

    def _note(self, process: str, record: bytes) -> None:
        if process == "supervisor":
            self.records.append(record)

    def _perform(self, process: Any) -> None:
        super()._perform(process)
        if process.core is self.supervisor and self.records:
            self.heads[len(self.records)] = self.supervisor.state.checkpoint()


def ask(system: System, verb: str, arguments: dict[str, Any]) -> None:
    """Ask the supervisor for something."""
    system.request(verb, **arguments)


@pytest.fixture(scope="module")
def watched() -> Watched:
    """A run in which everything was asked for that changes the world or who computes it."""
    system = Watched()
    asked: dict[int, tuple[str, dict[str, Any]]] = {
        10: ("push", {"impulse": [0.02, 0.0, 0.0]}),
        12: ("add", {"name": "ball", "at": "0.1,0.1,0.0175"}),
        20: ("move", {"robot": "red.goal", "node": "blue"}),
        30: ("push", {"name": "ball-2", "impulse": [0.0, 0.02, 0.0]}),
        40: ("remove", {"name": "ball-2"}),
        50: ("stop", {"node": "red"}),
        51: ("start", {"node": "red"}),
        52: ("stop", {"node": "red"}),
    }
    for tick, (verb, arguments) in asked.items():
        system.at_tick(tick, partial(ask, system, verb, arguments))
    system.run()
    system.close()
    assert [answer.accepted for answer in system.answers.values()] == [True] * len(asked)
    return system


def content(history: History) -> tuple[object, ...]:
    """Everything in a history, in a form that compares."""
    kept, frame = history
    told = kept.epoch, kept.edits, kept.answers, kept.control, kept.owners
    return kept.run, frame.tick, frame.digest, frame.layout.names, *told


def test_a_fold_of_all_records_gives_the_last_commit_and_every_answer(watched: Watched) -> None:
    kept, frame = history = fold(DEPLOYMENT, watched.records)
    assert (frame.tick, frame.digest) == (TICKS, watched.supervisor.state.frame.digest)
    epoch = decode(Epoch, kept.epoch)
    assert (epoch.epoch, set(dict(epoch.owners).values())) == (3, {"blue"})
    assert {answer.id: answer for answer in kept.answers} == watched.answers
    assert kept.run.deployment == TEXT
    again = SupervisorCore(watched.settings_of_run, library_fingerprint(), 0, "another", history=history)
    assert again.state.control() == watched.supervisor.state.control() == kept.control
    assert (kept.control.stopped, kept.control.starts) == (["red"], {"red": 1})


def test_a_request_is_in_the_journal_before_the_tick_at_which_it_takes_effect(watched: Watched) -> None:
    pushed, moved = watched.answers["request-1"], watched.answers["request-3"]
    folds = (fold(DEPLOYMENT, watched.records[:count]) for count in range(1, len(watched.records)))
    kept, frame = next(history for history in folds if pushed in history.kept.answers)
    assert frame.tick <= pushed.tick
    assert [edit.name for edit in kept.edits[pushed.tick] if isinstance(edit, Push)] == ["ball"]
    kept = next(history.kept for history in folds if moved in history.kept.answers)
    assert kept.owners["red.goal"] == "blue" != dict(decode(Epoch, kept.epoch).owners)["red.goal"]


def test_a_further_file_says_what_the_ones_before_said(watched: Watched) -> None:
    """At every place where a file may begin, and after every record that follows it there."""
    assert len(watched.heads) > TICKS // 2
    for before, head in watched.heads.items():
        for after in {before, min(before + 7, len(watched.records)), len(watched.records)}:
            whole = fold(DEPLOYMENT, watched.records[:after])
            assert content(fold(DEPLOYMENT, [head, *watched.records[before:after]])) == content(whole), (before, after)
