"""The commands `foosim capture export`, `cut` and `diff`.

They are shells over `export.export_capture`, `vhub.capture_cut.cut_capture` and `diff.diff_captures`.
"""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, get_args

import typer

from foosim.capture.cut import cut_capture
from foosim.capture.diff import Diff, Difference, diff_captures
from foosim.capture.export import STANDARD_OUTPUT, Format, export_capture
from foosim.capture.pictures import export_pictures
from foosim.capture.tables import table_names
from foosim.cli.capture.options import Capture, reading, time_of
from foosim.common.errors import BadValue, UnknownName
from foosim.runtime.command import DONE, FAILED, JsonOption, print_json
from foosim.simulation.verify import simulated_again

IMAGES = ("png", "mcap")
_TABLES = ", ".join(table_names())


def export(  # noqa: PLR0913, PLR0917  # a command's options
    capture: Capture,
    out: Annotated[Path, typer.Option("--out", "-o", help="The file to write; - is standard output.")],
    what: Annotated[str, typer.Option(help=f"The table: {_TABLES}.")] = "packets",
    form: Annotated[
        str | None, typer.Option("--format", help="csv or parquet; by default from the file's suffix, csv for -.")
    ] = None,
    images: Annotated[
        str | None, typer.Option(help="Write pictures of cameras instead: png (a new folder) or mcap (for viewers).")
    ] = None,
    video: Annotated[bool, typer.Option("--video", help="Write a video of one camera, by ffmpeg.")] = False,
    camera: Annotated[
        list[str] | None,
        typer.Option(
            help="ROBOT/CHANNEL of cameras, with * and ?; may be repeated. overview, with --video: the world."
        ),
    ] = None,
    begin: Annotated[str | None, typer.Option("--from", help="Time of the first picture, e.g. 10s.")] = None,
    end: Annotated[str | None, typer.Option("--to", help="Time of the last picture, e.g. 20s.")] = None,
    json: JsonOption = False,
) -> None:
    """Write a table of a capture as CSV or Parquet, or pictures of its cameras.

    `packets` has a row per offered packet, `commands` a row per decoded command to a robot, `poses` a row per link and
    captured pose; the other tables have the capture's rows of that name. Times are simulated time in integer ns.
    Parquet needs pyarrow: pip install 'foosim[parquet]'. An existing file is not overwritten.

    Pictures are those of captured packets. A camera without packets is drawn at its ticks, from captured frames or by
    simulating again. Depth is in mm (png) or m (mcap); segmentation has numbers of things. A video of `overview` has
    the captured frames.
    """
    if images is not None or video:
        if what != "packets" or form is not None:
            raise BadValue("--what and --format are of tables, not of --images and --video", form or what)
        if out == STANDARD_OUTPUT:
            raise BadValue("--out: pictures need a folder or a file", str(out))
        _export_pictures(capture, out, images, video, camera or ["*"], (begin, end), json)
        return
    if camera or begin or end:
        given = ", ".join(filter(None, [*(camera or []), begin, end]))
        raise BadValue("--camera, --from and --to are of --images and --video", given)
    with reading():
        done = export_capture(capture, what, out, _format(form))
    if json:
        columns = [asdict(column) for column in done.columns]
        content = {"path": str(done.path), "table": what, "rows": done.rows, "columns": columns}
        print_json(content, sys.stderr if out == STANDARD_OUTPUT else None)
    elif out != STANDARD_OUTPUT:
        typer.echo(f"{done.path}: {done.rows} rows of {what}, {len(done.columns)} columns")


def _export_pictures(
    capture: Path,
    out: Path,
    images: str | None,
    video: bool,
    cameras: list[str],
    span: tuple[str | None, ...],
    json: bool,
) -> None:
    if images is not None and video:
        raise BadValue("--images and --video are two exports", images)
    if images is not None and images not in IMAGES:
        raise UnknownName("--images: not a kind of pictures", images, IMAGES)
    first_ns, last_ns = time_of("--from", span[0]) or 0, time_of("--to", span[1])
    if last_ns is not None and last_ns < first_ns:
        raise BadValue("--to is before --from", f"{span[1]} and {span[0]}")
    with reading():
        count = export_pictures(capture, out, images or "video", cameras, (first_ns, last_ns), simulated_again)
    if json:
        print_json({"path": str(out), "pictures": count})
    else:
        typer.echo(f"{out}: {count} pictures")


def _format(text: str | None) -> Format | None:
    formats: tuple[Format, ...] = get_args(Format)
    for known in formats:
        if text == known:
            return known
    if text is None:
        return None
    raise UnknownName("--format: not a format", text, formats)


def cut(
    capture: Capture,
    out: Annotated[Path, typer.Option("--out", "-o", help="The capture to write.")],
    begin: Annotated[str | None, typer.Option("--from", help="Time at which it begins, e.g. 10s.")] = None,
    end: Annotated[str | None, typer.Option("--to", help="Time at which it ends, e.g. 20s.")] = None,
    json: JsonOption = False,
) -> None:
    """Write a part of a capture as a new capture.

    It begins with the newest captured frame at or before --from and ends at --to, with the times of the original. A
    run can start with its frames (`up --from`). `verify` needs --from-first-frame, since the ticks before are missing.
    """
    from_ns, to_ns = time_of("--from", begin), time_of("--to", end)
    with reading():
        done = cut_capture(capture, out, from_ns, to_ns)
    if json:
        print_json({**asdict(done), "path": str(done.path)})
        return
    first, last = (tick * done.tick_ns / 1e9 for tick in (done.first_tick, done.last_tick))
    typer.echo(
        f"{done.path}: frames {done.first_tick} to {done.last_tick}, {first:g} s to {last:g} s, "
        f"{done.messages} messages, {done.bytes / 1e6:.1f} MB"
    )


def diff(
    one: Annotated[Path, typer.Argument(metavar="A", help="A capture.")],
    other: Annotated[Path, typer.Argument(metavar="B", help="Another one.")],
    ignore: Annotated[
        list[str] | None,
        typer.Option(help="Do not compare this field (digest) or channel (/epochs); may be repeated."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Compare two captures: the first difference of each channel, and the number of rows in both.

    Fields that begin with `wall_`, and `/log`, depend on real clocks and are not compared. Differences of the metadata
    (run, versions, deployment) are printed and do not count.

    Exit codes: 0 equal, 1 different, 2 a capture cannot be read.
    """
    with reading():
        found = diff_captures(one, other, ignore or ())
    if json:
        print_json(_diff_json(found))
    else:
        print(_diff_text(found))
    raise typer.Exit(DONE if found.equal else FAILED)


def _diff_json(found: Diff) -> dict[str, Any]:
    channels = {
        topic: {"rows": channel.rows, "equal": channel.equal, "first": _difference_json(channel.first)}
        for topic, channel in found.channels.items()
    }
    return {
        "equal": found.equal,
        "first": _difference_json(found.first),
        "channels": channels,
        "about": list(found.about),
    }


def _difference_json(difference: Difference | None) -> dict[str, Any] | None:
    return None if difference is None else asdict(difference)


def _diff_text(found: Diff) -> str:
    lines = []
    if found.first is None:
        rows = sum(channel.equal for channel in found.channels.values())
        lines.append(f"equal: {rows} rows of {len(found.channels)} channels")
    else:
        lines += ["different, first here:", *_difference_lines(found.first)]
    lines.append("channels")
    for topic, channel in found.channels.items():
        a, b = channel.rows
        count = f"{a} rows" if a == b else f"{a} rows and {b}"
        state = "equal" if channel.first is None else f"the first {channel.equal} equal"
        lines.append(f"  {topic}: {count}, {state}")
        if channel.first is not None and channel.first is not found.first:
            lines += [f"  {line}" for line in _difference_lines(channel.first)]
    if found.about:
        lines.append(f"different metadata: {', '.join(found.about)}")
    return "\n".join(lines)


def _difference_lines(found: Difference) -> list[str]:
    place = f"{found.topic} at {found.time_ns / 1e9:.9g} s (tick {found.tick}), row {found.row}"
    return [f"  {place}{f', {found.field}' if found.field else ''}", f"    A: {found.a}", f"    B: {found.b}"]
