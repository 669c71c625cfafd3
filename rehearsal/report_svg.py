"""Drawings of a report as SVG that stands inside a page: charts over time, a matrix, a map.

Pure functions of plain numbers; every text is escaped here. Neighbours: `report_page` puts them together.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from math import floor, log10
from typing import Final

from foosim.rehearsal.report import Band, LinkReport, Mark
from foosim.rehearsal.report_map import Map, Place

LEFT: Final = 56
RIGHT: Final = 20
FOOT: Final = 20
WHOLE: Final = (1.0, 2.0, 5.0, 10.0)
"""Steps of lengths and times."""
PALETTE: Final = (
    *("#d9480f", "#1971c2", "#2f9e44", "#9c36b5", "#e0a100", "#0c8599", "#c2255c", "#5f3dc4", "#66a80f", "#868e96"),
    *("#a61e4d", "#364fc7", "#2b8a3e", "#862e9c", "#846358", "#087f5b"),
)
BAND_COLOURS: Final[Mapping[str, str]] = {
    "partition": "#c92a2a",
    "clog": "#e67700",
    "settings": "#1971c2",
    "chaos": "#862e9c",
}
SHARES: Final = (
    *((1.0, "#2166ac", "all"), (0.999, "#5aa3d0", "99.9 %"), (0.99, "#a6cee3", "99 %"), (0.95, "#fee08b", "95 %")),
    *((0.8, "#fdae61", "80 %"), (0.5, "#f46d43", "50 %"), (0.0, "#a50026", "less")),
)
"""The least share delivered of each colour of a matrix."""


Run = Sequence[tuple[int, float]]
"""Numbers of bins, and a value of each: what is drawn as one line."""


@dataclass(frozen=True, slots=True)
class Span:
    """The simulated times of a chart from left to right, and its size in pixels."""

    start_ns: int
    end_ns: int
    bin_ns: int
    width: int
    height: int

    def x(self, time_ns: float) -> float:
        share = (time_ns - self.start_ns) / max(1, self.end_ns - self.start_ns)
        return LEFT + (self.width - LEFT - RIGHT) * min(1.0, max(0.0, share))

    def bin_x(self, number: int) -> tuple[float, float]:
        start_ns = self.start_ns + number * self.bin_ns
        return self.x(start_ns), self.x(min(self.end_ns, start_ns + self.bin_ns))

    @property
    def bottom(self) -> int:
        return self.height - FOOT


def svg(width: float, height: float, parts: Iterable[str], label: str) -> str:
    """Return a drawing that shrinks with the page."""
    head = f'<svg viewBox="0 0 {width:g} {height:g}" width="{width:g}" role="img" aria-label="{escape(label)}">'
    return "\n".join([head, *parts, "</svg>"])


def text(x: float, y: float, content: str, anchor: str = "start") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(content)}</text>'


def rect(x: float, y: float, width: float, height: float, colour: str, title: str = "", more: str = "") -> str:
    inside = f"<title>{escape(title)}</title>" if title else ""
    return (
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" fill="{colour}"{more}>{inside}</rect>'
    )


def round_up(value: float, steps: Sequence[float] = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)) -> float:
    """Return the least of some steps times a power of ten that is not below a value; 1 for 0."""
    if value <= 0.0:
        return 1.0
    power = 10.0 ** floor(log10(value))
    return next(step * power for step in steps if step * power >= value * (1.0 - 1e-12))


def legend(entries: Iterable[tuple[str, str]]) -> str:
    """Return the names of colours, as HTML."""
    items = (f'<span><i style="background:{colour}"></i>{escape(name)}</span>' for name, colour in entries)
    return f'<p class="legend">{"".join(items)}</p>'


# --- over time --------------------------------------------------------------------------------------------------------


def _frame(span: Span, top: float, unit: str, bands: Sequence[Band], marks: Sequence[Mark] = ()) -> list[str]:
    """Return the axes, with what held meanwhile behind."""
    parts = shades(span, bands, marks)
    for share in (0.0, 0.5, 1.0):
        y = span.bottom - share * (span.bottom - 8)
        parts.append(f'<line x1="{LEFT}" x2="{span.width - RIGHT}" y1="{y:.1f}" y2="{y:.1f}" class="grid"/>')
        parts.append(text(LEFT - 4, y + 4, f"{top * share:g}{unit if share == 1.0 else ''}", "end"))
    return parts + _times(span)


def _times(span: Span) -> list[str]:
    """Return the numbers below the time axis, about one in 110 pixels."""
    step_ns = max(1, int(round_up((span.end_ns - span.start_ns) * 110 / span.width, WHOLE)))
    first, last = -(-span.start_ns // step_ns), span.end_ns // step_ns
    return [
        text(span.x(n * step_ns), span.height - 5, f"{n * step_ns / 1e9:g} s", "middle") for n in range(first, last + 1)
    ]


def shades(span: Span, bands: Sequence[Band], marks: Sequence[Mark]) -> list[str]:
    """Return partitions and clogs as shades, losses and returns of processes as lines."""
    parts = [
        rect(span.x(band.start_ns), 8, span.x(band.end_ns) - span.x(band.start_ns), span.bottom - 8,
             BAND_COLOURS[band.kind], f"{band.kind}: {band.text}", ' fill-opacity="0.12"')
        for band in bands
        if band.kind in ("partition", "clog")
    ]  # fmt: skip
    for mark in marks:
        x = span.x(mark.at_ns)
        line = f'<line x1="{x:.1f}" x2="{x:.1f}" y1="8" y2="{span.bottom}" class="mark">'
        parts.append(f"{line}<title>{escape(mark.text)}</title></line>")
    return parts


def line_chart(
    span: Span,
    lines: Sequence[tuple[str, Sequence[Run]]],
    unit: str,
    bands: Sequence[Band],
    marks: Sequence[Mark],
    label: str,
) -> str:
    """Draw (colour, runs of numbers) as lines through the middles of their bins, each run one line."""
    top = round_up(max((value for _, runs in lines for run in runs for _, value in run), default=0.0))
    parts = _frame(span, top, unit, bands, marks)
    for colour, runs in lines:
        for run in runs:
            points = []
            for number, value in run:
                low, high = span.bin_x(number)
                points.append(f"{(low + high) / 2:.1f},{span.bottom - value / top * (span.bottom - 8):.1f}")
            if len(points) == 1:
                x, y = points[0].split(",")
                parts.append(f'<circle cx="{x}" cy="{y}" r="2" fill="{colour}"/>')
            else:
                parts.append(f'<polyline points="{" ".join(points)}" fill="none" stroke="{colour}"/>')
    return svg(span.width, span.height, parts, label)


def bar_chart(
    span: Span,
    series: Mapping[str, tuple[str, Sequence[float]]],
    unit: str,
    bands: Sequence[Band],
    marks: Sequence[Mark],
    label: str,
) -> str:
    """Draw name: (colour, a number for each bin) as bars, one on the other."""
    sums = [sum(values) for values in zip(*(values for _, values in series.values()), strict=True)]
    top = round_up(max(sums, default=0.0))
    parts = _frame(span, top, unit, bands, marks)
    below = [0.0] * len(sums)
    for name, (colour, values) in series.items():
        for number, value in enumerate(values):
            if not value:
                continue
            low, high = span.bin_x(number)
            height = value / top * (span.bottom - 8)
            y = span.bottom - below[number] - height
            title = f"{name}: {value:.6g}{unit} from {(span.start_ns + number * span.bin_ns) / 1e9:g} s"
            parts.append(rect(low, y, max(0.5, high - low - 0.5), height, colour, title))
            below[number] += height
    return svg(span.width, span.height, parts, label)


def lanes(width: int, start_ns: int, end_ns: int, bands: Sequence[Band], marks: Sequence[Mark], label: str) -> str:
    """Draw what held, a lane for each kind, and below them losses and returns of processes."""
    kinds = [kind for kind in BAND_COLOURS if any(band.kind == kind for band in bands)]
    span = Span(start_ns, end_ns, 1, width, 26 * (len(kinds) + bool(marks)) + FOOT + 8)
    parts = _times(span)
    for lane, kind in enumerate(kinds):
        y = 8 + 26 * lane
        parts.append(text(LEFT - 4, y + 15, kind, "end"))
        for band in bands:
            if band.kind == kind:
                x = span.x(band.start_ns)
                title = f"{band.start_ns / 1e9:g} s to {band.end_ns / 1e9:g} s: {band.text}"
                parts.append(rect(x, y, max(1.0, span.x(band.end_ns) - x), 20, BAND_COLOURS[kind], title,
                                  ' fill-opacity="0.6"'))  # fmt: skip
    for mark in marks:
        x, y = span.x(mark.at_ns), 8 + 26 * len(kinds)
        corners = f"{x:.1f},{y} {x - 6:.1f},{y + 18} {x + 6:.1f},{y + 18}"
        parts.append(f'<polygon points="{corners}" fill="#212529"><title>{escape(mark.text)}</title></polygon>')
    return svg(span.width, span.height, parts, label)


# --- links ------------------------------------------------------------------------------------------------------------

CELL: Final = 14


def share_colour(share: float) -> str:
    """Return the colour of a share delivered."""
    return next(colour for least, colour, _ in SHARES if share >= least)


def matrix(names: Sequence[str], links: Iterable[LinkReport], label: str) -> str:
    """Draw links as cells: a row for each source, a column for each destination."""
    place = {name: number for number, name in enumerate(names)}
    margin = 12 + 7 * max((len(name) for name in names), default=0)
    size = margin + CELL * len(names) + 4
    parts = []
    for name, number in place.items():
        at = margin + CELL * number
        parts.append(text(margin - 5, at + 11, name, "end"))
        parts.append(f'<text transform="translate({at + 11},{margin - 5}) rotate(-90)">{escape(name)}</text>')
        parts.append(rect(at, at, CELL - 1, CELL - 1, "#f1f3f5"))
    for link in links:
        if link.source not in place or link.destination not in place:
            continue
        x, y = (margin + CELL * place[end] for end in (link.destination, link.source))
        judged = link.delivered + link.dropped
        colour = share_colour(link.delivered / judged) if judged else "#dee2e6"
        causes = "".join(f", {count} {cause}" for cause, count in link.causes.items())
        waiting = link.offered - judged
        title = f"{link.source} to {link.destination}: {link.delivered} of {link.offered} delivered{causes}"
        parts.append(rect(x, y, CELL - 1, CELL - 1, colour, f"{title}, {waiting} in flight" if waiting else title))
    return svg(size, size, parts, label)


# --- places -----------------------------------------------------------------------------------------------------------

MAP_SIZE: Final = 1000
MARGIN: Final = 16


def map_picture(found: Map, colours: Mapping[str, str], label: str) -> str:
    """Draw scenery, paths and lost packets from above: x to the right, y up, in m."""
    points = [corner for thing in found.outlines for corner in thing.corners]
    points += [point for track in found.tracks for point in track.points] + list(found.standing.values())
    points += [loss.at for loss in found.losses]
    low_x, low_y = (min((point[axis] for point in points), default=0.0) for axis in (0, 1))
    high_x, high_y = (max((point[axis] for point in points), default=1.0) for axis in (0, 1))
    scale = (MAP_SIZE - 2 * MARGIN) / max(high_x - low_x, high_y - low_y, 1e-6)

    def at(place: Place) -> tuple[float, float]:
        return MARGIN + (place[0] - low_x) * scale, MARGIN + (high_y - place[1]) * scale

    def line(places: Iterable[Place]) -> str:
        drawn = dict.fromkeys(f"{x:.1f},{y:.1f}" for x, y in map(at, places))
        return " ".join(drawn)

    parts = []
    for thing in found.outlines:
        red, green, blue = (round(255 * part) for part in thing.colour)
        opacity = 0.12 if thing.top_m <= 0.0 else 0.45
        style = f'fill="rgb({red},{green},{blue})" fill-opacity="{opacity}" stroke="#495057" stroke-width="0.5"'
        title = f"<title>{escape(thing.name)}, top at {thing.top_m:.3g} m</title>"
        parts.append(f'<polygon points="{line(thing.corners)}" {style}>{title}</polygon>')
    labels: list[tuple[float, float, str]] = []
    for track in found.tracks:
        title = f"<title>{escape(track.name)}</title>"
        parts.append(f'<polyline points="{line(track.points)}" class="track">{title}</polyline>')
        x, y = at(track.points[-1])
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="#212529">{title}</circle>')
        labels.append((x, y, track.name))
    for name, place in found.standing.items():
        x, y = at(place)
        parts.append(rect(x - 4, y - 4, 8, 8, "#212529", name))
        labels.append((x, y, name))
    for loss in found.losses:
        x, y = at(loss.at)
        title = f"{loss.source} to {loss.destination}: {loss.cause} at {loss.sent_ns / 1e9:.3f} s"
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colours[loss.cause]}" fill-opacity="0.55">'
                     f"<title>{escape(title)}</title></circle>")  # fmt: skip
    parts += _labels(labels)
    length = round_up((high_x - low_x) / 8, WHOLE)
    height = 2 * MARGIN + (high_y - low_y) * scale + 24
    parts.append(f'<path d="M{MARGIN} {height - 8:.1f}h{length * scale:.1f}" stroke="#212529" stroke-width="3"/>')
    parts.append(text(MARGIN, height - 14, f"{length:g} m"))
    return svg(MAP_SIZE, height, parts, label)


def _labels(places: Iterable[tuple[float, float, str]]) -> Iterable[str]:
    """Yield names beside their places, but for those that would stand on another one: they are told when pointed at."""
    taken: list[tuple[float, float, float]] = []
    for x, y, name in places:
        left, right = x + 6, x + 6 + 7 * len(name)
        if all(right < low or left > high or abs(y - at) > 12 for low, high, at in taken):
            taken.append((left, right, y))
            yield text(left, y + 4, name)
