"""The rows of a closing, and the messages of its packets in the capture's file.

All rows are pure functions of closings, so missing ones can be made again by a fold of the journal (`records.fold`).
"""

from __future__ import annotations

from collections.abc import Callable
from operator import attrgetter
from typing import Any, Final

from msgspec.structs import replace

from foosim.capture.file import Entry, Tick, frame_row
from foosim.capture.mcap.writer import McapWriter
from foosim.capture.rows import (
    AGES,
    CLIENTS,
    FRAME,
    LAYOUT,
    METRICS,
    PACKETS,
    RECOVERIES,
    TICK,
    AgeRow,
    ClientRow,
    DecidedRow,
    DeliveredRow,
    EditRow,
    EntityRow,
    Fate,
    LayoutRow,
    MetricRow,
    PacketRow,
    RecoveryRow,
    Row,
    SubscriptionRow,
    TickRow,
)
from foosim.common.keyed_random import Slot
from foosim.deployment.schema import Deployment
from foosim.protocol.messages import Recovered
from foosim.vhub.network.ages import quantile
from foosim.vhub.network.air import DEAF
from foosim.vhub.network.memory import Age
from foosim.vhub.network.packet import DELIVERED, DROPPED, IN_FLIGHT, Flight, level_cdbm
from foosim.vhub.stages.duty import DUTY_CYCLE
from foosim.vhub.stages.medium import COLLISION, SNR
from foosim.vhub.stages.queue import CODEL, QUEUE_FULL
from foosim.vhub.stages.receiver import RECEIVER_FULL
from foosim.vhub.state.records import Closing
from foosim.world.edits import Add, Disrupt, Edit, Push, Remove
from foosim.world.frame import Frame


def world_rows(closing: Closing, deployment: Deployment, known: Frame | None) -> list[Entry]:
    """Return the rows of one closing except packets (`packet_entry`), which are written after them.

    `known` is the frame of the closing before, None at the start. The last closing of a run may bring a frame that is
    known already: then its packets alone are new.
    """
    frame, tick_ns = closing.frame, deployment.tick_ns
    at_ns = frame.tick * tick_ns
    mark = frame.tick & 0xFFFF_FFFF
    entries: list[Entry] = []
    if known is None or known.tick != frame.tick:
        if known is None:
            entries.append((LAYOUT, at_ns, at_ns, mark, layout_row(frame)))
        entries += [(CLIENTS, at_ns, at_ns, mark, row) for row in _client_rows(closing)]
        entries += [_recovery_entry(entry, tick_ns) for entry in closing.recovered]
        entries.append((TICK, at_ns, at_ns, mark, _tick_row(closing)))
        if known is None or frame.tick % deployment.capture.frames_every == 0:
            entries.append((FRAME, at_ns, at_ns, mark, frame_row(frame)))
    entries += [_age_entry(age, tick_ns) for age in closing.ages]
    for one in closing.metrics:
        its_ns = one.tick * tick_ns
        entries.append((METRICS, its_ns, its_ns, one.tick & 0xFFFF_FFFF, MetricRow(*one)))
    return entries


def _age_entry(age: Age, tick_ns: int) -> Entry:
    """Return the row of ages at use, at the last tick that it covers."""
    ages = sorted(age.counts)
    p50, p99 = quantile(age.counts, 0.5), quantile(age.counts, 0.99)
    counts = [age.counts[ticks] for ticks in ages]
    figures = sum(counts), p50 * tick_ns, p99 * tick_ns, ages[-1] * tick_ns
    key = age.client, age.source, age.channel
    row = AgeRow(age.tick, *key, *figures, [ticks * tick_ns for ticks in ages], counts)
    return AGES, age.tick * tick_ns, age.tick * tick_ns, age.tick & 0xFFFF_FFFF, row


def add_packets(mcap: McapWriter, channel: int, flights: list[Flight], encode: Callable[[Row], bytes]) -> None:
    """Add the rows of one closing's packets to a file in the order of their log times, as `encode` writes them.

    The hot path: see the bench before changing it.
    """
    for flight in sorted(flights, key=attrgetter("sent_ns")):  # in another order than they arrive in, by due times
        _, log_ns, publish_ns, sequence, row = packet_entry(flight)
        mcap.add_message(channel, log_ns, publish_ns, sequence, encode(row))


def tick_of(closing: Closing, deployment: Deployment) -> Tick:
    """Return what a capture takes of a closing; its rows are made in the thread that writes them."""

    def rows(known: Frame | None) -> list[Entry]:
        return world_rows(closing, deployment, known)

    def packets(mcap: McapWriter, channel: int, encode: Callable[[Row], bytes]) -> None:
        add_packets(mcap, channel, closing.fates, encode)

    return Tick(closing.frame, closing.digest, closing.chain, rows, packets, len(closing.fates), closing.sensed)


def packet_entry(flight: Flight) -> Entry:
    """Return the row of a packet, in its place."""
    sent_ns, stamp_ns = flight.sent_ns, flight.stamp_ns
    return PACKETS, sent_ns, stamp_ns or sent_ns, flight.sequence & 0xFFFF_FFFF, packet_row(flight)


DECIDING: Final[dict[str, tuple[str, ...]]] = {
    COLLISION: ("frame",),
    DUTY_CYCLE: ("duty_left_ns",),
    QUEUE_FULL: ("queue_packets",),
    CODEL: ("queue_packets", "codel_above_ns", "codel_drops"),
    RECEIVER_FULL: ("room_left", "room_share"),
    SNR: ("frame",),
}
"""By cause of a drop, the fields of a row for what `Flight.decided_by` has."""
_FATES: Final[dict[str, Fate]] = {"": DELIVERED, IN_FLIGHT: IN_FLIGHT}
_LOSS: Final = int(Slot.LOSS)
_JITTER: Final = int(Slot.JITTER)
_ERROR: Final = int(Slot.ERROR)


def packet_row(flight: Flight) -> PacketRow:
    """Return the row of a packet whose fate is final, or that is in flight at the end."""
    cause, radio = flight.cause, flight.radio
    fate = _FATES.get(cause, DROPPED)
    on_its_way = flight.arrival_tick >= 0
    slots, words, payload = flight.slots, flight.words, flight.payload
    common = (
        flight.source,
        flight.sequence,
        flight.copy,
        flight.destination,
        flight.channel,
        flight.sent_ns,
        flight.stamp_ns,
        flight.due_ns if on_its_way else -1,
        flight.arrival_tick,
        fate,
        cause if fate is DROPPED else "",
        flight.rule,
        words[_LOSS].to_bytes(8).hex() if slots >> _LOSS & 1 else "",
        words[_JITTER].to_bytes(8).hex() if slots >> _JITTER & 1 and on_its_way else "",
        flight.size,
        payload,
        flight.released_wall_ns,
        radio,
        flight.published,
        flight.count,
        flight.queue_bytes,
        flight.queue_ns,
        flight.access_ns,
        flight.airtime_ns,
        flight.propagation_ns,
        flight.jitter_ns,
        flight.held_ns,
        flight.model_ns,
        flight.phase_ns,
        flight.is_bad,
        flight.bits_flipped,
        flight.rate_bps,
    )
    if not radio:
        row = PacketRow(*common)
        return _with_decision(row, flight) if cause and flight.decided_by else row
    row = PacketRow(*common, *_radio_inputs(flight))
    return _with_decision(row, flight) if cause or flight.by_factor else row


def _with_decision(row: PacketRow, flight: Flight) -> PacketRow:
    """Return the row with the numbers that decided the packet's drop, where its cause has some."""
    cause, by_factor = flight.cause, flight.by_factor
    found: dict[str, Any] = dict(zip(DECIDING.get(cause, ()), flight.decided_by, strict=False))
    if by_factor:
        found["by_factor_cdbm"] = [level_cdbm(power) for power in by_factor]
    if cause == COLLISION:
        found["collision"] = _collision_of(flight)
    return replace(row, decided_by=DecidedRow(**found)) if found else row


def _radio_inputs(flight: Flight) -> tuple[Any, ...]:
    """Return the results of a radio's stages, in the order of a row."""
    threshold, walls = flight.error_threshold, flight.walls
    interference = flight.interference if flight.interference < DEAF else 0
    return (
        flight.distance_mm,
        list(walls) if walls else [],
        flight.walls_cdb,
        flight.path_loss_cdb,
        flight.shadowing_cdb,
        flight.fading_cdb,
        flight.received_cdbm,
        flight.snr_cdb,
        level_cdbm(interference) if interference else 0,
        threshold * 1_000_000 >> 64,
        flight.words[_ERROR].to_bytes(8).hex() if threshold else "",
        flight.contenders,
        flight.retries,
    )


def _collision_of(flight: Flight) -> str:
    """Return the kind of a packet's collision: that of the medium, or of the channel."""
    if flight.outcome == COLLISION:
        return "contention"
    return "half_duplex" if flight.interference >= DEAF else "interference"


def _tick_row(closing: Closing) -> TickRow:
    frame = closing.frame
    return TickRow(
        frame.tick,
        closing.digest.hex(),
        [frame.entity_digest(entity).hex() for entity in frame.layout.entities],
        [edit_row(edit) for edit in closing.edits],
        [
            DeliveredRow(d.due_ns, d.source, d.sequence, d.copy, d.destination, d.channel, d.payload)
            for d in closing.delivered
        ],
        closing.wall_ns,
    )


def _recovery_entry(entry: Recovered, tick_ns: int) -> Entry:
    """Return the row of a loss or return, at the last tick before it."""
    at_ns = entry.tick * tick_ns
    row = RecoveryRow(entry.what, entry.name, entry.reason, entry.tick, entry.epoch, entry.outage_ns)
    return RECOVERIES, at_ns, at_ns, entry.tick & 0xFFFF_FFFF, row


def layout_row(frame: Frame) -> LayoutRow:
    """Return the row of a frame's layout."""
    layout = frame.layout
    return LayoutRow(
        frame.tick,
        layout.digest.hex(),
        layout.size,
        [EntityRow(e.name, e.model, e.start, e.split, e.stop) for e in layout.entities],
    )


def _client_rows(closing: Closing) -> list[ClientRow]:
    tick = closing.frame.tick
    rows = [ClientRow(tick, name, "leaves", 0, []) for name in closing.leaves]
    for joining in closing.joins:
        heard, calling = (
            [SubscriptionRow(source, channel) for source, channel in pairs]
            for pairs in (joining.subscriptions, joining.arrivals)
        )
        rows.append(ClientRow(tick, joining.name, "joins", joining.period, heard, joining.offset, calling))
    return [*rows, *(ClientRow(tick, name, "leaves_owing", 0, []) for name in closing.owing)]


def edit_row(edit: Edit) -> EditRow:
    """Return the row of an edit."""
    if isinstance(edit, Add):
        return EditRow("add", edit.name, numbers=edit.numbers)
    if isinstance(edit, Remove):
        return EditRow("remove", edit.name)
    if isinstance(edit, Push):
        return EditRow("push", edit.name, impulse=list(edit.impulse))
    if isinstance(edit, Disrupt):
        return EditRow("network", "", event=edit.event)
    return EditRow("set", edit.name, field=edit.field, numbers=edit.numbers)
