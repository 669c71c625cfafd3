"""What the console keeps of a run: how far back a page that is opened later scrolls, and how much that may be."""

from __future__ import annotations

from math import isnan
from typing import Any

import numpy as np
import pytest

from foosim.console.live import history as kept
from foosim.console.live.history import APART_NS, ROWS_MAX, History, Rows
from foosim.console.shown.source import Curve, Wanted
from foosim.world.layout import build_layout
from tests.console.memory import table
from tests.console.test_following import BALL2, commit, described, following, frame_of, status

TICK_NS = 2_000_000
APART = APART_NS // TICK_NS
WIDE = 4 * APART


def place(entity: str, field: str, added: list[list[str]]) -> int:
    """The index of a field's first number."""
    layout = build_layout(table(), [(name, model) for name, model in added])
    return layout[entity].offsets[field]


def test_numbers_of_frames_are_kept_some_time_apart_by_name_through_a_change_of_the_layout() -> None:
    found, world = following()
    for tick in range(10, 10 + 3 * APART):
        found.show(world, frame_of(tick))
    ball = place("world", "football.score", [])
    points = found.points(Curve("z", field=ball))()
    assert points == [(tick, float(ball)) for tick in (10, 10 + APART, 10 + 2 * APART)]
    later = 20 * APART
    what = described(frame_of(later, BALL2[0]), BALL2)
    found.turn_to(what, found.world_of(what, lambda deployment: {}))
    read = found.read(commit(frame_of(later, BALL2[0])))
    assert read is not None
    found.show(*read)
    moved = place("world", "football.score", BALL2)
    assert moved != ball
    assert found.points(Curve("z", field=moved))() == [*points, (later, float(moved))]
    assert found.points(Curve("b", field=place("ball2", "position", BALL2)))()[0][0] == later
    assert found.points(Curve("w", field=10_000))() == []


def test_values_of_the_status_figures_of_links_and_readings_are_kept() -> None:
    found, _ = following()
    found.listen(Wanted(1, 50.0, readings=(("camera", "ball"),)))
    link = ["a", "b", 4, 3, 1, 2_000_000, "everything", 5_000_000, {"loss": 1}]
    for number in range(1, 5):
        said: dict[str, Any] = status("running") | {"ticks": number * WIDE, "lag_ms": {"p99": number / 2}}
        readings = [[number * WIDE, [0.5, float(number)]], [number * WIDE + 1, [0.5, 9.0]]]
        said |= {"links": [link], "watched": {"readings": {"camera/ball": readings}}, "rtf": None}
        found.take_status(said)
    ticks = [number * WIDE for number in range(1, 5)]
    assert found.points(Curve("l", status="lag_ms.p99"))() == [(tick, tick / WIDE / 2) for tick in ticks]
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
    history, layout = History(TICK_NS), frame_of(1).layout
    curve = Curve("z", field=3)
    for tick in (APART, 2 * APART):
        history.keep_frame(frame_of(tick))
    for wanted in (Wanted(), Wanted(1, 50.0)):
        history.listen(wanted)
    history.keep_frame(frame_of(9 * APART))
    points = history.reader(curve, layout)()
    assert [tick for tick, _ in points] == [APART, 2 * APART, 2 * APART + 1, 9 * APART]
    assert [isnan(value) for _, value in points] == [False, False, True, False]
    history.keep_frame(frame_of(2 * APART))
    assert [tick for tick, _ in history.reader(curve, layout)()] == [APART, 2 * APART]


@pytest.mark.parametrize("count", [1, 1000, 100_000])
def test_what_is_kept_is_bounded_and_reaches_as_far_back_in_a_large_world(count: int) -> None:
    rows = Rows(kept.FRAMES_BYTES, np.float32)
    last = 0
    for tick in range(0, 4 * ROWS_MAX * APART, APART // 2):
        if rows.is_due(tick, TICK_NS, count):
            rows.keep(tick, "what", np.full(count, tick, np.float32))
            last = tick
            assert rows._bytes <= kept.FRAMES_BYTES and len(rows._rows) <= ROWS_MAX
    points = rows.reader(lambda what: 0)()
    assert points[-1][0] == last and (last - points[0][0]) * TICK_NS > 0.9 * kept.WINDOW_NS
    assert rows._bytes == sum(row[2].nbytes + kept.ROW_BYTES for row in rows._rows)


def test_readings_that_come_after_nobody_plots_them_are_none_and_leave_a_hole() -> None:
    history, layout = History(TICK_NS), frame_of(1).layout
    plotted = Wanted(1, 50.0, readings=(("camera", "ball"),))
    for number, wanted in enumerate((plotted, Wanted(1, 50.0), Wanted(), plotted), start=1):
        history.listen(wanted)
        said = {"type": "readings", "robot": "camera", "channel": "ball", "points": [[number * WIDE, [1.0]]]}
        history.keep(said)
    points = history.reader(Curve("x", reading=("camera", "ball")), layout)()
    assert [(tick, isnan(value)) for tick, value in points] == [(WIDE, False), (WIDE + 1, True), (4 * WIDE, False)]


def test_readings_of_the_channels_that_were_heard_last_are_kept() -> None:
    history, layout = History(TICK_NS), frame_of(1).layout
    history.listen(Wanted(1, 50.0, readings=tuple((f"r{number}", "c") for number in range(kept.READINGS_MAX + 1))))
    for number in range(kept.READINGS_MAX + 1):
        history.keep({"type": "readings", "robot": f"r{number}", "channel": "c", "points": [[5, [1.0]]]})
    known = [bool(history.reader(Curve("x", reading=(f"r{number}", "c")), layout)()) for number in (0, 1)]
    assert known == [False, True]
