"""What a person sees: every figure that the run has is in the table and, shorter, in the plain line."""

import io
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TextIO, cast

import pytest
from rich.console import Console

from foosim.common.units import parse_pace
from foosim.launcher.display import (
    LINKS_SHOWN_MAX,
    Display,
    Output,
    closing_text,
    fitted,
    plain_line,
    recovery_text,
    render_text,
)
from foosim.library.mobile.hall import HallKit
from foosim.protocol.fingerprint import library_fingerprint
from foosim.protocol.run_status import NO_PACKETS
from foosim.supervisor.core import SupervisorCore
from foosim.supervisor.settings import RunSettings

TABLE = Path(__file__).parent.parent.parent / "deploy" / "table.yaml"
HERE = {"host": "", "lost": False, "stopped": False}


@pytest.fixture
def running() -> dict[str, Any]:
    """The status of a run in full swing."""
    return {
        "run": "table-1",
        "world": "table",
        "ticks": 6170,
        "tick_ns": 2_000_000,
        "rtf": 0.998,
        "pace": "realtime",
        "state": "running",
        "handovers": 41,
        "moves": 2,
        "waiting_for": "red",
        "summary": ["red 2 : 1 blue", "ball at +0.123 -0.045 +0.018 m"],
        "lag_ms": {"p50": 0.31, "p99": 1.62, "max": 7.4},
        "late": {"lag_ms": 0.7, "waited_for": "player-blue", "tick": 6170},
        "solvers": {"ball": "red"},
        "recording": {"state": "on", "problem": "", "offered": 9000, "written": 8990, "refused": 0},
        "packets": {"offered": 22510, "delivered": 22390, "dropped": 113, "in_flight": 7, "refused": 0},
        "nodes": {
            "blue": {"owned": ["blue.attack", "blue.goal"], "solved_ticks": 6001, "free_ticks": 1543},
            "red": {"owned": [f"red.{number}" for number in range(8)], "solved_ticks": 6170, "free_ticks": 4627},
        },
        "processes": {
            "blue": {"role": "node", **HERE, "busy": 0.314, "tick": 6170, "waiting_for": "order"},
            "vhub": {"role": "vhub", **HERE, "busy": 0.22, "tick": 6170, "waiting_for": "Done of player-blue"},
            "supervisor": {"role": "supervisor", **HERE, "busy": 0.106, "tick": 6170, "waiting_for": "red"},
        },
        "links_in_all": 2,
        "vhub_away": False,
        "shared": {},
        "links": [
            ["player-red", "red.goal", 1234, 1220, 9, 1_302_000, "lan", 0, {}, []],
            ["camera", "player-red", 617, 612, 4, 1_297_000, "lan", 0, {}, [["ball", 600, 6_000_000, 8_000_000]]],
        ],
    }


def row_of(text: str, *words: str) -> str:
    """The one line of the table with all these words."""
    (line,) = [line for line in text.splitlines() if all(word in line for word in words)]
    return line


def test_the_table_has_time_pace_lag_score_and_ball(running: dict[str, Any]) -> None:
    text = render_text(running)
    assert "12.34 s · tick 6170 · 1.00x (wanted realtime)" in text
    assert "red 2 : 1 blue · ball at +0.123 -0.045 +0.018 m · ball solved by red · 41 hand-overs, 2 moves" in text
    assert "lag 0.7 ms (p50 0.3, p99 1.6, max 7.4), waited for player-blue" in text


def test_a_hall_has_rovers_and_no_score(running: dict[str, Any]) -> None:
    rovers = {"count": 20, "drive": 18, "least": "rover07", "charge": 0.3412}
    running |= {"summary": [HallKit.text({"rovers": rovers})], "solvers": {}}
    assert "20 rovers, 18 drive, rover07 has 34% of its charge · 41 hand-overs" in render_text(running)
    assert " | 20 rovers, 18 drive, rover07 has 34% of its charge | packets" in plain_line(running)


def test_hosts_have_a_column_where_there_are_any(running: dict[str, Any]) -> None:
    assert "host" not in render_text(running)
    running["processes"]["blue"]["host"] = "left"
    assert "left" in row_of(render_text(running), "blue.attack") and "host" in row_of(render_text(running), "owns")


def test_when_the_last_tick_was_in_time_the_last_late_one_is_named_by_its_number(running: dict[str, Any]) -> None:
    running["late"] |= {"lag_ms": 0.0, "tick": 6042}
    assert "lag 0.0 ms (p50 0.3, p99 1.6, max 7.4), tick 6042 waited for player-blue" in render_text(running)
    running["late"] |= {"waited_for": "", "tick": -1}
    assert "waited for" not in plain_line(running)


def test_a_row_for_each_node_with_what_it_owns_solved_and_its_load(running: dict[str, Any]) -> None:
    text = render_text(running)
    assert row_of(text, "blue.attack").split() == ["blue", "blue.attack,", "blue.goal", "25%", "31%", "order"]
    assert "red.5 and 2 more" in row_of(text, "not here yet")
    assert "75%" in row_of(text, "not here yet") and "free bodies" in text
    assert row_of(text, "vhub").split() == ["vhub", "22%", "Done", "of", "player-blue"]
    assert row_of(text, "supervisor").split() == ["supervisor", "11%", "red"]


def test_a_row_for_each_link_and_one_for_all(running: dict[str, Any]) -> None:
    text = render_text(running)
    assert row_of(text, "1234").split() == ["player-red", "red.goal", "1234", "1220", "9", "1.30", "ms"]
    camera = ["camera", "player-red", "617", "612", "4", "1.30", "ms", "6.0,", "8.0", "ms"]
    assert row_of(text, "617 ").split() == camera
    assert row_of(text, "22510").split() == ["all", "22510", "22390", "113", "7", "in", "flight"]


def test_of_too_many_links_the_busiest_are_shown(running: dict[str, Any]) -> None:
    rest = [0, 0, "lan", 0, {}, []]
    running["links"] = [["camera", f"player-{n}", n, n, *rest] for n in range(LINKS_SHOWN_MAX + 5)]
    running["links_in_all"] = LINKS_SHOWN_MAX + 4
    text = render_text(running)
    assert row_of(text, "player-5 ")
    assert "player-4 " not in text
    assert "and 4 more" in row_of(text, "all", "22510")


def test_the_plain_line_has_the_same_in_short(running: dict[str, Any]) -> None:
    assert plain_line(running) == (
        "12.34 s | 1.00x (wanted realtime) | "
        "lag 0.7 ms (p50 0.3, p99 1.6, max 7.4), waited for player-blue | red 2 : 1 blue | "
        "ball at +0.123 -0.045 +0.018 m | ball solved by red | packets 22510 offered, 22390 delivered, 113 dropped | "
        "load blue 31% vhub 22% supervisor 11%"
    )


def test_counts_of_a_vhub_that_is_away_are_said_to_be_old(running: dict[str, Any]) -> None:
    assert "the vHub was lost" not in plain_line(running) + render_text(running)
    running["vhub_away"] = True
    assert "delivered, 113 dropped (before the vHub was lost) | load" in plain_line(running)
    assert row_of(render_text(running), "links (before the vHub was lost)")
    assert row_of(render_text(running), "22510").split()[:4] == ["all", "22510", "22390", "113"]


def test_fast_has_no_lag_and_a_vhub_that_has_not_reported_no_count_of_packets(running: dict[str, Any]) -> None:
    running |= {"lag_ms": None, "pace": "fast", "state": "paused", "packets": NO_PACKETS}
    assert "lag" not in plain_line(running) + render_text(running)
    assert " | fast, paused | " in plain_line(running) and "packets" not in plain_line(running)


def test_before_the_first_tick_it_says_who_is_waited_for() -> None:
    settings = RunSettings("run", "table.yaml", TABLE.read_text(), parse_pace("realtime"))
    content = SupervisorCore(settings, library_fingerprint(), 0).status(0)
    assert plain_line(content) == "starting, waiting for blue, red, vhub"
    assert "waiting for blue, red, vhub" in render_text(content)
    assert "not here yet" in row_of(render_text(content), "blue.attack")


def test_a_display_that_is_no_terminal_prints_lines_with_the_speed_since_the_last(running: dict[str, Any]) -> None:
    stream = io.StringIO()
    with Display(stream) as display:
        display.say("run [bold]table-1[/bold]")
        display.show(running, 100.0)
        display.show({**running, "ticks": 6420}, 102.0)
    lines = stream.getvalue().splitlines()
    assert lines[0] == "run [bold]table-1[/bold]"
    assert lines[1].startswith("12.34 s | 1.00x (wanted realtime) | ")
    assert lines[2].startswith("12.84 s | 0.25x (wanted realtime) | ")
    assert not display.is_live


def test_lines_that_were_held_follow_the_first_or_the_end() -> None:
    stream = io.StringIO()
    with Display(stream) as display:
        display.hold()
        display.say("run table-1")
        assert stream.getvalue() == ""
        display.release("console: http://127.0.0.1:1/")
        display.say("2")
        assert stream.getvalue() == "console: http://127.0.0.1:1/\nrun table-1\n2\n"
        display.hold()
        display.say("3")
    assert stream.getvalue().endswith("\n2\n3\n"), "nothing is lost"


@pytest.mark.parametrize("state", ["lost", "stopped"])
def test_a_node_that_does_not_take_part_says_so(running: dict[str, Any], state: str) -> None:
    running["processes"]["blue"][state] = True
    (line,) = [line for line in render_text(running).splitlines() if line.startswith("blue ")]
    assert line.rstrip().endswith(f" {state}")


@pytest.mark.parametrize(
    ("entry", "text"),
    [
        (
            {"what": "node", "name": "blue", "reason": "it hangs", "outage_ms": 3.14, "tick": 8, "epoch": 2},
            "tick 8: lost node blue (it hangs), continued after 3.1 ms, epoch 2",
        ),
        (
            {"what": "join", "name": "blue", "reason": "back", "outage_ms": None, "tick": 9, "epoch": 3},
            "tick 9: node blue takes part, epoch 3",
        ),
        (
            {"what": "away", "name": "r", "reason": "its connection closed", "outage_ms": None, "tick": 9, "epoch": 3},
            "tick 9: continues without r (its connection closed), epoch 3",
        ),
    ],
)
def test_losses_and_returns_are_lines(entry: dict[str, Any], text: str) -> None:
    assert recovery_text(entry) == text


@pytest.mark.parametrize("height", [17, 18, 24])
def test_a_low_window_shows_fewer_links_and_keeps_the_row_for_all(running: dict[str, Any], height: int) -> None:
    running["links"] = [["camera", f"player-{number}", number, number, 0, 0, "lan", 0, {}, []] for number in range(40)]
    running["links_in_all"] = 39
    console = Console(width=80, height=height, file=io.StringIO(), color_system=None)
    with console.capture() as captured:
        console.print(fitted(running, console))
    lines = captured.get().splitlines()
    assert len(lines) == height
    assert "player-39 " in captured.get()
    assert lines[-1].startswith("all") and "22510" in lines[-1] and " more" in lines[-1]


def test_a_capture_that_is_full_is_shown_wherever_a_run_is_looked_at(running: dict[str, Any]) -> None:
    assert "capture" not in plain_line(running) and "capture" not in render_text(running)
    problem = {"state": "ended", "problem": "run.mcap: 0.1 MB left on its disk", "refused": 812}
    running["recording"] = {**running["recording"], **problem}
    text = "capture ended: run.mcap: 0.1 MB left on its disk (812 rows are not in it)"
    assert f" | {text} | load" in plain_line(running) and text in render_text(running)


def test_a_run_that_has_ended_shows_how_far_it_is_with_its_capture(running: dict[str, Any]) -> None:
    stream = io.StringIO()
    display = Display(stream)
    assert closing_text(running) == ""
    display.show_closing(running)
    counts = {"state": "closing", "offered": 90_000, "written": 8_790, "refused": 10, "bytes": 12_345_678}
    running["recording"] = {**running["recording"], **counts}
    display.show_closing(running)
    assert stream.getvalue() == "closing the capture: 81,200 rows are left, 12.3 MB are written\n"


def full_disk() -> TextIO:
    return os.fdopen(os.open("/dev/full", os.O_WRONLY), "w")


def closed_pipe() -> TextIO:
    reading, writing = os.pipe()
    os.close(reading)
    return os.fdopen(writing, "w")


@pytest.mark.parametrize("opened", [full_disk, closed_pipe])
def test_a_stream_that_cannot_be_written_ends_nothing(opened: Callable[[], TextIO]) -> None:
    with opened() as stream:
        display = Display(cast(TextIO, Output(stream)))
        for _ in range(3):
            display.say("a line")
    with pytest.raises((OSError, SystemExit)), opened() as stream:
        Display(stream).say("a line")
