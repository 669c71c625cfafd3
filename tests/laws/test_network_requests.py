"""Laws 3 and 5 of what is asked of the network: whoever is lost meanwhile, it happens at the tick of its answer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.capture.rows import EPOCHS, RECOVERIES
from foosim.common.json_text import encode_json
from foosim.simulation.journals import ENDINGS, Ending
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings, System
from foosim.simulation.verify import verify_capture
from foosim.vhub.state.records import Closing
from foosim.world.edits import Disrupt
from tests.deployed import DEPLOYMENT, TABLE, TEXT
from tests.frames import rows_of

TICKS: Final = 160
SETS: Final = (
    *("engine=pure", "table.rules.kickoff_delay=20 ms"),
    "network.links=[{id: lan, between: ['*', '*'], delay: 1 ms, jitter: {shape: gamma, sd: 2 ms}, loss: 2 %}]",
)
EVENTS: Final[Sequence[tuple[int, dict[str, Any]]]] = (
    (20, {"partition": [["player-red"], ["rest"]], "for": "20 ms"}),
    (40, {"clog": {"from": "camera", "to": "player-*"}}),
    (50, {"set": {"link": "lan", "loss": "30 %", "order": "free"}}),
    (70, {"heal": "clogs"}),
    (80, {"clog": {"from": ["player-*", "*.goal"], "to": "*"}, "for": {"exponential": "60 ms"}}),
    (100, {"partition": [["*.goal"], ["player-blue"]], "symmetric": False}),
    (110, {"heal": "all"}),
)
"""What is asked for, when which frame is committed."""
Fault = Callable[[System], None]


def lose_hub(ending: Ending) -> Fault:
    return lambda system: system.kill_hub(ending)


def lose_supervisor(system: System) -> None:
    if "supervisor" in system.processes:
        system.kill("supervisor")
        system.later(5_000_000, lambda: system.start("supervisor"))


def fly(
    prepare: Callable[[System], None], nodes: int = 2, capture: Path | None = None
) -> tuple[list[Any], dict[str, Any]]:
    """Rehearse; return the rows, and the tick of each answer by request."""
    closings: list[Closing] = []
    text = TEXT
    told = Settings(on_closing=closings.append, keeps_journals=True)
    run = rehearse(text, TABLE.name, TICKS, nodes, SETS, told, prepare=prepare, capture=capture)
    assert run.json["reason"] == "done"
    assert all(answer.accepted for answer in run.answers.values()), run.answers
    ticks = {identity: answer.tick for identity, answer in run.answers.items()}
    return rows_of(closings, DEPLOYMENT, RECOVERIES, EPOCHS), ticks


def asking(faults: Sequence[tuple[int, Fault]], asked: list[str]) -> Callable[[System], None]:
    def prepare(system: System) -> None:
        def ask(event: dict[str, Any]) -> None:
            asked.append(system.request("network", again_ns=3_000_000, event=event))

        for tick, event in EVENTS:
            system.at_tick(tick, partial(ask, event))
        for tick, fault in faults:
            system.at_tick(tick, partial(fault, system))

    return prepare


def ordering(ticks: Sequence[int]) -> Callable[[System], None]:
    """Order the same events for known ticks from the start."""

    def order(system: System) -> None:
        for tick, (_, event) in zip(ticks, EVENTS, strict=True):
            system.supervisor.state.order(tick - 1, [Disrupt(encode_json(event).decode())])

    return lambda system: system.at_tick(1, lambda: order(system))


def assert_same(faults: Sequence[tuple[int, Fault]], nodes: int = 2) -> None:
    asked: list[str] = []
    rows, answers = fly(asking(faults, asked), nodes)
    assert len(asked) == len(EVENTS)
    usual, _ = fly(ordering([answers[identity] for identity in asked]), 1)
    assert rows == usual
    causes = {fields["cause"] for topic, _, _, fields in rows if topic == "/packets"}
    assert {"partition", "random_loss"} <= causes
    assert any(fields["held_ns"] > 0 for topic, _, _, fields in rows if topic == "/packets")


FAULTS = st.one_of(st.just(lose_supervisor), st.builds(lose_hub, st.sampled_from(ENDINGS)))


@pytest.mark.parametrize("fault", [lose_supervisor, lose_hub("now")], ids=["supervisor", "vhub"])
def test_a_process_lost_at_a_request_changes_no_event(fault: Fault) -> None:
    assert_same([(tick, fault) for tick in (21, 52, 71, 101)])


@settings(max_examples=4)
@given(faults=st.lists(st.tuples(st.integers(2, 130), FAULTS), min_size=1, max_size=5), nodes=st.integers(1, 3))
def test_losses_at_any_tick_change_nothing(faults: Sequence[tuple[int, Fault]], nodes: int) -> None:
    assert_same(faults, nodes)


def test_a_re_simulation_has_the_requested_events(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    fly(asking([], []), capture=path)
    assert verify_capture(path, nodes=3).equal
