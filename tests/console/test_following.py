"""What becomes of what a running system says: frames as moments, requests as marks, overlays."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable
from typing import Any

import numpy as np

from foosim.console.live.following import Following, first_frame
from foosim.console.shown.overlays import Overlays
from foosim.console.shown.source import About, Moment, Wanted
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.library.generic.proximity import ProximitySettings
from foosim.library.mobile.hall_settings import hall_of
from foosim.protocol.codec import encode
from foosim.protocol.messages import Commit
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.component_types.descriptions import ABSENT
from foosim.world.frame import Frame
from foosim.world.layout import build_layout
from tests.console.memory import TABLE, table_with_spares


def commit(frame: Frame) -> bytes:
    return encode(Commit(1, frame.tick, frame.digest, frame.values.tobytes(), [], [], False))


def described(frame: Frame) -> dict[str, Any]:
    return {
        "run": "test",
        "deployment_name": TABLE.name,
        "deployment": apply_sets(TABLE.read_text(), TABLE.name, ["table.spare_balls=1"]),
        "layout": frame.layout.digest.hex(),
        "tick": frame.tick,
        "frame": b64encode(commit(frame)).decode(),
    }


def frame_of(tick: int, *, is_absent: bool = False) -> Frame:
    """A frame whose numbers are their places; the spare ball is in the world, or not."""
    layout = build_layout(table_with_spares())
    values = np.arange(layout.size, dtype=np.float64)
    values[layout["ball-2"].offsets[ABSENT]] = is_absent
    return Frame(tick, layout, values)


def following() -> Following:
    found = Following(About("live", "test", "", 1, ()))
    what = described(frame_of(5))
    world = found.world_of(what, lambda deployment: {})
    assert found.turn_to(what, world)
    assert found.first_moment(first_frame(world.drawing, what)) is not None
    return found


def show(found: Following, frame: Frame) -> Moment:
    moment = found.show(commit(frame))
    assert moment is not None
    return moment


def test_a_ball_comes_and_goes_in_one_scene() -> None:
    found = following()
    names = [link["name"] for link in found.content()["links"]]
    ball = names.index("ball-2")
    seen = [show(found, frame_of(tick, is_absent=tick % 2 == 1)) for tick in (7, 8, 9)]
    assert [bool(np.isnan(moment.poses[ball]).all()) for moment in seen] == [True, False, True]
    assert all(np.isfinite(np.delete(moment.poses, ball, 0)).all() for moment in seen)


def test_the_same_world_described_again_is_no_new_scene() -> None:
    found = following()
    what = described(frame_of(9))
    world = found.world_of(what, lambda deployment: {})
    assert not found.turn_to(what, world)
    first = found.first_moment(first_frame(world.drawing, what))
    assert first is not None and (first.tick, first.jump) == (9, True)
    assert found.first_moment(first_frame(world.drawing, what)) is None


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
    found = following()
    found.keep_requester("operator-1-abc", 5, "pause", "browser 2")
    entry = {"tick": 5, "verb": "pause", "text": "paused at tick 5", "who": "operator-1-abc", "accepted": True}
    other = {**entry, "tick": 4, "verb": "rate", "text": "pace 2x from tick 4", "who": "operator-9-xyz"}
    messages = {message["type"]: message for message in found.take_status(status("paused", other, entry))}
    assert [entry["who"] for entry in messages["status"]["status"]["requests"]] == ["operator-9-xyz", "browser 2"]
    texts = [mark["text"] for mark in messages["marks"]["marks"]]
    assert texts == ["operator-9-xyz: pace 2x from tick 4", "browser 2: paused at tick 5"]
    standing = found.standing_moment()
    assert standing is not None and standing.paused
    assert found.standing_moment() is None
    assert show(found, frame_of(6)).paused, "the last frame may come behind the status"
    assert "marks" not in {message["type"] for message in found.take_status(status("paused", other, entry))}


def test_events_of_the_deployment_are_marked_when_their_time_is_reached() -> None:
    events = "events: [{at: 4 ms, partition: [[camera], [rest]], for: 1 s}, {at: 1 s, heal: all}]"
    what = described(frame_of(9))
    what["deployment"] = what["deployment"].replace("\nnetwork:\n", f"\nnetwork:\n  {events}\n")
    found = Following(About("live", "test", "", 1, ()))
    found.turn_to(what, found.world_of(what, lambda deployment: {}))
    marks = {"tick": 2, "kind": "network", "text": "partition camera | rest, for 1 s"}
    messages = {message["type"]: message for message in found.take_status(status("running"))}
    assert messages["marks"]["marks"] == [marks]
    assert "marks" not in {message["type"] for message in found.take_status(status("running"))}


def test_what_this_world_does_not_have_is_not_asked_for() -> None:
    found = following()
    wanted = Wanted(1, 500.0, links=(("camera", "player-red"), ("a", "b")), readings=(("camera", "ball"), ("x", "y")))
    asked = found.watch_arguments(wanted, 100.0)
    assert asked == {"hz": 100.0, "links": [("camera", "player-red")], "readings": [("camera", "ball")]}


def test_a_link_that_is_watched_is_told_with_its_rule_before_it_drops_anything() -> None:
    found = following()
    report = {"drops": {"camera>player-red": []}, "readings": {}, "events": [], "here": []}
    watched = status("running") | {"watched": report}
    wanted = Wanted(1, links=(("camera", "player-red"), ("camera", "player-blue")))
    (told,) = found.explained(watched, wanted)
    assert (told["link"], told["drops"]) == (["camera", "player-red"], [])
    assert told["rule"].startswith("rule everything, from * to *: delay 1 ms")
    assert found.explained(watched, wanted) == []


def test_rays_end_where_they_meet_a_wall(fleet_text: Callable[..., str]) -> None:
    sets = ("robots.rover01.heading=90 deg", "robots.rover02.spare=true")
    deployment = load_deployment(fleet_text(2, *sets), "hall")
    frame = initial_frame(deployment)
    rays = np.array(Overlays(deployment, frame.layout).content(frame, {"rays"})["rays"])
    sensor = next(s for s in deployment.robots["rover01"].sensors.values() if isinstance(s, ProximitySettings))
    radius = hall_of(deployment).rover.radius
    assert rays.shape == (sensor.rays, 6), "one that is absent sends none"
    rays[:, (0, 3)] -= frame.at("rover01", "position")
    rays[:, (1, 4)] -= frame.at("rover01", "position", 1)
    np.testing.assert_allclose(np.hypot(*rays[:, :2].T), radius, atol=1e-3)
    ways = np.hypot(*(rays[:, 3:5] - rays[:, :2]).T)
    assert ways.max() <= sensor.range + 1e-3
    heading = frame.at("rover01", "heading")
    np.testing.assert_allclose(np.arctan2(rays[0, 1], rays[0, 0]), heading, atol=1e-3)
