"""What is asked of the network of a running system: what is refused and why, what is answered, what status shows."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import pytest

from foosim.common.json_text import decode_json
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.network.rules import EVENTS_MAX, event_of
from foosim.deployment.network.settings_text import event_words
from foosim.deployment.validate_network import BadEvent, event_text
from foosim.protocol.messages import Answer
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings, System
from foosim.vhub.state.records import Closing

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
LINK: Final = "network.links=[{id: lan, between: ['*', '*'], delay: 1 ms}]"
SETS: Final = ("engine=pure", LINK)
DEPLOYMENT: Final = load_deployment(apply_sets(TABLE.read_text(), TABLE.name, SETS), TABLE.name)
SECOND_NS: Final = 10**9


@pytest.mark.parametrize(
    ("event", "problems"),
    [
        ([], ["not an event, which is a mapping, a list of 0"]),
        ({}, ["missing key: one of partition, clog, set, heal, 'heal'"]),
        ({"heal": "al"}, ["heal: not one of all, partitions, clogs, settings, 'al', nearest is 'all'"]),
        ({"heal": "all", "at": "3 s"}, ["a requested event happens at the next tick and has no time, 'at'"]),
        ({"heal": "all", "for": "3 s"}, ["heal happens at once, 'for'"]),
        ({"partition": [["player-rde"], ["rest"]]}, [
            "partition[0][0]: a selector that matches no endpoint, 'player-rde', nearest is 'player-red'",
        ]),
        ({"clog": {"from": "camera", "to": "*"}, "for": "2"}, [
            "for: not a time (a number and one of ns, us, ms, s, min, h), '2'"
        ]),
        ({"clog": {"from": "camera", "to": "*"}, "until": "900 ms"}, [
            "until: not after the present simulated time, 1 s, '900 ms'"
        ]),
        ({"clog": {"form": "camera", "to": "*"}}, [
            "clog: missing key, 'from'", "clog: unknown key, 'form', nearest is 'from'"
        ]),
        ({"set": {"link": "lam", "loss": "5 %"}}, ["set.link: unknown link rule, 'lam', nearest is 'lan'"]),
        ({"set": {"link": "lan", "loss": "5"}}, ["set.loss: not a probability"]),
        ({"heal": "all", "clog": {"from": "camera", "to": "*"}}, ["beside clog: an event does one thing, 'heal'"]),
    ],
)  # fmt: skip
def test_a_bad_event_is_refused_with_path_value_and_nearest_name(event: Any, problems: list[str]) -> None:
    with pytest.raises(BadEvent) as refused:
        event_text(DEPLOYMENT, event, SECOND_NS)
    for problem in problems:
        assert problem in str(refused.value)


@pytest.mark.parametrize(
    ("event", "text"),
    [
        ({"partition": [["player-red"], ["rest"]]}, "partition player-red | rest"),
        ({"partition": [["*.goal", "camera"], ["player-*"]], "symmetric": False, "until": "3 s"},
         "partition *.goal, camera | player-*, one way, until 3 s"),
        ({"clog": {"from": "*", "to": "camera"}, "for": {"exponential": "2 s"}},
         "clog from * to camera, for 2 s on average"),
        ({"set": {"link": "lan", "loss": "5 %", "delay": "3 ms"}}, "set lan: delay 3 ms, loss 5 %"),
        ({"heal": "all"}, "heal all"),
    ],
)  # fmt: skip
def test_an_event_is_described_in_words(event: Any, text: str) -> None:
    assert event_words(event_of(event_text(DEPLOYMENT, event, SECOND_NS), SECOND_NS)) == text


def test_it_happens_to_what_is_sent_from_the_tick_of_the_answer_on() -> None:
    closings: list[Closing] = []
    statuses: list[Any] = []
    asked: list[str] = []

    def prepare(system: System) -> None:
        def ask(**event: Any) -> None:
            asked.append(system.request("network", event=event))

        system.at_tick(20, lambda: ask(partition=[["camera"], ["player-*"]]))
        system.at_tick(40, lambda: ask(partition=[["camra"], ["player-*"]]))
        system.at_tick(60, lambda: ask(heal="all"))
        system.at_tick(80, lambda: statuses.append(system.request("status")))

    rehearsed = rehearse(
        TABLE.read_text(), TABLE.name, 100, 1, SETS, Settings(on_closing=closings.append), prepare=prepare
    )
    cut, refused, healed = (rehearsed.answers[identity] for identity in asked)
    assert cut.text == f"partition camera | player-*, from tick {cut.tick} on"
    assert healed.text == f"heal all, at tick {healed.tick}"
    assert not refused.accepted and "nearest is 'camera'" in refused.text
    lost = {f.sent_ns // 2_000_000 for c in closings for f in c.fates if f.cause == "partition" and f.arrival_tick < 0}
    sensed = {f.sent_ns // 2_000_000 for c in closings for f in c.fates if f.source == "camera"}
    assert lost == {tick for tick in sensed if cut.tick <= tick < healed.tick}
    assert [c.frame.tick for c in closings if c.edits] == [cut.tick, healed.tick], "edits led to these frames"
    status = decode_json(_answer(rehearsed.answers, statuses).result)
    assert isinstance(status, dict)
    assert status["disruptions"] == {
        "count": 2,
        "last": [
            {"tick": cut.tick, "event": {"partition": [["camera"], ["player-*"]]}},
            {"tick": healed.tick, "event": {"heal": "all"}},
        ],
    }


def _answer(answers: dict[str, Answer], asked: list[Any]) -> Answer:
    return answers[asked[0]]


def test_there_are_so_many_events_and_no_more() -> None:
    refused: list[str] = []

    def prepare(system: System) -> None:
        def ask() -> None:
            system.supervisor.state.disruptions = EVENTS_MAX
            refused.append(system.request("network", event={"heal": "all"}))

        system.at_tick(10, ask)

    rehearsed = rehearse(TABLE.read_text(), TABLE.name, 30, 1, SETS, prepare=prepare)
    assert _answer(rehearsed.answers, refused).text == f"{EVENTS_MAX} events were requested already"
