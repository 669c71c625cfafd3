"""The drawings of a report as data, which the modules of the console's page draw: charts over time, a matrix, a map.

A drawing is what `console/page/src/report.js` reads, by name; times are in s. Pure.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

from foosim.console.report.collect import Band, BinReport, ChannelReport, LinkReport, Report
from foosim.console.report.map import Map, Outline, Place
from foosim.console.shown.timeline import MARKS_MAX

PALETTE: Final = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442", "#8c8c8c")
"""That of Okabe and Ito, as the console has it."""
SIGNS: Final = "\N{BLACK CIRCLE}\N{BLACK SQUARE}\N{BLACK UP-POINTING TRIANGLE}\N{BLACK DIAMOND}\N{MULTIPLICATION X}"
"""Of causes, so that nobody has to tell them by colour alone."""
BAND_COLOURS: Final[Mapping[str, str]] = {
    "partition": "#d55e00",
    "clog": "#e69f00",
    "settings": "#0072b2",
}
SHADES: Final = ("partition", "clog")
"""What is drawn behind all charts."""
FLOOR_OPACITY: Final = 0.15
SCENERY_OPACITY: Final = 0.5
DIGITS_M: Final = 4
"""Places are told to a tenth of a millimetre."""

Drawing = dict[str, Any]


def drawings(found: Report, names: Sequence[str]) -> dict[str, Drawing]:
    """Return the drawings by name; `names` are the endpoints of the matrix."""
    drawn: dict[str, Drawing] = {}
    if found.happenings or found.bands or found.marks:
        drawn["events"] = _events(found)
    if names:
        drawn["links"] = _matrix(names, found.links)
    for number, channel in enumerate(found.channels):
        drawn[f"delay-{number}"] = _delay(found, channel)
        drawn[f"loss-{number}"] = _loss(found, channel)
    if found.causes:
        drawn["causes"] = _causes(found)
    if has_map(found.map):
        looks = cause_looks(found) if found.map.losses else {}
        legend = [{"sign": sign, "colour": colour, "text": cause} for cause, (colour, sign) in looks.items()]
        drawn["map"] = {"kind": "map", "legend": legend, "map": _map(found)}
    return drawn


def has_map(where: Map) -> bool:
    """Whether there is anything to see from above."""
    return bool(where.outlines or where.tracks)


def cause_looks(found: Report) -> dict[str, tuple[str, str]]:
    """Return the colour and the sign of each cause of losses."""
    return {
        cause: (PALETTE[number % len(PALETTE)], SIGNS[number % len(SIGNS)]) for number, cause in enumerate(found.causes)
    }


# --- over time --------------------------------------------------------------------------------------------------------


def _events(found: Report) -> Drawing:
    """Return what held, a lane for each kind, what was asked for, and losses and returns of processes."""
    lanes: list[Drawing] = []
    for kind, colour in BAND_COLOURS.items():
        entries = [_span(band) for band in found.bands if band.kind == kind]
        if entries:
            lanes.append({"name": kind, "colour": colour, "entries": entries})
    asked = [(event.at_ns, event.text) for event in found.happenings if event.is_asked]
    lost = [(mark.at_ns, mark.text) for mark in found.marks]
    named = [("asked for", "request", asked), ("recovery", "recovery", lost)]
    for kind in sorted({event.kind for event in found.happenings if event.kind}):
        did = [(event.at_ns, event.text) for event in found.happenings if event.kind == kind]
        named.append((kind, kind, did[:MARKS_MAX]))
    for name, mark, moments in named:
        if moments:
            entries = [{"from": at_ns / 1e9, "text": f"{at_ns / 1e9:.9g} s: {text}"} for at_ns, text in moments]
            lanes.append({"name": name, "mark": mark, "look": found.looks.get(mark), "entries": entries})
    return {"kind": "lanes", "range": _range(found), "lanes": lanes}


def _span(band: Band) -> Drawing:
    start, end = band.start_ns / 1e9, band.end_ns / 1e9
    return {"from": start, "to": end, "text": f"{start:g} s to {end:g} s: {band.text}"}


def _range(found: Report) -> tuple[float, float]:
    return found.start_ns / 1e9, max(found.end_ns, found.start_ns + 1) / 1e9


def _over_time(found: Report, unit: str, height: int) -> Drawing:
    shades = [
        {**_span(band), "colour": BAND_COLOURS[band.kind], "text": f"{band.kind}: {band.text}"}
        for band in found.bands
        if band.kind in SHADES
    ]
    moments = [mark.at_ns / 1e9 for mark in found.marks]
    return {
        "kind": "time",
        "unit": unit,
        "height": height,
        "range": _range(found),
        "shades": shades,
        "moments": moments,
    }


def _delay(found: Report, channel: ChannelReport) -> Drawing:
    lines = {
        "95th percentile": [content.p95_ms for content in channel.bins],
        "median": [content.p50_ms for content in channel.bins],
    }
    series = [
        {"name": name, "unit": "ms", "points": [*_unbroken(found, channel.bins, values)]}
        for name, values in lines.items()
    ]
    return {**_over_time(found, "delay (ms)", 190), "colours": [PALETTE[1], PALETTE[0]], "series": series}


def _unbroken(
    found: Report, bins: Sequence[BinReport], values: Sequence[float]
) -> Iterator[tuple[float, float | None]]:
    """Yield values at the middles of their spans: None where all was lost, passing over where nothing was sent."""
    for number, (content, value) in enumerate(zip(bins, values, strict=True)):
        if content.delivered:
            yield _middle(found, number), value
        elif content.dropped:
            yield _middle(found, number), None


def _middle(found: Report, number: int) -> float:
    start_ns = found.start_ns + number * found.bin_ns
    return (start_ns + min(found.end_ns, start_ns + found.bin_ns)) / 2e9


def _bars(found: Report, name: str, unit: str, values: Iterable[float]) -> Drawing:
    return {"name": name, "unit": unit, "points": [(_middle(found, n), value) for n, value in enumerate(values)]}


def _loss(found: Report, channel: ChannelReport) -> Drawing:
    lost = [100.0 * a.dropped / (a.delivered + a.dropped) if a.dropped else 0.0 for a in channel.bins]
    series = [_bars(found, "lost", "%", lost)]
    return {**_over_time(found, "lost (%)", 150), "stacked": True, "colours": [PALETTE[5]], "series": series}


def _causes(found: Report) -> Drawing:
    looks = cause_looks(found)
    series = [_bars(found, cause, "packets", counts) for cause, counts in found.causes_over_time.items()]
    colours = [looks[cause][0] for cause in found.causes_over_time]
    return {**_over_time(found, "packets lost", 250), "stacked": True, "colours": colours, "series": series}


# --- links and places -------------------------------------------------------------------------------------------------


def _matrix(names: Sequence[str], links: Iterable[LinkReport]) -> Drawing:
    place = {name: number for number, name in enumerate(names)}
    cells = [
        {"from": place[link.source], "to": place[link.destination], "loss": _share_lost(link), "text": _told(link)}
        for link in links
        if link.source in place and link.destination in place
    ]
    return {"kind": "matrix", "names": names, "cells": cells}


def _share_lost(link: LinkReport) -> float | None:
    judged = link.delivered + link.dropped
    return round(link.dropped / judged, 6) if judged else None


def _told(link: LinkReport) -> str:
    causes = "".join(f", {count} {cause}" for cause, count in link.causes.items())
    text = f"{link.source} to {link.destination}: {link.delivered} of {link.offered} delivered{causes}"
    waiting = link.offered - link.delivered - link.dropped
    return f"{text}, {waiting} in flight" if waiting else text


def _map(found: Report) -> Drawing:
    where, looks = found.map, cause_looks(found)
    scenery = [_shape(thing, FLOOR_OPACITY if thing.top_m <= 0.0 else SCENERY_OPACITY) for thing in where.outlines]
    bodies = [
        {
            "name": track.name,
            "at": _rounded(track.at),
            "shapes": [_shape(thing, 1.0) for thing in sorted(track.outlines, key=lambda one: one.top_m)],
            "paths": [[_rounded(place) for place in piece] for piece in track.pieces if len(piece) > 1],
            **({"note": "(removed)"} if track.is_gone else {}),
        }
        for track in where.tracks
    ]
    bodies += [{"name": name, "at": _rounded(place), "shapes": []} for name, place in where.standing.items()]
    marks = [
        {
            "at": _rounded(loss.at),
            "sign": looks[loss.cause][1],
            "colour": looks[loss.cause][0],
            "text": f"{loss.source} to {loss.destination}: {loss.cause} at {loss.sent_ns / 1e9:.3f} s",
        }
        for loss in where.losses
    ]
    bounds = [_rounded(corner) for corner in where.bounds]
    return {"bounds": bounds, "scenery": scenery, "bodies": bodies, "marks": marks}


def _shape(thing: Outline, opacity: float) -> Drawing:
    red, green, blue = (round(255 * part) for part in thing.colour)
    colour = f"rgb({red} {green} {blue} / {100 * opacity:g}%)"
    return {"kind": "polygon", "at": (0, 0), "points": [_rounded(corner) for corner in thing.corners], "colour": colour}


def _rounded(place: Place) -> tuple[float, float]:
    return round(place[0], DIGITS_M), round(place[1], DIGITS_M)
