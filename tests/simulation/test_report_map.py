"""The map of a report: what stands, where bodies went, and where packets were lost."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace as replace_row

from foosim.capture.reader import open_capture
from foosim.console.report.collect import Report
from foosim.console.report.map import MapMaker, Place, outline, simplified
from foosim.console.report.page import page
from foosim.world.frame import Frame
from foosim.world.scene import Box, Cylinder, Shape, turn
from tests.simulation.conftest import packet
from tests.simulation.report_pages import Page


def test_the_map_has_scenery_paths_and_where_packets_were_lost(found: Report) -> None:
    where = found.map
    assert {track.name for track in where.tracks} >= {"ball", "red.goal"} and len(where.tracks) == 10
    assert [track.name for track in where.tracks if track.is_gone] == ["ball-2"]
    assert where.standing["player-red"] == (-20.0, 3.0) and where.placeless == 0
    assert len(where.losses) == where.lost == found.fates["dropped"]
    assert sum(count for *_, count in where.links) <= where.lost
    middle = next(loss for loss in where.losses if {loss.source, loss.destination} == {"camera", "player-red"})
    assert middle.at == (-10.0, 1.5)


def test_the_map_has_the_scale_of_the_field_and_all_bodies_as_they_are(found: Report) -> None:
    drawn = Page(page(found)).drawings["map"]["map"]
    (left, bottom), (right, top) = drawn["bounds"]
    assert -20.0 < left < -0.6 < 0.6 < right < 20.0, "a client 20 m away does not make the table small"
    bodies = {body["name"]: body for body in drawn["bodies"]}
    assert len(drawn["bodies"]) == len(bodies) == 10 + len(found.map.standing)
    assert (bodies["player-red"]["at"], bodies["player-red"]["shapes"]) == ([-20.0, 3.0], [])
    assert (bodies["ball-2"]["note"], "note" in bodies["ball"]) == ("(removed)", False)
    (ball,) = bodies["ball"]["shapes"]
    assert max(x for x, _ in ball["points"]) - min(x for x, _ in ball["points"]) == pytest.approx(0.035, abs=0.001)
    rod = [point for shape in bodies["red.goal"]["shapes"] for point in shape["points"]]
    along, across = (max(place[axis] for place in rod) - min(place[axis] for place in rod) for axis in (1, 0))
    assert along > 0.8 and across < 0.2
    assert all(bottom < y < top for _, y in rod)
    assert len(drawn["scenery"]) == len(found.map.outlines) and len(drawn["marks"]) == len(found.map.losses)
    legend = {entry["text"]: (entry["sign"], entry["colour"]) for entry in Page(page(found)).drawings["map"]["legend"]}
    assert legend.keys() == found.causes.keys() and len({*legend.values()}) == len(legend)
    assert {(mark["sign"], mark["colour"]) for mark in drawn["marks"]} <= {*legend.values()}


def test_no_line_joins_where_a_body_was_and_where_it_was_put(radio_run: Path) -> None:
    """A ball rolls, is put elsewhere, rolls on, is removed, and comes back."""
    capture = open_capture(radio_run)
    frames = [*capture.each_frame()]
    with_two = next(frame for frame in frames if not frame.layout["ball-2"].is_absent(frame.numbers))
    alone = frames[0]
    maker = MapMaker(capture.deployment, capture.deployment.tick_ns)

    def show(tick: int, x: float, speed: float, base: Frame = with_two) -> None:
        values = base.values.copy()
        if base is with_two:
            start = base.layout["ball-2"].offsets
            values[start["position"] : start["position"] + 3] = x, 0.0, 0.1
            values[start["linear_velocity"]] = speed
        maker.take_frame(Frame(tick, base.layout, values))

    for tick in range(10):  # 10 ms apart: 1 m/s
        show(5 * tick, 0.01 * tick, 1.0)
    for tick in range(10, 20):  # 0.3 m away in 10 ms, and at rest
        show(5 * tick, 0.4, 0.0)
    show(100, 0.48, 9.0)  # it was hit: 8 m/s, and it rolls
    show(105, 0.57, 9.0)
    show(110, 0.0, 0.0, alone)
    show(115, 0.57, 0.0)
    show(120, 0.57, 0.0)
    (track,) = [track for track in maker.result(10).tracks if track.name == "ball-2"]
    ends = [(piece[0][0], piece[-1][0]) for piece in track.pieces]
    assert ends == [pytest.approx((0.0, 0.09)), pytest.approx((0.4, 0.57)), pytest.approx((0.57, 0.57))]
    assert (track.at, track.is_gone) == ((0.57, 0.0), False)
    show(125, 0.0, 0.0, alone)
    (track,) = [track for track in maker.result(10).tracks if track.name == "ball-2"]
    assert (track.at, track.is_gone, track.outlines) == ((0.57, 0.0), True, ())


def test_a_way_keeps_its_turns_and_its_end() -> None:
    there: list[Place] = [(x / 100, 0.0) for x in range(101)]
    back: list[Place] = [(1.0, y / 100) for y in range(1, 101)]
    assert simplified([*there, *back], 0.001) == ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))
    assert simplified([(0.0, 0.0), (1.0, 0.0), (0.0, 0.0)], 0.001) == ((0.0, 0.0), (1.0, 0.0), (0.0, 0.0))
    assert simplified([(0.5, 0.5)], 0.001) == ((0.5, 0.5),)


def test_a_packet_is_lost_where_its_sender_was_when_it_sent(radio_run: Path) -> None:
    """Not where the sender is when the loss is known; without a place of either end it is counted and not drawn."""
    capture = open_capture(radio_run)
    places = capture.poses("red.midfield").positions
    maker = MapMaker(capture.deployment, capture.deployment.tick_ns)
    frames = [*capture.each_frame()]
    for frame in frames:
        maker.take_frame(frame)
    moved = max(range(len(frames)), key=lambda number: float(abs(places[number] - places[-1]).sum()))
    sent_ns = frames[moved].tick * capture.deployment.tick_ns
    maker.take_loss(replace_row(packet(sent_ns + 1, -1, "snr"), source="red.midfield"))
    maker.take_loss(packet(sent_ns, -1, "snr"))
    where = maker.result(10)
    assert [loss.at for loss in where.losses] == [tuple(places[moved][:2])] != [tuple(places[-1][:2])]
    assert (where.lost, where.placeless) == (2, 1)


def test_outlines_are_what_a_thing_covers() -> None:
    half_turn = turn((0.0, 0.0, 1.0), np.pi / 4)
    diamond = outline(Shape(Box((1.0, 1.0, 0.5)), "walls", (0, 0, 0, 1), (5.0, 0.0, 0.5), half_turn))
    assert len(diamond.corners) >= 4 and max(x for x, _ in diamond.corners) == pytest.approx(5.0 + 2**0.5)
    assert diamond.top_m == pytest.approx(1.0)
    lying = outline(Shape(Cylinder(0.5, 4.0), "walls", (0, 0, 0, 1), orientation=turn((1.0, 0.0, 0.0), np.pi / 2)))
    assert max(y for _, y in lying.corners) == pytest.approx(2.0)
    assert max(x for x, _ in lying.corners) == pytest.approx(0.5)
