"""Surfaces of a table from tracks of its ball: known ones are found again in noisy tracks of the engine itself."""

from __future__ import annotations

import csv
import random
import sys
from collections.abc import Sequence
from math import cos, pi, sin
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
import yaml

from foosim.common.errors import Failed
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.text.files import read_source_file
from foosim.fitting.estimate import fit, scatter_of
from foosim.fitting.motion import Array, Field, Pairs, Start, motion
from foosim.fitting.tracks import BadTracks, read_tracks, usable
from foosim.library.table.settings import Table, table_of
from tests.conftest import Typed
from tests.physics.conftest import World

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
SEED: Final = 20
NOISE_M: Final = 0.0015
"""The camera's, in deploy/table.yaml."""
OTHERS: Final = (
    "table.surfaces.walls.restitution=0.8",
    "table.surfaces.walls.friction=0.1",
    "table.surfaces.floor.friction=0.2",
    "table.surfaces.floor.rolling_friction=0.3 mm",
)


def field_of(table: Table) -> Field:
    radius = table.ball.radius
    x, y = table.field.length / 2 - radius, table.field.width / 2 - radius
    return Field(x, y, radius, table.gravity, table.surfaces.floor.restitution)


def pairs_of(table: Table) -> Pairs:
    floor, walls = table.surfaces.floor, table.surfaces.walls
    return Pairs(floor.rolling_friction, floor.friction, walls.restitution, walls.friction)


def rolled(one: World, start: Start, seconds: float) -> Array:
    """Time, x and y every 10 ms, from the engine."""
    radius = one.table.ball.radius
    x, y, vx, vy, rolls = start
    one.put((x, y, radius), (vx, vy, 0.0), (-rolls * vy / radius, rolls * vx / radius, 0.0))
    rows = [(0.0, x, y)]
    for tick in range(1, round(seconds / one.tick_s) + 1):
        one.tick()
        if tick % 5 == 0:
            rows.append((tick * one.tick_s, one.position[0], one.position[1]))
    return np.array(rows)


def measured(one: World, count: int) -> list[Array]:
    """Noisy tracks over the level floor, of 0.4 to 1.5 s, that begin rolling or sliding at 0.5 to 3 m/s."""
    draws, noise = random.Random(SEED), np.random.Generator(np.random.PCG64(SEED))
    print(f"seed of the tracks: {SEED}")
    tracks: list[Array] = []
    table = one.table
    while len(tracks) < count:
        angle, speed = draws.uniform(0.0, 2.0 * pi), draws.uniform(0.5, 3.0)
        x, y = draws.uniform(-0.3, 0.3), draws.uniform(-0.2, 0.2)
        track = rolled(one, Start(x, y, speed * cos(angle), speed * sin(angle), float(draws.randrange(2))), 1.5)
        x_away = table.field.length / 2 - np.abs(track[:, 1])
        to_corner = x_away + table.field.width / 2 - np.abs(track[:, 2])
        left = (to_corner < table.ramps.leg + 0.02) | (x_away < 0.03)
        track = track[: int(np.argmax(left)) if left.any() else len(track)]
        if len(track) >= 40:
            track[:, 1:] += noise.normal(0.0, NOISE_M, track[:, 1:].shape)
            tracks.append(track)
    return tracks


@pytest.fixture(scope="module")
def noisy() -> tuple[Table, list[Array]]:
    one = World("engine=bullet", *OTHERS)
    tracks = measured(one, 6)
    one.engine.close()
    return one.table, tracks


def write(path: Path, tracks: Sequence[Array]) -> Path:
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["track", "time_ms", "x [mm]", "y [cm]"])
        for number, track in enumerate(tracks):
            writer.writerows([number, *(row * np.array([1e3, 1e3, 1e2]))] for row in track)
    return path


def run(typed: Typed, *arguments: str | Path) -> Any:
    return typed("fit")(*arguments)


# --- the motion ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("start", "seconds", "within"),
    [
        (Start(-0.3, 0.0, 0.5, 0.0, 1.0), 1.0, 0.0001),  # rolls
        (Start(-0.3, 0.0, 1.0, 0.0, 0.0), 0.6, 0.0001),  # slides, then rolls
        (Start(-0.2, 0.0, 0.1, 1.0, 0.0), 0.8, 0.0015),  # comes back from a side wall
        (Start(-0.2, 0.1, 0.3, 2.0, 1.0), 0.8, 0.003),  # hops at it
        (Start(-0.3, 0.1, 1.0, 3.0, 0.5), 0.8, 0.004),  # at both of them
    ],
)
def test_the_motion_is_the_engines(start: Start, seconds: float, within: float) -> None:
    one = World("engine=bullet", "table.contact_erp=0")
    track = rolled(one, start, seconds)
    one.engine.close()
    made = motion(start, pairs_of(one.table), field_of(one.table), seconds)
    assert np.abs(made.at(track[:, 0]) - track[:, 1:]).max() < within


def test_a_ball_comes_to_rest() -> None:
    table = table_of(load_deployment(TABLE.read_text(), "table.yaml"))
    pairs = pairs_of(table)._replace(rolling=0.001)
    made = motion(Start(0.0, 0.0, 0.2, 0.0, 1.0), pairs, field_of(table), 10.0)
    way = 0.2**2 / 2 / (5 / 7 * 0.001 * table.gravity / table.ball.radius)
    assert made.at(np.array([5.0, 9.0])) == pytest.approx(np.array([[way, 0.0], [way, 0.0]]))


# --- the fit ---------------------------------------------------------------------------------------------------------


def test_known_surfaces_are_found_again_within_five_percent(
    noisy: tuple[Table, list[Array]], typed: Typed, tmp_path: Path
) -> None:
    """By the command, whose YAML a deployment with a preset includes; its values are settings of one without."""
    table, tracks = noisy
    done = run(typed, write(tmp_path / "tracks.csv", tracks), "--table", TABLE)
    assert done.code == 0, done
    found = yaml.safe_load(done.out)["table"]["surfaces"]
    sets = [f"table.surfaces.{name}.{key}={value}" for name, keys in found.items() for key, value in keys.items()]
    fitted = table_of(load_deployment(apply_sets(TABLE.read_text(), "table.yaml", sets), "table.yaml"))
    assert len(sets) == 4 and fitted != table_of(load_deployment(TABLE.read_text(), "table.yaml"))
    assert pairs_of(fitted) == pytest.approx(pairs_of(table), rel=0.05)
    (tmp_path / "fitted.yaml").write_text(done.out)
    own = yaml.safe_load(TABLE.read_text()) | {"include": ["fitted.yaml"], "table": {"preset": "german"}}
    (tmp_path / "own.yaml").write_text(yaml.safe_dump(own))
    including = table_of(load_deployment(read_source_file(tmp_path / "own.yaml"), str(tmp_path / "own.yaml")))
    assert pairs_of(including) == pairs_of(fitted)
    assert "half of its interval of 95 % confidence" in done.out and done.out.count("# +- ") == 4


def test_intervals_hold_what_is_true_of_the_model() -> None:
    """Tracks of the model, of balls that roll or slide: nineteen of twenty intervals have the true value, of eight
    at least seven. The residuals are the noise: another minimum of the squares has more."""
    table = table_of(load_deployment(TABLE.read_text(), "table.yaml"))
    field, begun = field_of(table), pairs_of(table)
    pairs = Pairs(0.0003, 0.2, 0.8, 0.1)
    inside = 0
    for seed in range(2):
        draws, noise = random.Random(seed), np.random.Generator(np.random.PCG64(seed))
        tracks = []
        times = np.arange(0.0, 0.8, 0.01)
        for rolls in (1.0, 0.0, 0.5):
            start = Start(draws.uniform(-0.2, 0.2), 0.0, draws.uniform(-0.5, 0.5), draws.uniform(1.0, 2.5), rolls)
            places = motion(start, pairs, field, 0.8).at(times)
            tracks.append(np.column_stack([times, places + noise.normal(0.0, NOISE_M, places.shape)]))
        found = fit(tracks, field, begun)
        assert found.noise == pytest.approx(NOISE_M, rel=0.1) and found.is_converged
        inside += sum(abs(one.value - getattr(pairs, name)) <= one.half for name, one in found.pairs.items())
    assert inside >= 7


def test_a_track_that_the_motion_does_not_fit_is_named(typed: Typed, tmp_path: Path) -> None:
    """Something stops the ball."""
    times = np.arange(0.0, 0.6, 0.01)
    noise = np.random.Generator(np.random.PCG64(SEED))
    places = np.column_stack([-0.2 + 0.8 * np.minimum(times, 0.3), 0.0 * times])
    track = np.column_stack([times, places + noise.normal(0.0, NOISE_M, places.shape)])
    assert scatter_of(track) == pytest.approx(NOISE_M, rel=0.3)
    file = write(tmp_path / "tracks.csv", [track])
    done = run(typed, file, "--table", TABLE)
    assert f"{file} track 0: residuals of " in done.err and "its points scatter by 1." in done.err


def test_a_ball_at_rest_tells_nothing(typed: Typed, tmp_path: Path) -> None:
    track = np.column_stack([np.arange(0.0, 0.5, 0.01), np.full(50, 0.1), np.full(50, 0.2)])
    done = run(typed, write(tmp_path / "tracks.csv", [track]), "--table", TABLE)
    assert done.code == 1 and yaml.safe_load(done.out) == {}
    assert "the tracks do not determine floor.friction (0.3 +- inf): it is left out" in done.err


def test_without_a_rebound_nothing_is_said_of_walls(typed: Typed, tmp_path: Path) -> None:
    table = table_of(load_deployment(TABLE.read_text(), "table.yaml"))
    times = np.arange(0.0, 0.6, 0.01)
    noise = np.random.Generator(np.random.PCG64(SEED))
    tracks = []
    for vy in (0.2, -0.3, 0.1, -0.1):
        places = motion(Start(-0.3, 0.0, 0.9, vy, 0.0), pairs_of(table), field_of(table), 0.6).at(times)
        tracks.append(np.column_stack([times, places + noise.normal(0.0, 0.0002, places.shape)]))
    out = tmp_path / "fitted.yaml"
    file = write(tmp_path / "tracks.csv", tracks)
    done = run(typed, file, "--table", TABLE, "--out", out)
    assert done.code == 0 and done.out == ""
    assert "no track has a rebound from a wall: walls.restitution and walls.friction are not fitted" in done.err
    (floor,) = yaml.safe_load(out.read_text())["table"]["surfaces"].items()
    assert floor[0] == "floor" and floor[1]["friction"] == pytest.approx(0.3, rel=0.05)
    again = run(typed, file, "--table", TABLE, "--out", out)
    assert again.code == 2 and again.err == f"--out {out}: the file exists, and is never overwritten\n"
    beside = run(typed, file, "--table", TABLE, "--out", tmp_path / "none" / "fitted.yaml")
    assert beside.code == 2 and beside.err.endswith(f": no folder {tmp_path / 'none'}\n")


def test_scipy_is_asked_for(monkeypatch: pytest.MonkeyPatch, noisy: tuple[Table, list[Array]]) -> None:
    table, tracks = noisy
    monkeypatch.setitem(sys.modules, "scipy.optimize", None)
    with pytest.raises(Failed, match=r"needs scipy: pip install 'foosim\[fit\]'"):
        fit(tracks, field_of(table), pairs_of(table))


# --- files -----------------------------------------------------------------------------------------------------------

HEAD: Final = "time_s,x_mm,y_mm\n"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "a.csv:1:1: no header with the columns time, x and y, each with its unit"),
        ("time_s,x_mm\n", "a.csv:1: no column of y, as y_mm (there are: 'time_s', 'x_mm')"),
        ("time,x_mm,y_mm\n", "a.csv:1:1: time has no unit: write time [s] or time_s"),
        ("time_s,x [m],y [mn]\n", "a.csv:1:3: no unit of y (there are: m, cm, mm, um, km), 'mn', nearest is 'm'"),
        ("time_s,x_mm,x [m],y_mm\n", "a.csv:1:3: a second column of x, 'x [m]'"),
        ("track,time_s,x_mm,y_mm,track\n", "a.csv:1:5: a second column of track, 'track'"),
        (HEAD, "a.csv: a header, and no measured places below it"),
        (HEAD + "0,1,2\n0.1,1,two\n", "a.csv:3:3: y is no number, 'two'"),
        (HEAD + "0,1,2\n0.1,inf,2\n", "a.csv:3:2: x is no number, 'inf'"),
        (HEAD + "0,1\n", "a.csv:2:3: y is no number, ''"),
        (HEAD + "0,1,2\n0,1,2\n", "a.csv:3:1: time is not later than on the line before"),
        (HEAD + '0,1,"2\n', "a.csv:2: no CSV: unexpected end of data"),
    ],
)
def test_a_bad_file_is_refused_with_line_and_column(text: str, told: str) -> None:
    with pytest.raises(BadTracks) as raised:
        read_tracks(text, "a.csv")
    assert str(raised.value) == told


def test_units_tracks_and_pictures_without_a_ball() -> None:
    text = "frame,t [ms],X [cm],y_m,track\n1,0,10,0.2,a\n2,10,11,0.2,a\n3,20,,,a\n1,0,-1,0,b\n\n"
    first, second = read_tracks(text, "b.csv")
    assert (first.name, second.name) == ("b.csv track a", "b.csv track b")
    assert first.rows == pytest.approx(np.array([[0.0, 0.1, 0.2], [0.01, 0.11, 0.2]]))
    assert second.rows == pytest.approx(np.array([[0.0, -0.01, 0.0]]))


def test_tracks_end_at_ramps_and_goals_and_short_ones_are_left_out() -> None:
    table = table_of(load_deployment(TABLE.read_text(), "table.yaml"))
    field = field_of(table)
    rows = "".join(f"{number / 100},{300 + 8 * number},{200 + 3 * number}\n" for number in range(30))
    still = "".join(f"{number / 100},0,0\n" for number in range(30))
    into, whole = read_tracks(HEAD + rows, "into.csv"), read_tracks(HEAD + still, "whole.csv")
    kept, notes = usable([*into, *whole], field, table.ramps.leg, table.goal)
    assert [track.name for track in kept] == ["whole.csv"]
    assert notes == ["into.csv: left out, 18 points before a ramp or a goal, at least 20 are needed"]
    with pytest.raises(BadTracks, match="no track is long enough"):
        usable(into, field, table.ramps.leg, table.goal)
    with pytest.raises(BadTracks, match=r"^far.csv:3: off the field \(-700 mm, 9 mm; \|x\| is up to 582.5 mm"):
        usable(read_tracks(HEAD + "0,500,9\n1,-700,9\n", "far.csv"), field, table.ramps.leg, table.goal)
    with pytest.raises(BadTracks, match=r"^whole\.csv and whole\.csv are the same track: it would count twice$"):
        usable([*whole, *whole], field, table.ramps.leg, table.goal)


def test_more_tracks_than_are_fitted_in_minutes_are_refused() -> None:
    table = table_of(load_deployment(TABLE.read_text(), "table.yaml"))
    rows = "".join(f"{of},{number / 100},{of},0\n" for of in range(51) for number in range(20))
    tracks = read_tracks("track," + HEAD + rows, "many.csv")
    with pytest.raises(BadTracks, match=r"^51 tracks of 1020 points, at most 50 and 20000 are fitted at once$"):
        usable(tracks, field_of(table), table.ramps.leg, table.goal)
    assert len(usable(tracks[:50], field_of(table), table.ramps.leg, table.goal)[0]) == 50


def test_a_goal_ends_a_track_and_what_is_behind_it_does_not_matter() -> None:
    """In the pocket, then in somebody's hand."""
    table = table_of(load_deployment(TABLE.read_text(), "table.yaml"))
    rolls = "".join(f"{number / 100},{300 + 12 * number},20\n" for number in range(29))
    tracks = read_tracks(HEAD + rolls + "1,660,30\n2,900,900\n", "goal.csv")
    (kept,), notes = usable(tracks, field_of(table), table.ramps.leg, table.goal)
    assert kept.rows[-1, 1] == pytest.approx(0.564) and kept.lines[-1] == 24
    assert notes == ["goal.csv: used up to line 24, then the ball comes to a ramp or a goal"]


def test_a_file_of_another_system_is_read(typed: Typed, tmp_path: Path) -> None:
    """With a byte-order mark, quotes, and CRLF."""
    file = tmp_path / "tracks.csv"
    file.write_bytes(b'\xef\xbb\xbf"time_s","x_mm","y_mm"\r\n0,"1",2\r\n1,900,2\r\n')
    assert f"{file}:3: off the field (900 mm, 2 mm;" in run(typed, file, "--table", TABLE).err
    file.write_bytes(b"time_s,x_mm,y_mm\n0,1,\xff\n")
    assert run(typed, file, "--table", TABLE).err == f"{file}:2: not UTF-8\n"


@pytest.mark.parametrize(
    ("sets", "told"),
    [
        (["--set", "table.strips={height: 5 mm, width: 20 mm}"], "rebounds from walls with strips are not modelled"),
        (["--set", "table.gravty=1 m/s2"], "--set:1:7: table: unknown key, 'gravty', nearest is 'gravity'"),
    ],
)
def test_a_table_that_is_not_modelled_is_refused(sets: list[str], told: str, typed: Typed, tmp_path: Path) -> None:
    file = tmp_path / "tracks.csv"
    file.write_text(HEAD + "0,0,0\n")
    done = run(typed, file, "--table", TABLE, *sets)
    assert done.code == 2 and told in done.err
    missing = run(typed, tmp_path / "none.csv", "--table", TABLE)
    assert missing.code == 2 and missing.err == f"{tmp_path / 'none.csv'}: No such file or directory\n"
