"""The commands `foosim-replay play` and `control`: shells over `play_capture` and `hear_replay`."""

from __future__ import annotations

import os
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from foosim.cli.options import Capture, Json, reading, time_of
from foosim.client.replay_listener import hear_replay
from foosim.common.addresses import LOOPBACK
from foosim.common.errors import BadValue, UnknownName, read_at
from foosim.common.json_text import encode_json
from foosim.common.units import NS_PER_S, RATE, TIME, Dimension, parse, parse_ns, parse_pace
from foosim.replay.address_file import newest_place
from foosim.replay.main import READ_AHEAD, PlayOptions, PlayResult, Stopper, play_capture
from foosim.replay.requests import ARGUMENTS, SEEK, STEP
from foosim.replay.requests import RATE as RATE_VERB
from foosim.replay.terminal import Lines
from foosim.runtime.command import DONE, FAILED, PKI_VARIABLE, PkiOption
from foosim.runtime.process import Stop

CLOCK_HZ_MAX: Final = 1000
READ_AHEAD_MAX: Final = 1_000_000


def play(  # noqa: PLR0913, PLR0917  # a command's options
    capture: Capture,
    begin: Annotated[str | None, typer.Option("--from", help="Begin at this time of the capture, e.g. 12.5s.")] = None,
    until: Annotated[str | None, typer.Option(help="End at this time of the capture.")] = None,
    duration: Annotated[str | None, typer.Option("--for", help="End after this much of the capture.")] = None,
    rate: Annotated[str, typer.Option(help="realtime, fast, or a factor such as 2x.")] = "realtime",
    loop: Annotated[bool, typer.Option("--loop", help="Begin again at the end.")] = False,
    delay: Annotated[str | None, typer.Option(help="Wait so long (wall time) before it begins.")] = None,
    paused: Annotated[bool, typer.Option("--paused", help="Begin paused.")] = False,
    topic: Annotated[
        list[str] | None, typer.Option(help="Play this: /packets, /packets/camera, /tf, ...; may be repeated.")
    ] = None,
    regex: Annotated[list[str] | None, typer.Option(help="Play names in which this is found; may be repeated.")] = None,
    exclude: Annotated[
        list[str] | None, typer.Option(help="Leave out names in which this is found; may be repeated.")
    ] = None,
    remap: Annotated[
        list[str] | None,
        typer.Option(help="OLD:=NEW for an endpoint or a body, /OLD:=/NEW for a channel; may be repeated."),
    ] = None,
    clock: Annotated[str, typer.Option(help="How often the time is published (wall time).")] = "10 Hz",
    read_ahead: Annotated[int, typer.Option(help="How many entries are read ahead at most.")] = READ_AHEAD,
    listen: Annotated[str, typer.Option(help="HOST[:PORT] to listen at.")] = LOOPBACK,
    insecure: Annotated[bool, typer.Option("--insecure", help="Listen where other machines reach it.")] = False,
    pki: PkiOption = None,
    json: Json = False,
) -> None:
    """Publish captured packets, poses, scenes, log and rows again, at the times at which they were released.

    Listeners are programs with `foosim.client.replay_listener.hear_replay`; a replay has a plane of its own. Names are
    /packets/SOURCE/DESTINATION/CHANNEL, /tf for poses, and all topics of the capture; /tick and /frame are played
    when they are named. On a terminal: space pauses and goes on, s steps a tick, up and down double and halve the rate,
    left and right go 5 s back and on, q ends it. `foosim-replay control` does the same from elsewhere. A capture whose
    writer was killed is played up to its last whole chunk. Ctrl-C ends it in order. Exit codes: 0 played or stopped, 1
    it could not be played to its end, 2 bad input, 3 refused.
    """
    if not 1 <= read_ahead <= READ_AHEAD_MAX:
        raise BadValue(f"--read-ahead: out of range 1 to {READ_AHEAD_MAX}", read_ahead)
    options = PlayOptions(
        time_of("--from", begin),
        time_of("--until", until),
        time_of("--for", duration),
        read_at("--rate", parse_pace, rate),
        loop,
        paused,
        time_of("--delay", delay) or 0,
        _period_ns(clock),
        read_ahead,
        tuple(topic or ()),
        tuple(regex or ()),
        tuple(exclude or ()),
        tuple(remap or ()),
        listen,
        insecure,
        pki,
    )
    raise typer.Exit(_play(capture, options, json))


def _play(capture: Path, options: PlayOptions, json: bool) -> int:
    """Play until the end, or until it is told to stop; return the exit code."""
    stopper = Stopper()
    Stop().then(stopper.stop)
    lines = Lines(sys.stderr if json else sys.stdout)
    with reading():
        result = play_capture(capture, options, lines, stopper)
    if json:
        typer.echo(encode_json(asdict(result)).decode())
    else:
        lines.say(_played_text(result))
    return FAILED if result.failed else DONE


def _period_ns(text: str) -> int:
    """Return the wall time between two messages of a rate."""
    try:
        rate_hz = parse(text, RATE)
    except BadValue as error:
        raise BadValue(f"--clock: {error.problem}", error.value, error.nearest) from None
    if not 0 < rate_hz <= CLOCK_HZ_MAX:
        raise BadValue(f"--clock: not a rate above 0 and up to {CLOCK_HZ_MAX} Hz", text)
    return int(NS_PER_S / rate_hz)


def _played_text(result: PlayResult) -> str:
    rounds = f" in {result.rounds} rounds" if result.rounds > 1 else ""
    lines = [f"{result.published} published{rounds}, up to {result.time_ns / 1e9:g} s: {result.reason}"]
    if result.late_ns_max:
        mean_ms, max_ms = result.late_ns_mean / 1e6, result.late_ns_max / 1e6
        lines.append(f"late by {mean_ms:.2f} ms in the mean, {max_ms:.2f} ms at most")
    if result.slips:
        lines.append(f"{result.slips} times it could not keep up, and time was held back")
    if result.too_large:
        lines.append(f"{result.too_large} rows are too large for a message and were not published")
    return "\n".join(lines)


def control(
    request: Annotated[str, typer.Argument(help=f"One of {', '.join(ARGUMENTS)}.", show_default=False)],
    value: Annotated[
        str | None, typer.Argument(help="For step a number of ticks, for seek a time, for rate a rate.")
    ] = None,
    address: Annotated[
        str | None, typer.Option(help="Where the replay listens; by default the newest of this user.")
    ] = None,
    pki: PkiOption = None,
    json: Json = False,
) -> None:
    """Control a replay that runs: pause, resume, step [N], seek 12.5s, rate 2x, stop, status.

    Prints where it is then. Exit codes: 0 done, 1 no replay answers, 2 bad input, 3 the replay refused it.
    """
    arguments = _arguments(request, value)
    if address is None:
        place = newest_place()
        address = place.address
        if pki is None and place.pki:
            pki = Path(os.environ.get(PKI_VARIABLE) or place.pki)
    with hear_replay(address, (), pki=pki) as replay:
        status = replay.ask(request, **arguments)
    if json:
        typer.echo(encode_json(status).decode())
    else:
        typer.echo(f"{status['capture']}: {status['time_ns'] / 1e9:.3f} s, {status['state']} {status['rate']}")


def _arguments(request: str, value: str | None) -> dict[str, Any]:
    """Return what goes with a request; raises BadValue."""
    if request not in ARGUMENTS:
        raise UnknownName("no request of a replay", request, ARGUMENTS)
    wanted = ARGUMENTS[request]
    if wanted is None:
        if value is not None:
            raise BadValue(f"{request} has no argument", value)
        return {}
    if request == STEP and value is None:
        return {wanted[0]: 1}
    if value is None:
        raise BadValue(f"{request} needs {_form(TIME) if request == SEEK else 'a rate such as 2x'}")
    if request == STEP:
        if not value.isdecimal() or len(value) > 9:
            raise BadValue("not a number of ticks", value)
        return {wanted[0]: int(value)}
    if request == RATE_VERB:
        return {wanted[0]: str(parse_pace(value))}
    return {wanted[0]: parse_ns(value)}


def _form(dimension: Dimension) -> str:
    return f"a {dimension.name} ({dimension.form})"
