"""The command `foosim capture report`: a shell over `gather` and `page` of `console.report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from foosim.capture.new_file import check_name, new_file
from foosim.capture.reader import open_capture
from foosim.cli.capture.options import Capture, reading
from foosim.console.report.collect import gather
from foosim.console.report.page import page
from foosim.runtime.command import JsonOption, print_json


def report(
    capture: Capture,
    out: Annotated[Path, typer.Option("--out", "-o", help="The page to write, NAME.html.")],
    json: JsonOption = False,
) -> None:
    """Write an HTML report about the network of a captured run.

    The report has packets by fate and cause, links, delay and loss over time, causes of losses, age of information,
    queues and airtime, events, configured and measured figures, and a map. It is one file without external resources.
    --json prints its content. An existing file is not overwritten.
    """
    check_name("--out", out, "the page", (".html", ".htm"))
    with reading():
        found = gather(open_capture(capture), capture.name)
    with new_file(out) as part:
        part.write_text(page(found), encoding="utf-8")
    if json:
        print_json(found)
    else:
        fates, links = found["fates"], len(found["links"])
        typer.echo(f"{out}: {fates['offered']} packets on {links} links, {fates['dropped']} dropped")
