"""The command `foosim fit`: the numbers of a football table from measurements.

It is a shell over `tracks.read_tracks` and `estimate.fit`.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from math import floor, log10
from pathlib import Path
from typing import Annotated, Final

import typer

from foosim.common.errors import BadValue, Failed
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.text.files import read_source_file
from foosim.fitting.estimate import Fitted, Result, fit, scatter_of
from foosim.fitting.motion import Field, Pairs
from foosim.fitting.tracks import BadTracks, Track, read_tracks, usable
from foosim.library.table.settings import TABLE, Table, table_of
from foosim.runtime.command import DONE, FAILED, JsonOption, new_app, print_json

app = new_app()

BYTES_MAX: Final = 100_000_000
DOUBTED: Final = 2.0
DOUBTED_M: Final = 0.002
"""A track is doubted at residuals above DOUBTED times the scatter of its points plus this length, an error of the
motion itself after several rebounds."""
WRITTEN: Final = {
    "floor": ("floor", "friction", 1.0, ""),
    "rolling": ("floor", "rolling_friction", 1e3, " mm"),
    "bounce": ("walls", "restitution", 1.0, ""),
    "walls": ("walls", "friction", 1.0, ""),
}
"""The places of fitted values in `table.surfaces`, and their units."""


@app.command(name="fit")
def fit_command(
    files: Annotated[list[Path], typer.Argument(metavar="TRACKS...", help="CSV files with tracks of the ball.")],
    table: Annotated[
        Path, typer.Option("--table", help="A deployment with the table: its measures, and what the fit begins with.")
    ],
    sets: Annotated[list[str] | None, typer.Option("--set", help="Change the deployment; may be repeated.")] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Write the YAML here; by default to standard output.")
    ] = None,
    json: JsonOption = False,
) -> int:
    """Fit rolling friction, friction and restitution of a table to measured tracks.

    A track has the places of a free ball that no figure touched: columns `time`, `x` and `y`, each with its unit in the
    header (`time [s]` or `time_s`), in the table's frame of reference. A column `track` separates several tracks of a
    file. A track is used up to where the ball comes over a corner ramp or before a goal.

    The YAML has the determined surfaces, each value with half of its interval of 95 % confidence; a deployment with a
    preset table includes it. Undetermined ones are left out, with a message. No existing file is overwritten.
    It needs scipy: pip install 'foosim[fit]'.
    """
    # Before scipy is imported. The matrices are small: threads would wait for each other longer than they compute.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if out is not None and out.exists():
        raise BadValue(f"--out {out}: the file exists, and is never overwritten")
    if out is not None and not out.parent.is_dir():
        raise BadValue(f"--out {out}: no folder {out.parent}")
    spec = load_deployment(apply_sets(read_source_file(table), str(table), sets or ()), str(table))
    if TABLE not in spec.kits:
        raise BadValue(f"--table {table}: a deployment without a table section")
    own = table_of(spec)
    if own.strips is not None:
        raise BadValue(f"{table}: table.strips: rebounds from walls with strips are not modelled; measure without them")
    field, first = _field(own), _first(own)
    tracks, notes = usable([track for path in files for track in _read(path)], field, own.ramps.leg, own.goal)
    for note in notes:
        print(note, file=sys.stderr)
    found = fit([track.rows for track in tracks], field, first)
    for line in (*_doubts(found, tracks), *_unknown(found)):
        print(line, file=sys.stderr)
    text = "\n".join(_yaml(found, tracks)) + "\n"
    if out is not None:
        try:
            with out.open("x") as file:
                file.write(text)
        except OSError as error:
            raise Failed(f"{out} cannot be written: {error.strerror}") from None
    if json:
        print_json(_as_json(found, tracks))
    elif out is None:
        sys.stdout.write(text)
    return DONE if any(one.is_known for one in found.pairs.values()) else FAILED


def _read(path: Path) -> list[Track]:
    try:
        with path.open("rb") as file:
            raw = file.read(BYTES_MAX + 1)
    except OSError as error:
        raise BadTracks(f"{path}: {error.strerror}") from None
    if len(raw) > BYTES_MAX:
        raise BadTracks(f"{path}: more than {BYTES_MAX} bytes")
    try:
        return read_tracks(raw.decode("utf-8-sig"), str(path))
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise BadTracks(f"{path}:{line}: not UTF-8") from None


def _field(table: Table) -> Field:
    radius = table.ball.radius
    x, y = table.field.length / 2 - radius, table.field.width / 2 - radius
    return Field(x, y, radius, table.gravity, table.surfaces.floor.restitution)


def _first(table: Table) -> Pairs:
    surfaces = table.surfaces
    return Pairs(
        surfaces.floor.rolling_friction, surfaces.floor.friction, surfaces.walls.restitution, surfaces.walls.friction
    )


def _doubts(found: Result, tracks: list[Track]) -> Iterator[str]:
    """Yield the reasons why intervals do not hold."""
    if not found.is_converged:
        yield "the fit did not converge: values and intervals may be wrong; give more or longer tracks"
    for track, residuals in zip(tracks, found.of_tracks, strict=True):
        scatter = scatter_of(track.rows)
        if residuals > DOUBTED * scatter + DOUBTED_M:
            yield (
                f"{track.name}: residuals of {residuals * 1e3:.1f} mm, its points scatter by {scatter * 1e3:.1f} mm: "
                "the ball met something, the table is another, or it is several tracks; intervals do not hold"
            )


def _unknown(found: Result) -> Iterator[str]:
    """Yield messages about undetermined surfaces."""
    if "bounce" not in found.pairs:
        yield "no track has a rebound from a wall: walls.restitution and walls.friction are not fitted"
    for name, one in found.pairs.items():
        if not one.is_known:
            surface, key, times, unit = WRITTEN[name]
            value = f"{one.value * times:.2g}{unit} +- {one.half * times:.2g}"
            yield f"the tracks do not determine {surface}.{key} ({value}): it is left out"


def _yaml(found: Result, tracks: list[Track]) -> Iterator[str]:
    yield f"# {found.points} points of {len(tracks)} tracks, {found.rebounds} rebounds; residuals of"
    yield f"# {found.noise * 1e3:.2f} mm. After each value half of its interval of 95 % confidence."
    known = {name: one for name, one in found.pairs.items() if one.is_known}
    if not known:
        yield "{}"
        return
    yield "table:"
    yield "  surfaces:"
    surface = ""
    for name in WRITTEN:
        if name in known:
            its, key, times, unit = WRITTEN[name]
            if its != surface:
                surface = its
                yield f"    {its}:"
            value, half = _rounded(known[name], times)
            yield f"      {key}: {value}{unit}  # +- {half}"


def _rounded(one: Fitted, times: float) -> tuple[str, str]:
    """Return value and half interval with two digits of the interval."""
    half = one.half * times
    digits = max(0, 1 - floor(log10(half))) if half > 0.0 else 6
    return f"{one.value * times:.{digits}f}", f"{half:.{digits}f}"


def _as_json(found: Result, tracks: list[Track]) -> dict[str, object]:
    surfaces: dict[str, dict[str, object]] = {}
    for name, one in found.pairs.items():
        its, key, _, _ = WRITTEN[name]
        surfaces.setdefault(its, {})[key] = {"value": one.value, "half_interval": one.half, "is_known": one.is_known}
    return {
        "surfaces": surfaces,
        "residuals_m": found.noise,
        "is_converged": found.is_converged,
        "points": found.points,
        "tracks": len(tracks),
        "rebounds": found.rebounds,
    }
