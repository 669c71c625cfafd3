"""What became of one captured packet, and why: the stages that it went through, each with its numbers.

The numbers are those of its row; what a row does not have is made again from the deployment that is in the capture,
the events that were asked for until then, and the packet's draws, which are a function of seed, link and number: so
they have to agree with the row's. Neighbours: `rows.PacketRow`, `stages` (whose order this follows), `foosim-net`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, Final

from foosim.protocol.draws import UNIT, Slot, chance_threshold, draw_words
from foosim.protocol.errors import BadValue
from foosim.protocol.frame import Frame
from foosim.protocol.messages import Disrupt
from foosim.protocol.names import nearest_name
from foosim.vhub.capture_columns import word_of
from foosim.vhub.capture_reader import CaptureData
from foosim.vhub.fabric import Fabric
from foosim.vhub.figures import EXACT, rate_text, time_text
from foosim.vhub.link_models import VERSION_KEY
from foosim.vhub.rows import PACKETS, TICK, PacketRow, TickRow, edit_of
from foosim.vhub.setup import LinkSetup
from foosim.vhub.stages import STAGES
from foosim.vhub.stages.capacity import EVICTED
from foosim.vhub.stages.own import MODEL, MODEL_FAILED
from foosim.vhub.stages.residual import Residual
from foosim.vhub.state import OUTBOX_SHIFT
from foosim.vhub.transit import TRANSIT_FULL

NAMES_SHOWN: Final = 8


@dataclass(frozen=True, slots=True)
class PacketName:
    """Which packet is meant; without a destination the one that has this number."""

    source: str
    sequence: int
    destination: str = ""
    copy: int = 0

    def __str__(self) -> str:
        parts = [self.source, str(self.sequence), *([self.destination] if self.destination else [])]
        return ":".join([*parts, *([str(self.copy)] if self.copy else [])])


def parse_packet(text: str) -> PacketName:
    """Return the packet that `SOURCE:SEQUENCE[:DESTINATION[:COPY]]` names; raises BadValue."""
    parts = text.split(":")
    numbers = [parts[at] for at in (1, 3) if at < len(parts)]
    if not 2 <= len(parts) <= 4 or not all(part.isascii() and part.isdigit() and len(part) < 20 for part in numbers):
        raise BadValue("not a packet, SOURCE:SEQUENCE[:DESTINATION[:COPY]]", text)
    destination = parts[2] if len(parts) > 2 else ""
    return PacketName(parts[0], int(parts[1]), destination, int(parts[3]) if len(parts) > 3 else 0)


@dataclass(frozen=True, slots=True)
class Step:
    """One stage: whether it is on the link, let the packet pass, dropped it, or was not reached; what it looked at."""

    stage: str
    outcome: str
    text: str
    facts: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Explained:
    """A packet, the stages in their order, and its fate. `agrees`: its draws are those that are made again."""

    head: str
    steps: tuple[Step, ...]
    verdict: str
    fate: str
    cause: str
    agrees: bool


PASSED, DROPPED, ABSENT, UNREACHED = "passed", "dropped", "not on this link", "not reached"
STAGE_NAMES: Final = (
    *("admit", "policy", "duty", "queue", "medium", "channel", "residual", "model", "mangle", "delay"),
    *("capacity", "receiver"),
)
_AT_SENDING: Final = {
    **dict.fromkeys(("too_big", "node_down", "no_route"), "admit"),
    **dict.fromkeys(("partition", "filtered"), "policy"),
    **dict.fromkeys(("duty_cycle",), "duty"),
    **dict.fromkeys(("queue_full", "queue_codel", "expired"), "queue"),
    **dict.fromkeys(("collision",), "medium"),
    **dict.fromkeys(("out_of_range", "blocked", "snr"), "channel"),
    **dict.fromkeys(("random_loss", "burst_loss"), "residual"),
    **dict.fromkeys((MODEL, MODEL_FAILED), "model"),
    **dict.fromkeys(("crc_fail",), "mangle"),
    **dict.fromkeys((TRANSIT_FULL,), "receiver"),
}
_AT_ARRIVAL: Final = {
    **dict.fromkeys(("partition", "expired"), "policy"),
    **dict.fromkeys(("collision", "snr", "out_of_range"), "channel"),
    **dict.fromkeys((EVICTED,), "capacity"),
    **dict.fromkeys(("rx_down", "rx_full"), "receiver"),
}
"""Which stage has dropped a packet, by cause."""


def find_packet(capture: CaptureData, which: PacketName) -> PacketRow:
    """Return the row of a packet; raises BadValue, with those that there are, when there is no such one."""
    found: dict[tuple[str, int], PacketRow] = {}
    sources: set[str] = set()
    for row in capture.rows(PACKETS):
        assert isinstance(row, PacketRow)
        sources.add(row.source)
        if (row.source, row.sequence) == (which.source, which.sequence):
            found[row.destination, row.copy] = row
    if which.source not in sources:
        nearest = nearest_name(which.source, sources)
        hint = None if nearest is None else repr(nearest)
        raise BadValue(f"{capture.path}: no packet from this source", which.source, hint)
    if not found:
        raise BadValue(f"{capture.path}: {which.source} sent no packet of this number", which.sequence)
    chosen = {key: row for key, row in found.items() if key[0] == which.destination or not which.destination}
    exact = [row for (_, copy), row in chosen.items() if copy == which.copy]
    if len(exact) == 1:
        return exact[0]
    names = [str(PacketName(which.source, which.sequence, *key)) for key in sorted(chosen if exact else found)]
    more = f" and {len(names) - NAMES_SHOWN} more" if len(names) > NAMES_SHOWN else ""
    shown = ", ".join(names[:NAMES_SHOWN]) + more
    raise BadValue(f"{capture.path}: say which one of {shown}", str(which))


def explain_packet(capture: CaptureData, which: PacketName) -> Explained:
    """Return what became of a captured packet. Raises BadValue for one that is not there, CaptureError."""
    return _Story(capture, find_packet(capture, which)).tell()


def _time(ns: int) -> str:
    return time_text(ns, EXACT)


def _share(word: int) -> str:
    return f"{word / UNIT:.6g}"


class _Story:
    """One row, and the link that it went over as it was then."""

    def __init__(self, capture: CaptureData, row: PacketRow) -> None:
        self.capture, self.row = capture, row
        self.tick_ns = capture.deployment.tick_ns
        self.fabric = Fabric(capture.deployment)
        self.tick = row.sent_ns // self.tick_ns
        last = max(self.tick, row.arrival_tick)
        asked = [
            (tick_row.tick, edit.event)
            for tick_row in capture.rows(TICK)
            if isinstance(tick_row, TickRow) and tick_row.tick <= last
            for edit in map(edit_of, tick_row.edits)
            if isinstance(edit, Disrupt)
        ]
        self._take(asked, 0, self.tick)
        self.link = self.fabric.link(row.source, row.destination, row.channel)
        self.setup: LinkSetup = self.link.setup_at(row.sent_ns)
        self.settings = self.setup.settings
        self.stages = dict(zip(STAGE_NAMES, (make(self.setup) for make in STAGES), strict=True))
        self.words = draw_words(self.setup.key, row.sequence, row.copy)
        self._take(asked, self.tick + 1, last)
        self.arriving = self.link.setup_at(row.sent_ns)
        """What is known of cuts and clogs when it arrives."""

    def _take(self, asked: list[tuple[int, str]], first: int, last: int) -> None:
        for tick, event in asked:
            if first <= tick <= last:
                self.fabric.take(tick, tick * self.tick_ns, event)

    @property
    def agrees(self) -> bool:
        row = self.row
        told = {Slot.LOSS: row.loss_word, Slot.JITTER: row.jitter_word, Slot.ERROR: row.error_word}
        return all(not word or word == f"{self.words[slot]:016x}" for slot, word in told.items())

    @property
    def dropped_by(self) -> str:
        """The stage that has dropped it; empty for none."""
        row = self.row
        if row.fate != "dropped":
            return ""
        stage = (_AT_ARRIVAL if row.arrival_tick >= 0 else _AT_SENDING).get(row.cause, "receiver")
        return "channel" if stage == "medium" and row.retries == 0 and row.error_word else stage

    def tell(self) -> Explained:
        row, ended = self.row, False
        steps = []
        at_sending = row.arrival_tick < 0
        for name in STAGE_NAMES:
            tell: Callable[[], tuple[str, dict[str, Any]]] = getattr(self, f"_{name}")
            if self.stages[name] is None:
                steps.append(Step(name, ABSENT, "nothing to do on this link"))
                continue
            if ended:
                steps.append(Step(name, UNREACHED, "not reached"))
                continue
            text, facts = tell()
            is_drop = name == self.dropped_by
            text += f": {row.cause}" if is_drop else ""
            steps.append(Step(name, DROPPED if is_drop else PASSED, text, facts))
            ended = is_drop and at_sending
        return Explained(self._head(), tuple(steps), self._verdict(), row.fate, row.cause, self.agrees)

    def _head(self) -> str:
        row = self.row
        is_robot = row.source in self.capture.deployment.robots
        number = f"tick {row.sequence >> OUTBOX_SHIFT}, place {row.sequence & 0xFFFF}" if is_robot else "its own count"
        via = f" via {row.radio}" if row.radio and row.radio != row.rule else ""
        copy = f", copy {row.copy}" if row.copy else ""
        how = "published" if row.published else "sent"
        return (
            f"{row.source} to {row.destination} on {row.channel}: number {row.sequence} ({number}){copy}, "
            f"{row.size} B, {how} at {_time(row.sent_ns)} (tick {self.tick}); rule {row.rule}{via}, "
            f"medium {self.settings.medium}"
        )

    def _verdict(self) -> str:
        row = self.row
        if row.fate == "dropped":
            when = "at sending" if row.arrival_tick < 0 else f"at arrival, tick {row.arrival_tick}"
            text = f"dropped {when}: {row.cause} ({self.dropped_by})"
        elif row.fate == "in_flight":
            text = f"in flight when the run ended: due {_time(row.due_ns)}, tick {row.arrival_tick}"
        else:
            later_ns = row.due_ns - row.sent_ns
            text = f"delivered at tick {row.arrival_tick}: due {_time(later_ns)} after it was sent"
        return text if self.agrees else f"{text}; its draws are NOT those of this seed, link and number"

    # --- stages ------------------------------------------------------------------------------------------------------

    def _admit(self) -> tuple[str, dict[str, Any]]:
        row, longest = self.row, self.settings.payload_max
        if not self.setup.is_routed:
            return "the ends have no radio in common", {"routed": False}
        state = "out of service" if row.cause == "node_down" and row.arrival_tick < 0 else "in service"
        limit = "any size" if longest is None else f"at most {longest} B"
        return f"{row.size} B of {limit}, sender {state}", {"size": row.size, "mtu": longest, "sender": state}

    def _policy(self) -> tuple[str, dict[str, Any]]:
        row, settings = self.row, self.settings
        cut = _within(self.setup.cuts, row.sent_ns)
        parts = [f"at sending {'cut' if cut else 'no partition'}"]
        facts: dict[str, Any] = {"cut_at_sending": cut, "allow": settings.allow, "ttl_ns": settings.ttl_ns}
        if not settings.allow:
            parts.append("nothing may pass (allow is off)")
        if row.arrival_tick >= 0:
            later = _within(self.arriving.cuts, row.due_ns)
            facts["cut_at_arrival"] = later
            parts.append(f"at arrival {'cut' if later else 'no partition'}")
            if settings.ttl_ns is not None:
                age_ns = row.due_ns - row.sent_ns
                parts.append(f"{_time(age_ns)} old of at most {_time(settings.ttl_ns)}")
        return ", ".join(parts), facts

    def _duty(self) -> tuple[str, dict[str, Any]]:
        settings = self.settings
        share, window_ns = settings.duty_cycle, settings.duty_window_ns
        facts = {"duty_cycle": share, "window_ns": window_ns, "airtime_ns": self.row.airtime_ns}
        left = f", the packet takes {_time(self.row.airtime_ns)}" if self.row.airtime_ns else ""
        left = ", not enough of it is left" if self.dropped_by == "duty" else left
        return f"{100 * share:g} % of {_time(window_ns)} on air{left}", facts

    def _queue(self) -> tuple[str, dict[str, Any]]:
        row, queue = self.row, self.settings.queue
        facts: dict[str, Any] = {"bytes": row.queue_bytes, "wait_ns": row.queue_ns, "packets_max": queue.packets}
        facts |= {"bytes_max": queue.bytes_max, "wait_max_ns": queue.wait_ns, "drop": queue.drop}
        limits = f"{queue.packets} packets, {queue.bytes_max} B, {_time(queue.wait_ns)}; {queue.drop}"
        return f"{row.queue_bytes} B before it, waits {_time(row.queue_ns)} (at most {limits})", facts

    def _medium(self) -> tuple[str, dict[str, Any]]:
        row = self.row
        facts: dict[str, Any] = {"rate_bps": row.rate_bps, "airtime_ns": row.airtime_ns}
        text = f"{_time(row.airtime_ns)} on the {'air' if self.setup.is_radio else 'wire'}"
        text += f" at {rate_text(row.rate_bps)}" if row.rate_bps else ""
        if not self.setup.is_radio:
            return text, facts
        how = "broadcast, once" if row.published and self.settings.published == "broadcast" else "unicast"
        facts |= {"contenders": row.contenders, "access_ns": row.access_ns, "retries": row.retries, "how": how}
        stations = "no other station" if row.contenders <= 1 else f"{row.contenders} stations contend"
        return f"{how}: {stations}, access {_time(row.access_ns)}, {row.retries} retries, {text}", facts

    def _channel(self) -> tuple[str, dict[str, Any]]:
        row = self.row
        budget = self.setup.budget
        assert budget is not None, "a radio"
        noise = budget.propagation.noise_cdbm / 100.0
        walls = self._walls()
        facts: dict[str, Any] = {"distance_m": row.distance_mm / 1000.0, "walls": walls}
        facts["walls_db"] = row.walls_cdb / 100.0
        through = f", through {_listed(walls)} ({row.walls_cdb / 100.0:g} dB in all)" if walls else ", in line of sight"
        text = f"{row.distance_mm / 1000.0:g} m{through}"
        if row.cause in ("out_of_range", "blocked") and not row.received_cdbm:
            return f"{text}, nothing gets through", facts
        facts |= {
            "path_loss_db": row.path_loss_cdb / 100.0,
            "shadowing_db": row.shadowing_cdb / 100.0,
            "fading_db": row.fading_cdb / 100.0,
            "received_dbm": row.received_cdbm / 100.0,
            "noise_dbm": noise,
            "snr_db": row.snr_cdb / 100.0,
            "interference_dbm": row.interference_cdbm / 100.0 if row.interference_cdbm else None,
            "error_rate": row.error_ppm / 1e6,
        }
        text += f", path loss {row.path_loss_cdb / 100.0:g} dB (shadowing {row.shadowing_cdb / 100.0:g}"
        text += f", fading {row.fading_cdb / 100.0:g})" if self.settings.fading is not None else ")"
        text += f", received {row.received_cdbm / 100.0:g} dBm over {noise:g} dBm of noise: {row.snr_cdb / 100.0:g} dB"
        if row.interference_cdbm:
            text += f", others {row.interference_cdbm / 100.0:g} dBm"
        word = word_of(row.error_word)
        if word is not None:
            text += f", error rate {row.error_ppm / 1e6:.6g}, draw {_share(word)}"
            facts["error_draw"] = word / UNIT
        return text, facts

    def _walls(self) -> dict[str, float | None]:
        """Return what is in the way, with what each takes in dB; None where it is not known any more.

        Bodies move: the newest captured frame before the packet tells, if what it says adds up to what the row has.
        """
        row, budget = self.row, self.setup.budget
        frame = self._frame()
        if not row.walls or frame is None or budget is None:
            return dict.fromkeys(row.walls)
        self.fabric.turn_to(frame)
        of, world = budget.propagation, self.fabric.world
        ends = frozenset((world.body(row.source), world.body(row.destination)))
        a, b = sorted((of.place(row.source).at, of.place(row.destination).at))
        crossings = world.crossings(a, b, ends)
        known = [(crossing.name, of.taken_db(crossing, a, b, ends)) for crossing in crossings]
        total = round(sum(loss_db for _, loss_db in known) * 100.0)
        if sorted(name for name, _ in known) != sorted(row.walls) or abs(total - row.walls_cdb) > 1:
            return dict.fromkeys(row.walls)
        return {name: round(loss_db, 2) for name, loss_db in known}

    def _frame(self) -> Frame | None:
        found = None
        for frame in self.capture.each_frame():
            if frame.tick > self.tick:
                break
            found = frame
        return found

    def _residual(self) -> tuple[str, dict[str, Any]]:
        row, stage = self.row, self.stages["residual"]
        assert isinstance(stage, Residual)
        threshold, draw = stage.threshold(bad=row.is_bad), self.words[Slot.LOSS]
        state = "bad" if row.is_bad else "good"
        below = "below" if draw < threshold else "not below"
        facts = {"state": state, "loss_rate": threshold / UNIT, "loss_draw": draw / UNIT}
        return f"{state} state, loss draw {_share(draw)} is {below} {_share(threshold)}", facts

    def _model(self) -> tuple[str, dict[str, Any]]:
        model, extra_ns = self.settings.model, self.row.model_ns
        assert model is not None, "a link with a model of one's own"
        facts = {"model": model.name, "parameters": dict(model.parameters), "extra_ns": extra_ns}
        facts["package"] = self.capture.about.versions.get(VERSION_KEY + model.name, "")
        failed = ", which failed" if self.row.cause == MODEL_FAILED else ""
        return f"{model.name} of {facts['package']}{failed}, {_time(extra_ns)} more delay", facts

    def _mangle(self) -> tuple[str, dict[str, Any]]:
        row, settings = self.row, self.settings
        parts, facts = [], {"bits_flipped": row.bits_flipped}
        if settings.corrupt is not None:
            flipped = "some" if row.cause == "crc_fail" else str(row.bits_flipped)
            parts.append(f"{flipped} bits flipped at {settings.corrupt.bit_error_rate:g} a bit")
        if settings.duplicate and row.copy == 0:
            draw, threshold = self.words[Slot.DUPLICATE], chance_threshold(settings.duplicate)
            parts.append(f"{'a copy' if draw < threshold else 'no copy'}: draw {_share(draw)}, {settings.duplicate:g}")
        return ", ".join(parts) or "a copy is not copied again", facts

    def _delay(self) -> tuple[str, dict[str, Any]]:
        row = self.row
        parts = dict(self._spent())
        waits_ns = row.due_ns - row.sent_ns - sum(parts.values())
        if waits_ns > 0:
            parts["order, behind the one before it"] = waits_ns
        told = " + ".join(f"{what} {_time(ns)}" for what, ns in parts.items()) or "no delay"
        return f"{told} = due {_time(row.due_ns)}", {**parts, "due_ns": row.due_ns}

    def _spent(self) -> Iterator[tuple[str, int]]:
        row, settings = self.row, self.settings
        bad_ns = settings.burst.bad_extra_delay_ns if settings.burst is not None and row.is_bad else 0
        reorder = settings.reorder
        late = reorder is not None and self.words[Slot.REORDER] < chance_threshold(reorder.probability)
        spent = {
            "phase": row.phase_ns,
            "queue": row.queue_ns,
            "access": row.access_ns,
            "airtime": row.airtime_ns,
            "way": row.propagation_ns,
            "constant": settings.delay_ns,
            "link model": row.model_ns,
            "jitter": row.jitter_ns,
            "bad time": bad_ns,
            "reordered": reorder.extra_ns if reorder is not None and late else 0,
            "clog": row.held_ns,
        }
        return ((what, ns) for what, ns in spent.items() if ns)

    def _capacity(self) -> tuple[str, dict[str, Any]]:
        most, is_evicted = self.settings.capacity, self.row.cause == EVICTED
        text = "another one took its place" if is_evicted else "it kept its place"
        return f"at most {most} on their way at once, {text}", {"capacity": most, "evicted": is_evicted}

    def _receiver(self) -> tuple[str, dict[str, Any]]:
        row = self.row
        if row.cause == TRANSIT_FULL:
            return "what is on its way in the whole run leaves no room for it", {"due_ns": row.due_ns}
        facts = {"due_ns": row.due_ns, "arrival_tick": row.arrival_tick, "wall_released_ns": row.wall_released_ns}
        released = f", left for it at {row.wall_released_ns} ns of the vHub's clock" if row.wall_released_ns else ""
        taken = {"rx_down": ", down or gone", "rx_full": ", full"}.get(row.cause, "")
        return f"due {_time(row.due_ns)}, arrives at tick {row.arrival_tick}{taken}{released}", facts


def _within(times: tuple[tuple[int, int], ...], at_ns: int) -> bool:
    return any(start_ns <= at_ns < end_ns for start_ns, end_ns in times)


def _listed(walls: dict[str, float | None]) -> str:
    return ", ".join(name if loss_db is None else f"{name} {loss_db:g} dB" for name, loss_db in walls.items())
