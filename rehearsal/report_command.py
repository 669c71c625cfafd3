"""The command `foosim-replay report`: a shell over `report.gather` and `report_page.page`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from foosim.protocol.codec import encode_json
from foosim.protocol.errors import Failed
from foosim.rehearsal.capture_arguments import Capture, Json, reading
from foosim.rehearsal.export import Existing
from foosim.rehearsal.report import gather
from foosim.rehearsal.report_page import page
from foosim.vhub.capture_reader import open_capture


def report(
    capture: Capture,
    out: Annotated[Path, typer.Option("--out", "-o", help="The page to write, HTML.", show_default=False)],
    json: Json = False,
) -> None:
    """Write a page about the network of a captured run.

    Packets by fate and cause, links, delay and loss over time, causes of losses, age of information, queues and
    airtime, events, what was configured beside what was measured, and a map. The page is one file that needs nothing
    else. --json prints what is on it. An existing file is not overwritten.
    """
    if out.exists() or out.is_symlink():
        raise Existing(f"{out}: exists already, and is not overwritten")
    with reading():
        found = gather(open_capture(capture), capture.name)
    try:
        with out.open("x", encoding="utf-8") as file:
            file.write(page(found))
    except FileExistsError:
        raise Existing(f"{out}: exists already, and is not overwritten") from None
    except OSError as error:
        raise Failed(f"{out}: cannot be written, {error.strerror or error}") from None
    if json:
        typer.echo(encode_json(asdict(found)).decode())
    else:
        packets, dropped = found.fates["offered"], found.fates["dropped"]
        typer.echo(f"{out}: {packets} packets on {len(found.links)} links, {dropped} dropped")
