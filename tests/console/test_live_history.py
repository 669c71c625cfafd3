"""What the console keeps of a run: how far back a page that is opened later scrolls, and how much that may be."""

from __future__ import annotations

from math import isnan
from typing import Any

import numpy as np
import pytest

from foosim.console.live import history as kept
from foosim.console.live.history import APART_NS, History, Rows
from foosim.console.shown.curves import points_of
from foosim.console.shown.source import Curve, Wanted
from tests.console.test_following import commit, following, frame_of, status

TICK_NS = 2_000_000
APART = APART_NS // TICK_NS
WIDE = 4 * APART


def test_numbers_of_frames_are_kept_some_time_apart_with_a_hole_where_their_entity_is_absent() -> None:
    found = following()
    for tick in range(10, 10 + 4 * APART):
        found.show(commit(frame_of(tick, is_absent=tick < 10 + 2 * APART)))
    layout = frame_of(0).layout
    score, ball = layout["world"].offsets["football.score"], layout["ball-2"].offsets["position"]
    ticks = [10 + number * APART for number in range(4)]
    assert found.points(Curve("z", field=score))() == [(tick, float(score)) for tick in ticks]
    points = found.points(Curve("b", field=ball))()
    assert [(tick, isnan(value)) for tick, value in points] == list(zip(ticks, [True, True, False, False], strict=True))
    assert found.points(Curve("w", field=10_000))() == []


def test_values_of_the_status_figures_of_links_and_readings_are_kept() -> None:
    found = following()
    found.listen(Wanted(1, 50.0, readings=(("camera", "ball"),)))
    link = ["a", "b", 4, 3, 1, 2_000_000, "everything", 5_000_000, {"loss": 1}]
    for number in range(1, 5):
        said: dict[str, Any] = status("running") | {"ticks": number * WIDE, "lag_ms": {"p99": number / 2}}
        said |= {"metrics": {"players.a.trips": number}}
        readings = [[number * WIDE, [0.5, float(number)]], [number * WIDE + 1, [0.5, 9.0]]]
        said |= {"links": [link], "watched": {"readings": {"camera/ball": readings}}, "rtf": None}
        found.take_status(said)
    ticks = [number * WIDE for number in range(1, 5)]
    assert found.points(Curve("l", status="lag_ms.p99"))() == [(tick, tick / WIDE / 2) for tick in ticks]
    assert found.points(Curve("t", status="metrics.players.a.trips"))() == [(tick, tick / WIDE) for tick in ticks]
    (line,) = points_of([Curve("t", status="metrics.players.a.trips")], {"type": "status", "status": said})
    assert line["points"] == [(ticks[-1], 4.0)]
    assert found.points(Curve("x", reading=("camera", "ball"), index=1))() == [(tick, tick / WIDE) for tick in ticks]
    assert found.points(Curve("q", link=("a", "b"), figure="queue_ms"))() == [(ticks[0], 5.0), (ticks[2], 5.0)]
    for curve in (
        Curve("r", status="rtf"),
        Curve("m", link=("a", "c"), figure="loss"),
        Curve("y", reading=("camera", "ball"), index=7),
        Curve("n", reading=("camera", "other")),
    ):
        assert found.points(curve)() == []


def test_what_nobody_looked_at_is_a_hole_and_time_that_goes_back_forgets_what_was_later() -> None:
    history = History(TICK_NS)
    curve = Curve("z", field=3)
    for tick in (APART, 2 * APART):
        history.keep_frame(tick, frame_of(tick).values)
    for wanted in (Wanted(), Wanted(1, 50.0)):
        history.listen(wanted)
    history.keep_frame(9 * APART, frame_of(9 * APART).values)
    points = history.reader(curve)()
    assert [tick for tick, _ in points] == [APART, 2 * APART, 2 * APART + 1, 9 * APART]
    assert [isnan(value) for _, value in points] == [False, False, True, False]
    history.keep_frame(2 * APART, frame_of(2 * APART).values)
    assert [tick for tick, _ in history.reader(curve)()] == [APART, 2 * APART]


@pytest.mark.parametrize("count", [1, 1000, 100_000])
def test_what_is_kept_is_bounded_and_reaches_as_far_back_in_a_large_world(count: int) -> None:
    rows = Rows(TICK_NS, kept.FRAMES_BYTES, np.float32)
    last = 0
    for tick in range(0, 4 * kept.WINDOW_NS // TICK_NS, APART // 2):
        if rows.is_due(tick, count):
            rows.keep(tick, "what", np.full(count, tick, np.float32))
            last = tick
    assert sum(row[2].nbytes + kept.ROW_BYTES for row in rows._rows) <= 1.01 * kept.FRAMES_BYTES
    points = rows.reader(lambda what: 0)()
    assert points[-1][0] == last and (last - points[0][0]) * TICK_NS > 0.9 * kept.WINDOW_NS
