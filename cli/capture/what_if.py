"""The command `foosim capture what-if`: a shell over `what_if.what_if` and `what_if_chart.draw`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from foosim.analysis.picture import HELP, check_picture, new_picture
from foosim.capture.reader import CaptureData, open_capture
from foosim.cli.capture.options import Capture, reading
from foosim.common.errors import BadValue
from foosim.deployment.loader import Text, load_deployment, with_network
from foosim.deployment.schema import Deployment
from foosim.deployment.text.files import read_files, read_source_file
from foosim.runtime.command import JsonOption, print_json
from foosim.simulation import what_if as calculation
from foosim.simulation.what_if import CHANGED_KEPT, LinkChange, PacketChange, WhatIf
from foosim.simulation.what_if_chart import draw
from foosim.vhub.network.custom_models import check_link_models, differing_models

LINKS_SHOWN = 40


def what_if(
    capture: Capture,
    network: Annotated[
        Path | None,
        typer.Option(help="A deployment, or a file with its `network:` section alone."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", help="Change a network setting, e.g. network.links.everything.loss='5 %'; may be repeated."
        ),
    ] = None,
    packets: Annotated[bool, typer.Option("--packets", help="List each packet that changed.")] = False,
    drawing: Annotated[Path | None, typer.Option("--picture", help=HELP.format("the changes per link"))] = None,
    json: JsonOption = False,
) -> None:
    """Send a capture's packets through another network.

    Robots and clients send the captured packets: how they would have reacted to the other network is unknown. Prints
    deliveries, delay and age of information per link, and the age at use per channel. With the captured network every
    fate is the captured one.
    """
    if drawing is not None:
        check_picture(drawing)
    with reading():
        opened = open_capture(capture)
        deployment = _deployment(opened, network, settings or [])
        for line in differing_models(deployment.network, opened.about.versions):
            typer.echo(f"warning: {line}", err=True)
        found = calculation.what_if(opened, deployment)
    for line in found.caveats:
        typer.echo(f"warning: {capture}: {line}", err=True)
    if drawing is not None:
        with new_picture(drawing) as figure:
            draw(figure, found, capture.name)
    if json:
        content = asdict(found)
        print_json(content if packets else {**content, "changes": []})
        return
    earlier = f", {found.earlier} sent before it begins" if found.earlier else ""
    typer.echo(f"{found.packets} packets, {found.changed} changed{earlier}")
    _show_links(found)
    if packets:
        for change in found.changes:
            typer.echo(_line(change))
        if found.changed > len(found.changes):
            typer.echo(f"and {found.changed - len(found.changes)} more: the first {CHANGED_KEPT} are named")


def _deployment(capture: CaptureData, network: Path | None, settings: list[str]) -> Deployment:
    """Return the capture's deployment with other settings of its network; its world stays."""
    for setting in settings:
        if not setting.startswith("network.") and not (setting.startswith("scenery.") and ".radio" in setting):
            problem = "not a setting of the network: network.KEY=VALUE, or scenery.NAME.radio=MATERIAL"
            raise BadValue(f"--set: {problem}", setting)
    if network is None and not settings:
        return capture.deployment
    about = capture.about
    other: tuple[Text, str] | None = None if network is None else (read_source_file(network), str(network))
    text = with_network(about.deployment_text, about.deployment_name, other, settings)
    deployment = load_deployment(text, about.deployment_name)
    written, name = other or (about.deployment_text, about.deployment_name)
    check_link_models(deployment.network, written, name, settings)
    lacking = {path: digest for path, digest in deployment.files().items() if path not in about.files}
    folder = Path() if network is None else network.parent
    return deployment.with_assets({**about.files, **(read_files(folder, ".", lacking) if lacking else {})})


def _show_links(found: WhatIf) -> None:
    table = Table(box=None, header_style="bold", pad_edge=False)
    for name in ("from", "to", "offered", "delivered", "then", "delay ms", "then", "p95 ms", "then", "age ms", "then"):
        table.add_column(name, justify="left" if name in ("from", "to") else "right", no_wrap=True)
    shown = sorted(found.links, key=_weight)[:LINKS_SHOWN]
    for link in sorted(shown, key=lambda link: (link.source, link.destination)):
        before, after = link.before, link.after
        table.add_row(
            link.source,
            link.destination,
            str(link.offered),
            *(_share(side.delivered, link.offered) for side in (before, after)),
            *(f"{side.delay_mean_ms:.2f}" for side in (before, after)),
            *(f"{side.delay_p95_ms:.2f}" for side in (before, after)),
            *(f"{side.age_ms:.1f}" for side in (before, after)),
        )
    Console(width=None if Console().is_terminal else 160, highlight=False).print(table)
    if len(found.links) > LINKS_SHOWN:
        typer.echo(f"and {len(found.links) - LINKS_SHOWN} links that changed less: --json has all")
    _show_ages(found)
    for title, causes in (("dropped by", found.causes), ("then by", found.new_causes)):
        typer.echo(f"{title} " + (", ".join(f"{count} {cause}" for cause, count in causes.items()) or "nothing"))


def _show_ages(found: WhatIf) -> None:
    """Show the ages of channels when their receivers act: the effect of the network on a controller."""
    if not found.ages:
        return
    table = Table(box=None, header_style="bold", pad_edge=False)
    for name in ("from", "to", "channel", "uses", "then", "age at use ms", "then", "p99 ms", "then"):
        table.add_column(name, justify="left" if name in ("from", "to", "channel") else "right", no_wrap=True)
    shown = sorted(found.ages, key=lambda age: -abs(age.after.p99_ms - age.before.p99_ms))[:LINKS_SHOWN]
    for age in sorted(shown, key=lambda age: (age.source, age.destination, age.channel)):
        sides = age.before, age.after
        uses = (str(side.uses) for side in sides)
        times = (f"{ms:.1f}" for ms in (*(side.p50_ms for side in sides), *(side.p99_ms for side in sides)))
        table.add_row(age.source, age.destination, age.channel, *uses, *times)
    Console(width=None if Console().is_terminal else 160, highlight=False).print(table)
    if len(found.ages) > LINKS_SHOWN:
        typer.echo(f"and {len(found.ages) - LINKS_SHOWN} channels whose age changed less: --json has all")


def _weight(link: LinkChange) -> tuple[float, str, str]:
    """Return the sort key of a link: the greatest change comes first."""
    change = abs(link.after.delivered - link.before.delivered) + abs(link.after.age_ms - link.before.age_ms)
    return -change, link.source, link.destination


def _share(delivered: int, offered: int) -> str:
    return f"{100 * delivered / offered:.1f} %" if offered else "-"


def _line(change: PacketChange) -> str:
    where = f"{change.source}:{change.sequence}:{change.destination}" + (f":{change.copy}" if change.copy else "")
    return f"{change.sent_ns / 1e9:.3f} s {where} {change.channel}: {_fate(change, old=True)} -> {_fate(change)}"


def _fate(change: PacketChange, *, old: bool = False) -> str:
    fate, cause, due_ns = (
        (change.fate, change.cause, change.due_ns) if old else (change.new_fate, change.new_cause, change.new_due_ns)
    )
    if not fate:
        return "not made"
    if cause:
        return f"{fate} {cause}"
    return f"{fate} after {(due_ns - change.sent_ns) / 1e6:.3f} ms"
