"""The commands `foosim sweep table` and `foosim sweep plot`: what the results of a sweep show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Final

import typer
from rich.cells import cell_len
from rich.console import Console
from rich.table import Table as Shown

from foosim.analysis.picture import HELP, check_picture, new_picture
from foosim.common.errors import BadValue
from foosim.runtime.command import JsonOption, new_app, print_json
from foosim.simulation.study.summary import Group, draw, groups, varied
from foosim.simulation.study.table import Row, Table, read_table

MESSAGES_SHOWN_MAX: Final = 8
WIDTH: Final = 180
"""Of tables where standard output is no terminal, in characters."""
GAP: Final = 2
"""Between two columns."""

app = new_app()

Results = Annotated[Path, typer.Argument(metavar="RESULTS", help="The results of a sweep: .csv, .jsonl or .parquet.")]


@app.command("sweep table")
def sweep_table(
    results: Results,
    metrics: Annotated[
        list[str] | None,
        typer.Option(
            "--metric",
            metavar="NAME",
            help="A metric, or a count as packets.dropped; may be repeated. By default all metrics that differ.",
        ),
    ] = None,
    by: Annotated[
        list[str] | None,
        typer.Option(
            "--by",
            metavar="PATH",
            help="A parameter to group by; may be repeated. By default all; the others are pooled.",
        ),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Show the results of a sweep: a row for each combination of parameters, with the means of its runs.

    A mean has its 95 % interval by Student's t, in brackets, from two runs on; the number of runs follows where some of
    them have no such value. Failed runs count in no mean: their number has a column, and their messages are shown.
    """
    table = read_table(results)
    chosen = list(dict.fromkeys(metrics or varied(table)))
    parameters = list(dict.fromkeys(by or table.parameters))
    found = groups(table, parameters, chosen)
    failures = [row for row in table.rows if row["message"]]
    hidden = len(table.metrics) - len(chosen)
    if json:
        print_json(
            {
                "results": str(results),
                "not_shown": hidden,
                "groups": [_as_json(group, parameters, chosen) for group in found],
                "failures": [_named(row, table) | {"message": row["message"]} for row in failures],
            }
        )
        return
    typer.echo(f"{results}: {_counted(table)}, means with 95 % in brackets")
    _print(found, parameters, chosen)
    if hidden and metrics is None:
        typer.echo(f"not shown: {hidden} of {len(table.metrics)} metrics, equal in all runs (--metric NAME)")
    of_message: dict[str, list[Row]] = {}
    for row in failures:
        of_message.setdefault(row["message"], []).append(row)
    for message, rows in list(of_message.items())[:MESSAGES_SHOWN_MAX]:
        first = " ".join(f"{name}={value}" for name, value in _named(rows[0], table).items())
        typer.echo(f"{len(rows)} failed, first {first}: {message}")
    if len(of_message) > MESSAGES_SHOWN_MAX:
        typer.echo(f"{len(of_message) - MESSAGES_SHOWN_MAX} further messages of failed runs are in {results}")


@app.command("sweep plot")
def sweep_plot(
    results: Results,
    metrics: Annotated[
        list[str],
        typer.Option("--metric", metavar="NAME", help="A metric to draw; may be repeated, for further panels."),
    ],
    x: Annotated[
        str | None, typer.Option("--x", metavar="PATH", help="The parameter to draw against; by default the first.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help=HELP.format("them") + " By default RESULTS with .svg.")
    ] = None,
) -> None:
    """Draw the means of a sweep's metrics against a parameter, with their 95 % intervals.

    Each combination of the other parameters is a curve. Quantities have their place on the axis by their number, in the
    unit of the first; other values stand one after another. Failed runs count in no mean; the title has their number.
    """
    table = read_table(results)
    if not table.parameters:
        raise BadValue(f"{results}: no parameter is varied; there is no axis to draw")
    picture = results.with_suffix(".svg") if out is None else out
    check_picture(picture, "--out")
    with new_picture(picture) as figure:
        title = f"{results.name}: {_counted(table)}, means with 95 %"
        draw(figure, table, x or table.parameters[0], list(dict.fromkeys(metrics)), title)
    typer.echo(str(picture))


def _counted(table: Table) -> str:
    """`40 runs, 2 of them failed`."""
    failed = sum(bool(row["message"]) for row in table.rows)
    return f"{len(table.rows)} run{'s' * (len(table.rows) != 1)}" + (f", {failed} of them failed" if failed else "")


def _named(row: Row, table: Table) -> dict[str, Any]:
    """Return the parameters and the seed of a row."""
    return {name: row[name] for name in (*table.parameters, "seed")}


def _as_json(group: Group, parameters: Sequence[str], metrics: Sequence[str]) -> dict[str, Any]:
    means = {name: (group.mean(name), len(group.values[name])) for name in metrics}
    return {
        "parameters": dict(zip(parameters, group.parameters, strict=True)),
        "runs": group.runs,
        "failed": group.failed,
        "metrics": {name: None if its is None else {**asdict(its), "runs": n} for name, (its, n) in means.items()},
    }


def _print(found: Sequence[Group], parameters: Sequence[str], metrics: Sequence[str]) -> None:
    """Print a table, and further ones with the metrics for which the one before is not wide enough."""
    is_terminal = Console().is_terminal
    console = Console(width=None if is_terminal else WIDTH, highlight=False, markup=False, emoji=False)
    first = [[name, *(group.parameters[index] for group in found)] for index, name in enumerate(parameters)]
    first.append(["runs", *(str(group.runs) for group in found)])
    first.append(["failed", *(str(group.failed) for group in found)])
    columns = list(first)
    for name in metrics:
        column = [name, *(_text(group, name) for group in found)]
        if len(columns) > len(first) and _width([*columns, column]) > console.width:
            console.print(_shown(columns))
            columns = list(first)
        columns.append(column)
    console.print(_shown(columns))


def _width(columns: Sequence[Sequence[str]]) -> int:
    return sum(GAP + max(map(cell_len, column)) for column in columns) - GAP


def _shown(columns: Sequence[Sequence[str]]) -> Shown:
    """Return the table of columns, each with its name first."""
    table = Shown(box=None, header_style="bold", pad_edge=False)
    for column in columns:
        table.add_column(column[0], justify="right", no_wrap=True)
    for row in zip(*(column[1:] for column in columns), strict=True):
        table.add_row(*row)
    return table


def _text(group: Group, metric: str) -> str:
    """`1.25 [0.75, 1.75]`, or `1.25 [0.75, 1.75] of 18` where fewer runs have a value; - where none has."""
    its = group.mean(metric)
    if its is None:
        return "-"
    text = f"{its.value:.4g}" if its.low is None else f"{its.value:.4g} [{its.low:.4g}, {its.high:.4g}]"
    return text if len(group.values[metric]) == group.runs - group.failed else f"{text} of {len(group.values[metric])}"
