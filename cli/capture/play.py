"""The commands `foosim capture play` and `control`: shells over `play_capture` and `hear_replay`."""

from __future__ import annotations

import os
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from foosim.cli.capture.options import Capture, reading, time_of
from foosim.client.replay_listener import hear_replay
from foosim.common.addresses import LOOPBACK
from foosim.common.errors import BadValue, UnknownName, read_at
from foosim.common.limits import LAG_ANCHOR_NS
from foosim.common.units import TIME, parse_ns, parse_pace
from foosim.runtime.command import DONE, FAILED, PKI_VARIABLE, JsonOption, PkiOption, print_json
from foosim.runtime.process import Stop
from foosim.simulation.play.address_file import newest_replay
from foosim.simulation.play.main import PlayOptions, PlayResult, Stopper, play_capture
from foosim.simulation.play.requests import ARGUMENTS, SEEK, STEP
from foosim.simulation.play.terminal import Lines


def play(  # noqa: PLR0913, PLR0917  # a command's options
    capture: Capture,
    begin: Annotated[str | None, typer.Option("--from", help="Start time in the capture, e.g. 12.5s.")] = None,
    until: Annotated[str | None, typer.Option(help="End time in the capture.")] = None,
    rate: Annotated[str, typer.Option(help="realtime, fast, or a factor such as 2x.")] = "realtime",
    loop: Annotated[bool, typer.Option("--loop", help="Start again at the end.")] = False,
    paused: Annotated[bool, typer.Option("--paused", help="Start paused.")] = False,
    topic: Annotated[
        list[str] | None,
        typer.Option(help="Publish only this topic: /packets, /packets/camera, /tf, ...; may be repeated."),
    ] = None,
    remap: Annotated[
        list[str] | None,
        typer.Option(help="Rename OLD:=NEW (endpoint or body) or /OLD:=/NEW (channel); may be repeated."),
    ] = None,
    listen: Annotated[str, typer.Option(help="HOST[:PORT] to listen at.")] = LOOPBACK,
    insecure: Annotated[
        bool, typer.Option("--insecure", help="Listen for other machines without certificates.")
    ] = False,
    pki: PkiOption = None,
    json: JsonOption = False,
) -> None:
    """Publish captured packets, poses, scenes, logs and rows, at the times at which they were released.

    Programs subscribe with `foosim.client.replay_listener.hear_replay`. Topics are /packets/SOURCE/DESTINATION/CHANNEL,
    /tf for poses, and all topics of the capture; /tick and /frame are published only with --topic. An unfinished
    capture is played up to its last whole chunk.

    Keys in a terminal: space pauses and resumes, s steps a tick, up and down double and halve the rate, left and right
    seek by 5 s, q quits. `foosim capture control` controls the replay from another terminal. Ctrl-C ends it in order.

    Exit codes: 0 played or stopped, 1 the capture is damaged, 2 bad input, 3 refused.
    """
    options = PlayOptions(
        time_of("--from", begin),
        time_of("--until", until),
        read_at("--rate", parse_pace, rate),
        loop,
        paused,
        tuple(topic or ()),
        tuple(remap or ()),
        listen,
        insecure,
        pki,
    )
    stopper = Stopper()
    Stop().then(stopper.stop)
    lines = Lines(sys.stderr if json else sys.stdout)
    with reading():
        result = play_capture(capture, options, lines, stopper)
    if json:
        print_json(asdict(result))
    else:
        lines.print(_played_text(result))
    raise typer.Exit(FAILED if result.failed else DONE)


def _played_text(result: PlayResult) -> str:
    rounds = f" in {result.rounds} rounds" if result.rounds > 1 else ""
    lines = [f"{result.published} published{rounds}, up to {result.time_ns / 1e9:g} s: {result.reason}"]
    if result.late_ns_max:
        lines.append(f"late by {result.late_ns_max / 1e6:.2f} ms at most")
    if result.slips:
        lines.append(f"{result.slips} times late by more than {LAG_ANCHOR_NS / 1e6:g} ms: the time was held back")
    if result.too_large:
        lines.append(f"{result.too_large} rows are too large for a message and were not published")
    return "\n".join(lines)


def control(
    request: Annotated[str, typer.Argument(help=f"One of {', '.join(ARGUMENTS)}.")],
    value: Annotated[
        str | None, typer.Argument(help="A number of ticks (step), a time (seek) or a rate (rate).")
    ] = None,
    address: Annotated[str | None, typer.Option(help="Address of the replay; by default this user's newest.")] = None,
    pki: PkiOption = None,
    json: JsonOption = False,
) -> None:
    """Control a running replay: pause, resume, step [N], seek 12.5s, rate 2x, stop, status.

    Prints its time and state after that. Exit codes: 0 done, 1 no replay answers, 2 bad input, 3 the replay refused it.
    """
    arguments = _arguments(request, value)
    if address is None:
        place = newest_replay()
        address = place.simulation
        if pki is None and place.pki:
            pki = Path(os.environ.get(PKI_VARIABLE) or place.pki)
    with hear_replay(address, (), pki=pki) as replay:
        status = replay.request(request, **arguments)
    if json:
        print_json(status)
    else:
        typer.echo(f"{status['capture']}: {status['time_ns'] / 1e9:.3f} s, {status['state']} {status['rate']}")


def _arguments(request: str, value: str | None) -> dict[str, Any]:
    """Return the arguments of a request; raises BadValue."""
    if request not in ARGUMENTS:
        raise UnknownName("no request of a replay", request, ARGUMENTS)
    if not ARGUMENTS[request]:
        if value is not None:
            raise BadValue(f"{request} has no argument", value)
        return {}
    if request == STEP:
        if value is not None and (not value.isdecimal() or len(value) > 9):
            raise BadValue("not a number of ticks", value)
        return {"count": int(value or 1)}
    if value is None:
        raise BadValue(f"{request} needs {f'a {TIME.name} ({TIME.form})' if request == SEEK else 'a rate such as 2x'}")
    return {"time_ns": parse_ns(value)} if request == SEEK else {"pace": str(parse_pace(value))}
