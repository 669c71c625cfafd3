"""The command `foosim net`: analyses networks, explains packets, and disturbs live runs.

Each subcommand is a thin shell over typed functions: `vhub.lint`, `vhub.explain`, `links_shown`, `control`.
"""

from __future__ import annotations

import sys
import threading
from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Final

import typer
from rich.console import Console
from rich.live import Live

from foosim.analysis.explain import explain_packet, parse_packet
from foosim.analysis.network_tables import RANGE_NOTE, link_line, link_table, links_shown, summary_tables, use_text
from foosim.analysis.sources import parameters_of
from foosim.capture.reader import open_capture
from foosim.cli.control import show_answer
from foosim.client import control
from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, load_deployment, load_network
from foosim.deployment.network.presets import PRESETS, provenance
from foosim.deployment.network.traces import check_files, network_files
from foosim.deployment.overrides import nested
from foosim.deployment.schema import places
from foosim.deployment.text.files import read_files, read_source_file
from foosim.protocol.channels import VHUB
from foosim.runtime.command import JsonOption, RunOption, new_app, print_json
from foosim.runtime.process import Stop
from foosim.vhub.links.summary import LinkSummary, summaries, summary_of, uses_alone
from foosim.vhub.links.summary_text import meaning_lines
from foosim.vhub.network.custom_models import check_link_models

app = new_app()

Lasts = Annotated[
    str | None, typer.Option("--for", help="Duration in simulated time, e.g. 10s; by default until `heal`.")
]
Random = Annotated[
    bool, typer.Option("--random", help="Draw the duration from an exponential distribution; --for is its mean.")
]
EVERY_S: Final = 1.0
ALONE: Final = (
    "a network section without its deployment: the selectors match no endpoints; rules are shown for all radios"
)


@app.callback()
def net_group() -> None:
    """Analyse a network, and disturb the network of a live run.

    `lint` and `presets` show what a configuration means, `explain` the fate of a captured packet and its cause, `top`
    the links of a live run. The other commands disturb a live run from the tick that they print; they are recorded
    with the orders, so a re-simulation repeats them.

    Exit codes: 0 done, 1 failed, 2 bad input, 3 refused, 130 second Ctrl-C.
    """


@app.command()
def lint(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="A deployment, or a file with its network section alone."),
    ],
    sets: Annotated[list[str] | None, typer.Option("--set", help="Change the file; may be repeated.")] = None,
    json: JsonOption = False,
) -> None:
    """Print the figures of a network, per rule and radio, with warnings of likely mistakes.

    Figures are: mean loss without geometry, mean bursts, delay, airtime, maximum throughput of one and of ten
    stations, range, duty cycle, and the delay of a full queue. All problems of a file are printed at once. Custom link
    models are imported, unless the vHub runs on another machine.
    """
    found, is_alone = linted(file, sets or [])
    if json:
        print_json({"alone": is_alone, "rules": [asdict(summary) for summary in found]})
        return
    console = Console()
    if is_alone:
        _say(console, ALONE)
    if console.is_terminal:
        for table in summary_tables(found):
            console.print(table, "")
        for summary in found:
            for warning in summary.warnings:
                _say(console, f"warning: {summary.name}: {warning}")
    else:
        for line in meaning_lines(found):
            _say(console, line)
    if any(summary.range_los_m is not None for summary in found):
        _say(console, RANGE_NOTE)


def linted(file: Path, sets: list[str]) -> tuple[list[LinkSummary], bool]:
    """Return the analysis of a file's network, and whether the file has no deployment.

    Raises DeploymentError or AssetError.
    """
    name, text = str(file), read_source_file(file)
    network = load_network(text, name, sets)
    if network is None:
        pinned, files = pin_assets(apply_sets(text, name, sets), name, file.parent)
        deployment = load_deployment(pinned, name).with_assets(files)
        if VHUB not in places(deployment):  # else its machine has them, and checks them
            check_link_models(deployment.network, text, name, sets)
        return summaries(deployment), False
    files = read_files(file.parent, ".", network_files(network))
    check_files(network, files)
    check_link_models(network, text, name, sets)
    return [summary_of(use, files) for use in uses_alone(network)], True


@app.command()
def presets(
    name: Annotated[str | None, typer.Argument(help="Name of a preset; by default all.")] = None,
    json: JsonOption = False,
) -> None:
    """Print the values of presets, the numbers of their media, and the source of each.

    [S] read in a standard's reference code or a project's source, [M] measured in a cited paper, [C] computed from
    such, [R] recalled from a standard that was not at hand: unverified, [J] judgement.
    """
    if name is not None and name not in PRESETS:
        raise UnknownName("no such preset", name, PRESETS)
    chosen = {one: [*provenance(one), *parameters_of(one)] for one in ([name] if name is not None else PRESETS)}
    if json:
        content = {
            one: [{"key": key, "value": value, "source": source} for key, value, source in rows]
            for one, rows in chosen.items()
        }
        print_json(content)
        return
    for one, rows in chosen.items():
        print(one)
        width = max(len(f"{key}: {value}") for key, value, _ in rows)
        for key, value, source in rows:
            print(f"  {f'{key}: {value}':{min(width, 48)}}  {source}")


@app.command()
def explain(
    capture: Annotated[Path, typer.Argument(metavar="CAPTURE", help="A capture.")],
    packet: Annotated[
        str,
        typer.Argument(metavar="PACKET", help="SOURCE:SEQUENCE[:DESTINATION[:COPY]]."),
    ],
    json: JsonOption = False,
) -> None:
    """Print the stages of a captured packet with their numbers, and its fate.

    PACKET is SOURCE:SEQUENCE[:DESTINATION[:COPY]], e.g. camera:655360:player-red. The sequence number of a robot's
    packet is its tick times 65536 plus its place among those of that tick. Where it had one receiver, the destination
    may be left out; copy 1 is the one that the link made. Draws are made again from their address, which the capture
    has, and have to agree with it.
    """
    which = parse_packet(packet)
    explained = explain_packet(open_capture(capture), which)
    if json:
        print_json(asdict(explained))
        return
    print(explained.head)
    width = max(len(step.stage) for step in explained.steps)
    for step in explained.steps:
        print(f"  {step.stage:{width}}  {step.text}")
    print(explained.verdict)


@app.command()
def top(
    run: RunOption = None,
    once: Annotated[bool, typer.Option("--once", help="Print the totals since the start, once.")] = False,
    json: JsonOption = False,
) -> None:
    """Show the links of a live run, those with the most traffic first, until Ctrl-C.

    Traffic is packets offered in a second of simulated time. With --json, or without a terminal, a block a second.
    """
    console = Console()
    with control.connect(run) as desk:
        if once:
            status = desk.status()
            _show_links(console, None, status, links_shown(status), json)
            return
        ended = threading.Event()
        Stop().then(ended.set)
        before: dict[str, Any] | None = None
        live = Live(console=console, auto_refresh=False) if console.is_terminal and not json else None
        with live or nullcontext():
            while not ended.is_set():
                try:
                    status = desk.status(give_up=ended.is_set)
                except control.NoAnswer:
                    if ended.is_set():
                        return
                    raise
                _show_links(console, live, status, links_shown(status, before), json)
                if status["state"] in ("ended", "failed"):
                    return
                before = status
                ended.wait(EVERY_S)


def _show_links(
    console: Console, live: Live | None, status: dict[str, Any], links: list[dict[str, Any]], json: bool
) -> None:
    if json:
        print_json({"run": status["run"], "tick": status["ticks"], "links": links})
        return
    title = f"run {status['run']} · tick {status['ticks']} · {use_text(status)}"
    if live is not None:
        live.update(link_table(links[: max(1, console.height - 4)], title), refresh=True)
        return
    _say(console, title)
    for link in links:
        _say(console, f"  {link_line(link)}")
    sys.stdout.flush()


def _say(console: Console, line: str) -> None:
    console.print(line, markup=False, highlight=False, soft_wrap=True)


# --- events ----------------------------------------------------------------------------------------------------------


@app.command("set")
def set_link(
    link: Annotated[str, typer.Argument(help="The id of a link rule.")],
    settings: Annotated[list[str], typer.Argument(metavar="KEY=VALUE...", help="e.g. loss=5% delay='20 ms'.")],
    run: RunOption = None,
    json: JsonOption = False,
) -> None:
    """Change settings of a link rule until `heal settings`.

    Keys are those of a rule, with dots for keys of mappings: burst.loss=1% burst.mean_bad=20ms. A mapping is written
    whole.
    """
    show_answer(control.request("network", run, event={"set": {**nested(settings), "link": link}}), json)


@app.command()
def partition(
    groups: Annotated[
        list[str],
        typer.Argument(metavar="GROUP GROUP...", help="Endpoints with commas, or rest for all others."),
    ],
    lasts: Lasts = None,
    random: Random = False,
    one_way: Annotated[bool, typer.Option("--one-way", help="Drop only packets from the first group.")] = False,
    run: RunOption = None,
    json: JsonOption = False,
) -> None:
    """Drop packets between endpoints of different groups."""
    event = {"partition": [_split(group) for group in groups], **_for(lasts, random)}
    show_answer(control.request("network", run, event=event | ({"symmetric": False} if one_way else {})), json)


@app.command()
def clog(
    source: Annotated[str, typer.Argument(metavar="FROM", help="Endpoints, with commas.")],
    destination: Annotated[str, typer.Argument(metavar="TO", help="Endpoints, with commas.")],
    lasts: Lasts = None,
    random: Random = False,
    run: RunOption = None,
    json: JsonOption = False,
) -> None:
    """Delay packets to the end of the clog; then all arrive at once, in order."""
    ends = {"from": _split(source), "to": _split(destination)}
    show_answer(control.request("network", run, event={"clog": ends, **_for(lasts, random)}), json)


@app.command()
def heal(
    what: Annotated[str, typer.Argument(help="all, partitions, clogs or settings.")] = "all",
    run: RunOption = None,
    json: JsonOption = False,
) -> None:
    """End disturbances of the network; clogged packets are released at once."""
    show_answer(control.request("network", run, event={"heal": what}), json)


def _split(text: str) -> list[str]:
    return [name.strip() for name in text.split(",")]


def _for(lasts: str | None, random: bool) -> dict[str, Any]:
    if lasts is None:
        if random:
            raise BadValue("--random needs --for, the mean")
        return {}
    return {"for": {"exponential": lasts} if random else lasts}
