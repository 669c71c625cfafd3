"""Links as pages show them: windows of totals, ends in the scene, and what stands between antennas."""

from collections.abc import Callable
from typing import Any

from foosim.console.recorded.link_history import LinkHistory, PacketMark
from foosim.console.shown.drawing import Drawing
from foosim.console.shown.links import Count, Links, Windows
from foosim.console.shown.rule_text import RuleTexts
from foosim.deployment.loader import load_deployment
from foosim.world.assembly.initial_state import initial_frame

KEY = ("a", "b", "rule")


def test_the_rule_of_a_link_is_told_in_words(fleet_text: Callable[..., str]) -> None:
    deployment = load_deployment(fleet_text(2), "hall")
    rule, radio, meaning = RuleTexts(deployment).text("pilot01", "pilot02").splitlines()
    assert rule.startswith("rule fleet, from pilot*, dispatch to ") and " via wifi: " in rule
    assert radio.startswith("radio wifi: preset wifi_") and "tx_power" in radio
    assert meaning.startswith("which is fleet via wifi: wifi, loss ")
    assert RuleTexts(deployment).text("pilot01", "nobody") == ""
    perfect, meaning = RuleTexts(deployment).text("rover01", "pilot01").splitlines()
    assert "perfect" in perfect and meaning == "which is on_board: no medium, loss 0, delay 0"


def test_a_rule_says_what_is_in_force_what_was_changed_by_whom_and_what_that_amounts_to(
    fleet_text: Callable[..., str],
) -> None:
    events = "network.events=[{at: 1 s, set: {link: fleet, delay: 50 ms}}]"
    deployment = load_deployment(fleet_text(2, events), "hall")
    tick_ns = deployment.tick_ns
    asked = [
        (2_000_000_000 // tick_ns, '{"set": {"link": "fleet", "loss": "30 %"}}'),
        (2_500_000_000 // tick_ns, '{"partition": [["pilot01"], ["pilot02"]], "for": "1 s"}'),
        (4_000_000_000 // tick_ns, '{"heal": "all"}'),
    ]
    texts, who = RuleTexts(deployment), {asked[0][0]: "browser 3"}

    def changes(at_s: float, events: list[tuple[int, str]] = asked) -> list[str]:
        lines = texts.text("pilot01", "pilot02", int(at_s * 1e9), events, who).splitlines()
        assert lines[0].startswith("rule fleet, ") and lines[1].startswith("radio wifi: ")
        return [line for line in lines[2:] if not line.startswith("which is ")]

    base, tick = RuleTexts(deployment).text("pilot01", "pilot02"), {at: at * 1_000_000_000 // tick_ns for at in (1, 2)}
    planned = f"changed: delay 50 ms, since 1 s (tick {tick[1]}), by the deployment"
    by_plan = f"{planned} until 4 s"
    by_hand = f"changed: loss 30 %, since 2 s (tick {tick[2]}), requested by browser 3 until 4 s"
    assert changes(0.5) == changes(4.5) == [] and changes(1.5) == [by_plan]
    cut = f"cut by a partition: nothing passes, since 2.5 s (tick {asked[1][0]}), requested until 3.5 s"
    assert changes(2.2) == [by_plan, by_hand] and changes(3.2) == [by_plan, by_hand, cut]
    assert changes(2.2, []) == [planned]
    meaning = texts.text("pilot01", "pilot02", 2_200_000_000, asked, who).splitlines()[-1]
    assert meaning != base.splitlines()[-1] and "50" in meaning, "what it amounts to counts the changes"


def count(offered: int, dropped: int, delay_ns: int = 0, **causes: int) -> Count:
    return Count(offered, offered - dropped, dropped, delay_ns, causes)


def test_a_window_is_what_was_counted_in_the_last_seconds() -> None:
    windows = Windows(5.0)
    assert windows.take(0.0, {KEY: count(10, 1, 90, snr=1)})[KEY] == count(10, 1, 90, snr=1)
    assert windows.take(3.0, {KEY: count(20, 1, 290, snr=1)})[KEY] == count(10, 0, 200)
    assert windows.take(6.0, {KEY: count(30, 5, 300, snr=1, blocked=4)})[KEY] == count(20, 4, 210, blocked=4)
    # What was counted at 3 s is as old as the window: it begins there.
    assert windows.take(8.0, {KEY: count(31, 5, 300, snr=1, blocked=4)})[KEY] == count(11, 4, 10, blocked=4)


def test_what_was_counted_while_nobody_looked_is_in_no_window() -> None:
    windows = Windows(5.0)
    assert windows.take(60.0, {KEY: count(600, 60, snr=60)})[KEY] == count(0, 0) and windows.length_s == 0.0
    assert windows.take(61.0, {KEY: count(610, 61, snr=61)})[KEY] == count(10, 1, snr=1) and windows.length_s == 1.0
    assert windows.take(90.0, {KEY: count(900, 90, snr=90)})[KEY] == count(0, 0)
    assert windows.take(92.0, {KEY: count(920, 90, snr=90)})[KEY] == count(20, 0) and windows.length_s == 2.0


def test_a_link_that_was_not_told_before_begins_with_its_first_count() -> None:
    """Of many links the busiest are told: one that comes among them has not done all in this window."""
    windows, other = Windows(5.0), ("b", "c", "rule")
    windows.take(60.0, {KEY: count(600, 60)}, are_all=False)
    assert windows.take(61.0, {KEY: count(610, 60), other: count(700, 70)}, are_all=False)[other] == count(0, 0)
    assert windows.take(62.0, {KEY: count(610, 60), other: count(705, 71)}, are_all=False)[other] == count(5, 1)
    windows.take(63.0, {KEY: count(610, 60), other: count(705, 71)})
    new = ("c", "d", "rule")
    for at_s in (70.0, 71.0):
        found = windows.take(at_s, {KEY: count(610, 60), **({new: count(4, 0)} if at_s > 70.0 else {})})
    assert found[new] == count(4, 0), "all were told: it is new"


def test_what_happened_since_the_count_before_is_told_once_however_long_the_run_is_paused() -> None:
    windows, other = Windows(5.0), ("b", "c", "rule")
    windows.take(1.0, {KEY: count(10, 1, snr=1)})
    assert windows.latest == {KEY: count(10, 1, snr=1)}, "the window's: nobody counted before"
    once, nothing = {KEY: count(10, 2, snr=2), other: count(2, 1, snr=1)}, {KEY: count(0, 0), other: count(0, 0)}
    told = []
    for _ in range(3):
        assert windows.take(2.0, {KEY: count(20, 3, snr=3), other: count(2, 1, snr=1)}) == once, "in the window"
        told.append(windows.latest)
    assert told == [once, nothing, nothing]
    windows.take(3.0, {KEY: count(25, 4, snr=3, blocked=1)})
    assert windows.latest == {KEY: count(5, 1, blocked=1)}


def status(ticks: int, *rows: list[Any]) -> dict[str, Any]:
    return {"ticks": ticks, "tick_ns": 10_000_000, "links": list(rows), "links_in_all": len(rows)}


def test_radio_links_have_ends_and_the_walls_that_they_cross(fleet_text: Callable[..., str]) -> None:
    places = ("robots.rover01.x=-2 m", "robots.rover01.y=0 m", "robots.rover02.x=2 m", "robots.rover02.y=0 m")
    size = "length: 20 cm, width: 4 m, height: 3 m"
    wall = f"scenery.wall={{shape: box, x: 0 m, y: 0 m, z: 1.5 m, {size}, radio: {{loss: 9 dB}}}}"
    deployment = load_deployment(fleet_text(2, *places, wall), "hall")
    drawing = Drawing(deployment)
    links = Links(deployment, drawing.entities)
    links.move(initial_frame(deployment))
    row = ["pilot01", "pilot02", 10, 6, 4, 2_000_000, "fleet/wifi", 0, {"snr": 3, "queue_full": 1}, []]
    message = links.message({**status(100, row), "links_in_all": 300})
    assert message["in_all"] == 300
    (line,) = message["links"]
    assert (line["radio"], line["loss"], line["delay_ms"]) == (True, 0.4, 2.0)
    history = LinkHistory(10_000_000)
    mark = PacketMark("pilot01", 0, "pilot02", 0, 5, 1, "delivered", "", "fleet", "wifi")
    history.add(mark, 0)
    (captured,) = links.with_ends(history.windows(10_000_000, 10_000_000))
    same = "from", "to", "rule", "radio", "from_link", "to_link", "walls", "from_at", "to_at"
    assert {name: captured[name] for name in same} == {name: line[name] for name in same}
    names = [link.name for body in drawing.scene.bodies.values() for link in body.links]
    assert [names[line[end]] for end in ("from_link", "to_link")] == ["rover01", "rover02"]
    assert [0.0, 0.0] in [[round(x, 1), round(y, 1)] for x, y, _ in line["walls"]]
    assert {(drop["cause"], drop["where"], drop["count"]) for drop in message["drops"]} == {
        ("snr", "receiver", 3),
        ("queue_full", "sender", 1),
    }
    assert links.message({**status(100, row), "links_in_all": 300})["drops"] == [], "told already"
