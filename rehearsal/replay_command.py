"""The command `foosim-replay`: what a capture holds, and whether it repeats. A shell over `verify` and the reader."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import msgspec
import typer

from foosim.protocol import limits
from foosim.protocol.codec import encode_json
from foosim.protocol.command import DONE, FAILED, VersionOption, new_app, run_app
from foosim.protocol.errors import BadValue, Refused
from foosim.rehearsal.verify import Verified, verify_capture
from foosim.vhub.capture_reader import CaptureInfo, capture_info
from foosim.vhub.capture_recovery import recover_capture
from foosim.vhub.rows import CaptureError

app = new_app()


class BadCapture(Refused):
    """A file that is no capture, or is damaged, is bad input."""

    exit_code = 2


@contextmanager
def _read() -> Iterator[None]:
    """Have what is wrong with the file end the command as bad input."""
    try:
        yield
    except CaptureError as error:
        raise BadCapture(str(error)) from None


Capture = Annotated[Path, typer.Argument(help="The capture, an MCAP file.", show_default=False)]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for scripts.")]


@app.callback()
def foosim_replay(version: VersionOption = False) -> None:
    """Look into a capture, and simulate it again.

    Exit codes: 0 done, 1 differs or failed, 2 bad input (no capture, a damaged one).
    """


@app.command()
def info(capture: Capture, json: Json = False) -> None:
    """Show what a capture holds: run, duration, digests, nodes and their arithmetic, packets, recoveries, topics."""
    with _read():
        found = capture_info(capture)
    typer.echo(encode_json(msgspec.to_builtins(found)).decode() if json else _describe(found))


def _describe(found: CaptureInfo) -> str:
    packets = found.packets
    state = (
        "finished" if found.finished else f"not finished, {found.unfinished_bytes} bytes behind the last whole chunk"
    )
    lines = [
        f"{found.path}: {found.bytes / 1e6:.1f} MB, {state}",
        *(f"  {key}: {value}" for key, value in sorted({**found.metadata, **found.end}.items())),
        f"  {_span(found)} of {found.tick_ns / 1e6:g} ms, {found.duration_ns / 1e9:.2f} s simulated",
        f"  digest of the last frame {found.digest}",
        f"  digest of all ticks {found.chain}",
        f"  nodes {', '.join(found.nodes) or 'not known'}",
        f"  arithmetic {', '.join(found.arithmetic) or 'not known'}",
        f"  packets {', '.join(f'{count} {fate}' for fate, count in packets.items())}",
        f"  recoveries {found.recoveries}",
        "  topics",
        *(f"    {topic}: {count}" for topic, count in found.topics.items()),
        "  versions",
        *(f"    {name}: {number}" for name, number in sorted(found.versions.items())),
    ]
    return "\n".join(lines)


def _span(found: CaptureInfo) -> str:
    return f"{found.ticks} ticks" if not found.first_tick else f"ticks {found.first_tick} to {found.ticks}"


@app.command()
def verify(
    capture: Capture,
    nodes: Annotated[int, typer.Option(help="Number of nodes to simulate on.")] = 1,
    json: Json = False,
) -> None:
    """Simulate a capture again from its orders and deliveries, and compare the digest of every tick.

    Names the first tick and the entities that differ. The number of nodes need not be the capture's. Where ticks differ
    and the capture comes from nodes with another arithmetic than this machine's, standard error says so.
    """
    if not 1 <= nodes <= limits.NODES_MAX:
        raise BadValue(f"--nodes: out of range 1 to {limits.NODES_MAX}", nodes)
    with _read():
        found = verify_capture(capture, nodes)
    typer.echo(encode_json(_as_json(found)).decode() if json else _verdict(found))
    if found.tick >= 0 and found.other_arithmetic:
        typer.echo(
            f"the capture's arithmetic is {', '.join(found.other_arithmetic)}, this machine's is {found.arithmetic}: "
            "they compute different worlds",
            err=True,
        )
    raise typer.Exit(DONE if found.equal else FAILED)


def _as_json(found: Verified) -> dict[str, Any]:
    return {
        "equal": found.equal,
        "first_tick": found.first_tick,
        "ticks": found.ticks,
        "nodes": found.nodes,
        "chain": found.chain.hex(),
        "tick": found.tick if found.tick >= 0 else None,
        "entities": list(found.entities),
        "missing_tick": found.missing_tick if found.missing_tick >= 0 else None,
    }


def _verdict(found: Verified) -> str:
    on = f"on {found.nodes} node{'s' if found.nodes > 1 else ''}"
    if found.equal:
        count = found.ticks - found.first_tick
        return f"equal: {count} ticks simulated again {on}, digest of all ticks {found.chain.hex()}"
    if found.missing_tick >= 0:
        return f"tick {found.missing_tick} is missing; {found.ticks - found.first_tick} ticks before it are equal {on}"
    return f"differs at tick {found.tick} in {', '.join(found.entities)}; the ticks before it are equal {on}"


@app.command()
def recover(
    capture: Capture,
    journals: Annotated[
        Path | None, typer.Option(help="The folder of its vHub's journal, e.g. RUN/journals.", show_default=False)
    ] = None,
) -> None:
    """Make a capture valid that its writer left unfinished; what a journal has is added.

    It is changed in place: cut behind the last whole chunk, completed, and ended. Bytes that are damaged and not just
    cut are only given up when the journal has what they held. `foosim-supervisor up` does this by itself with what
    earlier ones of the same user left.
    """
    with _read():
        found = recover_capture(capture, journals)
    typer.echo(f"capture {capture} is finished already" if found is None else str(found))


def main() -> None:
    """The entry point of `foosim-replay`."""
    run_app(app, "foosim-replay")
