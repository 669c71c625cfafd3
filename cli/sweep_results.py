"""The commands `foosim sweep table` and `foosim sweep plot`: what the results of a sweep show."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Final

import typer
from rich.console import Console
from rich.table import Table as Shown

from foosim.analysis.picture import HELP, check_picture, new_picture
from foosim.common.errors import BadValue
from foosim.runtime.command import JsonOption, new_app, print_json
from foosim.simulation.study.summary import Group, draw, groups, varied
from foosim.simulation.study.table import Table, read_table

WIDTH: Final = 100_000
"""In characters: a table is not cut to the terminal."""
METRIC: Final = "A metric, or a count such as packets.dropped; may be repeated"

app = new_app()

Results = Annotated[Path, typer.Argument(metavar="RESULTS", help="The results of a sweep: .csv, .jsonl or .parquet.")]


@app.command("sweep table")
def sweep_table(
    results: Results,
    metrics: Annotated[
        list[str] | None, typer.Option("--metric", metavar="NAME", help=f"{METRIC}. By default all that differ.")
    ] = None,
    by: Annotated[
        list[str] | None,
        typer.Option("--by", metavar="PATH", help="A parameter to group by, by default all; may be repeated."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Show the results of a sweep: a row for each combination of parameters, with the means of its runs.

    A mean has its 95 % interval by Student's t, in brackets, from two runs on; the number of runs follows where some of
    them have no such value. Failed runs count in no mean: their number has a column, and their messages are shown. With
    --by the runs of all values of the other parameters are in one row.
    """
    table = read_table(results)
    names, parameters = dict.fromkeys(metrics or varied(table)), dict.fromkeys(by or table.parameters)
    found = groups(table, [*parameters], [*names])
    messages = Counter(row["message"] for row in table.rows if row["message"])
    hidden = len({*table.metrics} - {*names})
    if json:
        rows = [
            {
                "parameters": dict(zip(parameters, group.parameters, strict=True)),
                "runs": group.runs,
                "failed": group.failed,
                "metrics": {name: (its := group.mean(name)) and asdict(its) for name in names},
                "values": {name: len(group.values[name]) for name in names},
            }
            for group in found
        ]
        print_json({"groups": rows, "not_shown": hidden, "messages": messages})
        return
    shown = Shown(box=None, header_style="bold", pad_edge=False)
    for name in (*parameters, "runs", "failed", *names):
        shown.add_column(name, justify="right", no_wrap=True)
    for group in found:
        means = [_text(group, name) for name in names]
        shown.add_row(*group.parameters, str(group.runs), str(group.failed), *means)
    typer.echo(f"{results}: {_counted(table)}, means with 95 % in brackets")
    Console(width=WIDTH, highlight=False, markup=False, emoji=False).print(shown)
    if hidden and not metrics:
        typer.echo(f"not shown: {hidden} of {len(table.metrics)} metrics, equal in all runs (--metric NAME)")
    for message, count in messages.most_common():
        typer.echo(f"{count} failed: {message}")


@app.command("sweep plot")
def sweep_plot(
    results: Results,
    metrics: Annotated[list[str], typer.Option("--metric", metavar="NAME", help=f"{METRIC}, for further panels.")],
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
    picture = out or results.with_suffix(".svg")
    check_picture(picture, "--out")
    with new_picture(picture) as figure:
        title = f"{results.name}: {_counted(table)}, means with 95 %"
        draw(figure, table, x or table.parameters[0], [*dict.fromkeys(metrics)], title)
    typer.echo(str(picture))


def _counted(table: Table) -> str:
    """`40 runs, 2 failed`."""
    runs, failed = len(table.rows), sum(bool(row["message"]) for row in table.rows)
    return f"{runs} run{'s' * (runs != 1)}, {failed} failed"


def _text(group: Group, metric: str) -> str:
    """`1.25 [0.75, 1.75]`, or `1.25 [0.75, 1.75] of 18` where fewer runs have a value; - where none has."""
    its, count = group.mean(metric), len(group.values[metric])
    if its is None:
        return "-"
    text = f"{its.value:.4g}" if its.low is None else f"{its.value:.4g} [{its.low:.4g}, {its.high:.4g}]"
    return text if count == group.runs - group.failed else f"{text} of {count}"
