"""A frame of a capture as the start of another run: `CAPTURE@12.5s` or `CAPTURE@last`, and its checks.

A branch begins with the newest captured frame at or before the time, keeps its tick, and continues the chain over
all frames up to it: with the inputs of the captured run it has the digests of the captured run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import Scan, chain_at_start, check_layout, deployment_of
from foosim.capture.rows import FRAME, LAYOUT, TICK, FrameRow, LayoutRow, TickRow
from foosim.common.errors import BadValue, Malformed, Refused
from foosim.common.new_run import new_run_text
from foosim.common.units import format_ns, parse_ns
from foosim.deployment.schema import Deployment
from foosim.world.assembly.initial_state import start_with
from foosim.world.frame import Frame, chain_next, frame_from_bytes
from foosim.world.layout import Layout, build_layout
from foosim.world.robot_packets import Outbox
from foosim.world.start import Start

LAST: Final = "last"
"""The word for the time of the last captured frame."""


class BadBranch(Refused):
    """A capture to begin with that cannot be read is bad input."""

    exit_code = 2


@dataclass(frozen=True, slots=True)
class Branch:
    """A start from a capture, and in words which frame it is."""

    start: Start
    text: str


def parse_branch(text: str) -> tuple[Path, int | None]:
    """Return the file and the time in ns of `CAPTURE@12.5s`; without a time, or with `@last`, None: the last frame."""
    path, at, time = text.rpartition("@")
    if not at or not path or "/" in time:
        return Path(text), None
    if time == LAST:
        return Path(path), None
    try:
        return Path(path), parse_ns(time)
    except BadValue as error:
        raise BadValue(f"--from: the time after @, {error.problem}", error.value, error.nearest) from None


def read_branch(text: str, deployment: Deployment) -> Branch:
    """Return the start that `CAPTURE@TIME` names, for a run of `deployment`.

    Raises BadBranch for a file other than a capture, BadValue for a time beyond it and for a deployment that
    does not fit it.
    """
    path, at_ns = parse_branch(text)
    try:
        found = _find(path, at_ns)
        layout, frame = _frame_of(path, found)
    except CaptureError as error:
        raise BadBranch(f"--from: {error}") from None
    captured = found.deployment
    if deployment.tick_ns != captured.tick_ns:
        have, want = format_ns(captured.tick_ns), format_ns(deployment.tick_ns)
        raise BadValue(f"--from: the capture has ticks of {have}, the deployment of {want}", str(path))
    differing = _differences(layout, deployment)
    if differing:
        raise BadValue(f"--from: the deployment does not fit the capture: {'; '.join(differing)}", str(path))
    at = f"frame {frame.tick} of {path}, at {frame.tick * captured.tick_ns / 1e9:g} s"
    return Branch(start_with(frame, path.name, found.chain), f"the run begins with {at}")


def _frame_of(path: Path, found: _Found) -> tuple[Layout, Frame]:
    row = found.frame
    layout = build_layout(found.deployment)
    check_layout(path, layout, found.layout)
    outboxes = [Outbox(outbox.index, outbox.packets) for outbox in row.outboxes]
    try:
        frame = frame_from_bytes(row.tick, layout, row.values, outboxes)
    except Malformed as error:
        raise CaptureError(f"{path}: frame {row.tick}: {error}") from None
    if frame.digest != found.digest:
        raise CaptureError(f"{path}: frame {row.tick} is not the one whose digest the capture has")
    return layout, frame


@dataclass(frozen=True, slots=True)
class _Found:
    """A captured frame with its layout, its digest D(tick) and the chain over all frames up to it."""

    deployment: Deployment
    layout: LayoutRow
    frame: FrameRow
    digest: bytes
    chain: bytes


def _find(path: Path, at_ns: int | None) -> _Found:
    """Return the newest frame of a capture at or before a time (None: the last), by one pass over the file."""
    scan = Scan(path)
    deployment: Deployment | None = None
    layout: LayoutRow | None = None
    found: _Found | None = None
    digest, chain, tick, tick_ns = b"", b"", 0, 1
    for _, row in scan.rows(frozenset({LAYOUT, TICK, FRAME})):
        if deployment is None:
            deployment = deployment_of(scan.about)
            tick_ns = deployment.tick_ns
        if isinstance(row, LayoutRow):
            layout = row
        elif isinstance(row, TickRow):
            tick, digest = row.tick, bytes.fromhex(row.digest)
            if at_ns is not None and tick * tick_ns > at_ns:
                break
            chain = chain_next(chain, digest) if chain else chain_at_start(scan.about)
        elif isinstance(row, FrameRow) and layout is not None and row.tick == tick and chain:
            found = _Found(deployment, layout, row, digest, chain)
    if found is None or (at_ns is not None and tick * tick_ns < at_ns):
        first = "none" if found is None else f"up to {tick * tick_ns / 1e9:g} s"
        raise BadValue(f"--from: no frame of {path} at that time, it has frames {first}", _seconds(at_ns))
    return found


def branch_command(arguments: Sequence[str], capture: Path | None) -> str:
    """Return in words how a new run begins with the last captured frame; `arguments` are the last run's."""
    try:
        has_frame = capture is None or any(True for _ in Scan(capture).messages(frozenset({FRAME})))
    except Refused as error:
        return f"No new run can begin with its capture: {error}"
    if not has_frame:
        return f"No new run can begin with its capture: {capture} has no frame"
    return new_run_text(arguments, "" if capture is None else str(capture))


def _seconds(at_ns: int | None) -> str | None:
    return None if at_ns is None else format_ns(at_ns)


def _differences(layout: Layout, deployment: Deployment) -> list[str]:
    """Return in words where a captured layout is not that of the deployment."""
    ours = build_layout(deployment)
    wanted = dict(ours.models)
    differing = []
    for name in sorted({*wanted, *layout.models}):
        if name not in wanted:
            differing.append(f"it lacks {layout.models[name]} {name}")
        elif name not in layout.models:
            differing.append(f"the capture has no {wanted[name]} {name}")
        elif wanted[name] != layout.models[name]:
            differing.append(f"{name} is a {layout.models[name]} in the capture, a {wanted[name]} in the deployment")
        elif name in deployment.robots:
            have, want = layout.components(name), ours.components(name)
            if have != want:
                have_text, want_text = ", ".join(have) or "none", ", ".join(want) or "none"
                differing.append(f"components of {name} are {have_text} in the capture, {want_text} in the deployment")
    return differing
