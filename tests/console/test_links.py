"""Links as pages show them: windows of totals, ends in the scene, and what stands between antennas."""

from collections.abc import Callable
from typing import Any

from foosim.console.drawing import Drawing
from foosim.console.links import Count, Links, Windows
from foosim.protocol.deployment_file import load_deployment
from foosim.protocol.layout import build_layout
from foosim.protocol.start import initial_frame

KEY = ("a", "b", "rule")


def count(offered: int, dropped: int, delay_ns: int = 0, **causes: int) -> Count:
    return Count(offered, offered - dropped, dropped, delay_ns, causes)


def test_a_window_is_what_was_counted_in_the_last_seconds() -> None:
    windows = Windows(5.0)
    assert windows.take(0.0, {KEY: count(10, 1, 90, snr=1)})[KEY] == count(10, 1, 90, snr=1)
    assert windows.take(3.0, {KEY: count(20, 1, 290, snr=1)})[KEY] == count(10, 0, 200)
    assert windows.take(6.0, {KEY: count(30, 5, 300, snr=1, blocked=4)})[KEY] == count(20, 4, 210, blocked=4)
    # What was counted at 3 s is as old as the window: it begins there.
    assert windows.take(8.0, {KEY: count(31, 5, 300, snr=1, blocked=4)})[KEY] == count(11, 4, 10, blocked=4)


def test_a_link_that_counts_anew_and_time_that_goes_back_begin_a_window() -> None:
    windows = Windows(5.0)
    windows.take(1.0, {KEY: count(10, 0)})
    assert windows.take(2.0, {KEY: count(3, 0)})[KEY] == count(3, 0)
    assert windows.take(0.5, {KEY: count(12, 1, snr=1)})[KEY] == count(12, 1, snr=1)


def status(ticks: int, *rows: list[Any]) -> dict[str, Any]:
    return {"ticks": ticks, "tick_ns": 10_000_000, "links": list(rows)}


def test_radio_links_have_ends_and_the_walls_that_they_cross(fleet_text: Callable[..., str]) -> None:
    places = ("robots.rover01.x=-2 m", "robots.rover01.y=0 m", "robots.rover02.x=2 m", "robots.rover02.y=0 m")
    size = "length: 20 cm, width: 4 m, height: 3 m"
    wall = f"scenery.wall={{shape: box, x: 0 m, y: 0 m, z: 1.5 m, {size}, radio: {{loss: 9 dB}}}}"
    deployment = load_deployment(fleet_text(2, *places, wall), "hall")
    layout = build_layout(deployment)
    drawing = Drawing(deployment, layout)
    links = Links(deployment)
    links.turn_to(drawing.scene)
    links.move(initial_frame(deployment))
    row = ["pilot01", "pilot02", 10, 6, 4, 2_000_000, "fleet/wifi", 0, {"snr": 3, "queue_full": 1}, []]
    message = links.message(status(100, row))
    (line,) = message["links"]
    assert (line["radio"], line["loss"], line["delay_ms"]) == (True, 0.4, 2.0)
    names = [link.name for body in drawing.scene.bodies.values() for link in body.links]
    assert [names[line[end]] for end in ("from_link", "to_link")] == ["rover01", "rover02"]
    assert [0.0, 0.0] in [[round(x, 1), round(y, 1)] for x, y, _ in line["walls"]]
    assert {(drop["cause"], drop["where"], drop["count"]) for drop in message["drops"]} == {
        ("snr", "receiver", 3),
        ("queue_full", "sender", 1),
    }
