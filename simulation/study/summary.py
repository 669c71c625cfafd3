"""What the table of a sweep shows: rows with equal parameters as a group, the mean of each metric in it, a picture.

Means have their 95 % interval by Student's t. Rows of runs that failed count in no mean; each group has their number.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from foosim.analysis.intervals import Interval, bars_of, mean
from foosim.common.errors import BadValue, UnknownName
from foosim.common.units import in_one_unit
from foosim.simulation.study.table import COUNTS, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CURVES_MAX: Final = 10
"""As there are colours."""
SPREAD: Final = 0.01
"""Between the marks of neighbouring curves, as a share of the axis: no interval hides another."""


@dataclass(slots=True)
class Group:
    """The runs with these texts of parameters, the failed ones among them, and the values by metric of the others.

    A run without a value of a metric adds none.
    """

    parameters: tuple[str, ...]
    runs: int = 0
    failed: int = 0
    values: dict[str, list[float]] = field(default_factory=dict)

    def mean(self, metric: str) -> Interval | None:
        """Return the mean of a metric, None where no run has it."""
        values = self.values[metric]
        return mean(values) if values else None


def groups(table: Table, by: Sequence[str], metrics: Sequence[str]) -> list[Group]:
    """Return the groups with equal parameters `by`, in the order of their first rows; metrics may be counts, too.

    Raises UnknownName for names that the table does not have.
    """
    for name in by:
        if name not in table.parameters:
            raise UnknownName("no such parameter", name, table.parameters)
    known = (*table.metrics, *COUNTS)
    for name in metrics:
        if name not in known:
            raise UnknownName("no such metric", name, known)
    found: dict[tuple[str, ...], Group] = {}
    for row in table.rows:
        key = tuple(row[name] for name in by)
        group = found.setdefault(key, Group(key, values={metric: [] for metric in metrics}))
        group.runs += 1
        group.failed += bool(row["message"])
        for metric in () if row["message"] else metrics:
            if metric in row:
                group.values[metric].append(row[metric])
    return list(found.values())


def varied(table: Table) -> list[str]:
    """Return the metrics that differ between runs."""
    worked = [row for row in table.rows if not row["message"]]
    return [metric for metric in table.metrics if len({row.get(metric) for row in worked}) > 1]


def draw(figure: Figure, table: Table, x: str, metrics: Sequence[str], title: str) -> None:
    """Draw a panel for each metric: its means against the parameter `x`, a curve for each combination of the others.

    Quantities of one dimension have a place by their number, other values one after another. Raises UnknownName, and
    BadValue for too many curves and for none.
    """
    others = [name for name in table.parameters if name != x]
    found = groups(table, [x, *others], metrics)
    for metric in metrics:
        if not any(group.values[metric] for group in found):
            raise BadValue("no run has a value of the metric", metric)
    curves: dict[tuple[str, ...], list[Group]] = {}
    for group in found:
        curves.setdefault(group.parameters[1:], []).append(group)
    if len(curves) > CURVES_MAX:
        what = f"the other parameters have more than {CURVES_MAX} combinations, each a curve"
        raise BadValue(f"{x}: {what}", len(curves))
    texts = list(dict.fromkeys(group.parameters[0] for group in found))
    numbers, unit = in_one_unit(texts) or ([float(number) for number in range(len(texts))], None)
    places = dict(zip(texts, numbers, strict=True))
    step = SPREAD * ((max(numbers) - min(numbers)) or 1.0)
    figure.set_size_inches(8.0, 1.0 + 3.5 * len(metrics))
    figure.suptitle(title)
    for axes, metric in zip(figure.subplots(len(metrics), squeeze=False)[:, 0], metrics, strict=True):
        for number, (values, its) in enumerate(curves.items()):
            points = sorted((group for group in its if group.values[metric]), key=lambda one: places[one.parameters[0]])
            at = [places[group.parameters[0]] + step * number for group in points]
            means, bars = bars_of([mean(group.values[metric]) for group in points])
            name = ", ".join(f"{other}={value}" for other, value in zip(others, values, strict=True))
            axes.errorbar(at, means, bars, fmt="o-", color=f"C{number}", markersize=4, elinewidth=1, label=name)
        axes.set_ylabel(metric)
        axes.set_xlabel(f"{x}, {unit}" if unit else x)
        axes.grid(axis="y", color="0.9")
        if unit is None:
            axes.set_xticks(numbers, texts)
        if others:
            axes.legend()
