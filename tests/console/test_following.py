"""What becomes of what a running system says: frames as moments, layouts that change, requests as marks, overlays."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable
from typing import Any

import numpy as np

from foosim.console.live.following import Following, World, readable
from foosim.console.shown.overlays import Overlays
from foosim.console.shown.source import About, Wanted
from foosim.deployment.loader import load_deployment
from foosim.protocol.codec import encode
from foosim.protocol.messages import Commit
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.frame import Frame
from foosim.world.layout import build_layout
from foosim.world.parameters.hall import hall_of
from foosim.world.sensors.proximity import ProximitySettings
from tests.console.memory import TABLE, table

BALL2 = [["ball2", "ball"]]


def commit(frame: Frame) -> bytes:
    return encode(Commit(1, frame.tick, frame.digest, frame.values.tobytes(), [], [], False))


def described(frame: Frame, added: list[list[str]], paused: bool = False) -> dict[str, Any]:
    return {
        "run": "test",
        "deployment_name": TABLE.name,
        "deployment": TABLE.read_text(),
        "added": added,
        "layout": frame.layout.digest.hex(),
        "tick": frame.tick,
        "frame": b64encode(commit(frame)).decode(),
    }


def frame_of(tick: int, *added: list[str]) -> Frame:
    layout = build_layout(table(), [(name, model) for name, model in added])
    return Frame(tick, layout, np.arange(layout.size, dtype=np.float64))


def following() -> tuple[Following, World]:
    found = Following(About("live", "test", "", 1, ()))
    what = described(frame_of(5), [])
    world = found.world_of(what, lambda deployment: {})
    assert found.turn_to(what, world)
    return found, world


def is_stale(found: Following) -> bool:
    return found.is_stale


def test_a_frame_of_another_layout_is_not_drawn_and_asks_for_the_new_one() -> None:
    found, _ = following()
    first = found.first_moment()
    assert first is not None and (first.tick, first.jump) == (5, True)
    assert found.read(commit(frame_of(7, BALL2[0]))) is None
    assert is_stale(found)
    what = described(frame_of(7, BALL2[0]), BALL2)
    assert found.turn_to(what, found.world_of(what, lambda deployment: {}))
    assert not is_stale(found)
    moment = found.first_moment()
    assert moment is not None and len(moment.poses) == 18


def test_a_frame_of_another_layout_of_the_same_size_is_not_drawn() -> None:
    found, _ = following()
    what = described(frame_of(7, BALL2[0]), BALL2)
    found.turn_to(what, found.world_of(what, lambda deployment: {}))
    assert found.read(commit(frame_of(8, BALL2[0]))) is not None
    assert found.read(commit(frame_of(9, ["ball3", "ball"]))) is None
    assert is_stale(found)


def test_the_same_world_described_again_is_no_new_scene() -> None:
    found, _ = following()
    found.first_moment()
    what = described(frame_of(9), [])
    assert not found.turn_to(what, found.world_of(what, lambda deployment: {}))
    moment = found.first_moment()
    assert moment is not None and moment.tick == 9


def test_time_that_goes_back_is_a_jump() -> None:
    found, world = following()
    found.first_moment()
    jumps = []
    for tick in (6, 7, 3, 4):
        jumps.append(found.show(world, frame_of(tick)).jump)
    assert jumps == [False, False, True, False]


def status(state: str, *requests: dict[str, Any]) -> dict[str, Any]:
    return {
        "state": state,
        "ticks": 5,
        "tick_ns": 2_000_000,
        "recoveries": [],
        "requests": list(requests),
        "links": [],
        "links_in_all": 0,
        "summary": [],
        "watched": {},
    }


def test_a_request_names_the_browser_that_asked_and_is_marked_once() -> None:
    found, world = following()
    found.first_moment()
    found.asked("operator-1-abc", 5, "pause", "browser 2")
    entry = {"tick": 5, "verb": "pause", "text": "paused at tick 5", "who": "operator-1-abc", "accepted": True}
    other = {**entry, "tick": 4, "verb": "rate", "text": "pace 2x from tick 4", "who": "operator-9-xyz"}
    messages = {message["type"]: message for message in found.take_status(status("paused", other, entry))}
    assert [entry["who"] for entry in messages["status"]["status"]["requests"]] == ["operator-9-xyz", "browser 2"]
    texts = [mark["text"] for mark in messages["marks"]["marks"]]
    assert texts == ["operator-9-xyz: pace 2x from tick 4", "browser 2: paused at tick 5"]
    standing = found.standing_moment()
    assert standing is not None and standing.paused
    assert found.standing_moment() is None
    assert found.show(world, frame_of(6)).paused, "the last frame may come behind the status"
    assert "marks" not in {message["type"] for message in found.take_status(status("paused", other, entry))}


def test_events_of_the_deployment_are_marked_when_their_time_is_reached() -> None:
    events = "events: [{at: 4 ms, partition: [[camera], [rest]], for: 1 s}, {at: 1 s, heal: all}]"
    text = TABLE.read_text().replace("\nnetwork:\n", f"\nnetwork:\n  {events}\n")
    found = Following(About("live", "test", "", 1, ()))
    what = described(frame_of(9), []) | {"deployment": text}
    found.turn_to(what, found.world_of(what, lambda deployment: {}))
    marks = {"tick": 2, "kind": "network", "text": "partition camera | rest, for 1 s"}
    messages = {message["type"]: message for message in found.take_status(status("running"))}
    assert messages["marks"]["marks"] == [marks]
    assert "marks" not in {message["type"] for message in found.take_status(status("running"))}


def test_what_this_world_does_not_have_is_not_asked_for() -> None:
    found, _ = following()
    wanted = Wanted(1, 500.0, links=(("camera", "player-red"), ("a", "b")), readings=(("camera", "ball"), ("x", "y")))
    asked = found.watch_arguments(wanted, 100.0)
    assert asked == {"hz": 100.0, "links": [("camera", "player-red")], "readings": [("camera", "ball")]}


def test_a_link_that_is_watched_is_told_with_its_rule_before_it_drops_anything() -> None:
    found, _ = following()
    report = {"drops": {"camera>player-red": []}, "readings": {}, "asked": [], "here": []}
    watched = status("running") | {"watched": report}
    wanted = Wanted(1, links=(("camera", "player-red"), ("camera", "player-blue")))
    (told,) = found.explained(watched, wanted)
    assert (told["link"], told["drops"]) == (["camera", "player-red"], [])
    assert told["rule"].startswith("rule everything, from * to *: delay 1 ms")
    assert found.explained(watched, wanted) == []


def test_contacts_are_where_balls_touch_something() -> None:
    layout = build_layout(table())
    values = np.zeros(layout.size)
    ball = layout["ball"].offsets
    values[ball["position"] : ball["position"] + 3] = 1.0, 2.0, 3.0
    values[ball["contacts"] : ball["contacts"] + 2] = 2.0, 0.5
    content = Overlays(table(), layout).content(Frame(7, layout, values), {"contacts"})
    assert content["contacts"] == [(1.0, 2.0, 3.0, 0.5)]
    assert content["rays"] == []


def test_rays_end_where_they_meet_a_wall(fleet_text: Callable[..., str]) -> None:
    deployment = load_deployment(fleet_text(1, "robots.rover01.heading=90 deg"), "hall")
    frame = initial_frame(deployment)
    rays = np.array(Overlays(deployment, frame.layout).content(frame, {"rays"})["rays"])
    sensor = next(s for s in deployment.robots["rover01"].sensors.values() if isinstance(s, ProximitySettings))
    radius = hall_of(deployment).rover.radius
    assert rays.shape == (sensor.rays, 6)
    rays[:, (0, 3)] -= frame.at("rover01", "position")
    rays[:, (1, 4)] -= frame.at("rover01", "position", 1)
    np.testing.assert_allclose(np.hypot(*rays[:, :2].T), radius, atol=1e-3)
    ways = np.hypot(*(rays[:, 3:5] - rays[:, :2]).T)
    assert ways.max() <= sensor.range + 1e-3
    heading = frame.at("rover01", "heading")
    np.testing.assert_allclose(np.arctan2(rays[0, 1], rays[0, 0]), heading, atol=1e-3)


def test_an_operator_is_shown_by_a_readable_name() -> None:
    assert readable("operator-4711-0a1b2c3") == "operator (process 4711)"
    assert readable("operator.alice.0a1b2c3") == "operator.alice"
    assert readable("tester") == "tester"
