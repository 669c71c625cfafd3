"""What each stage of its link looked at in a captured packet, in words and numbers; what decided its fate is among it.

A row has what a fate came from. What does not need to stand there is worked out again, exactly: draws and what they are
compared with, airtime, outages, attempts on the medium, which event cut a link.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import groupby
from typing import Any, Final, Protocol

from foosim.analysis.explain_radio import attempts_of, lora_text, ratio_db
from foosim.capture.columns import word_of
from foosim.capture.rows import ClientRow, PacketRow
from foosim.common.format import EXACT, rate_text, time_text
from foosim.common.keyed_random import UNIT, Slot, chance_threshold, draw_words
from foosim.deployment.schema import Deployment
from foosim.vhub.links.fabric import Fabric
from foosim.vhub.network.custom_models import VERSION_KEY
from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.network.packet import size_of_payload
from foosim.vhub.network.timeline import FOREVER_NS
from foosim.vhub.stages import STAGES
from foosim.vhub.stages.admission import NODE_DOWN
from foosim.vhub.stages.corruption import CRC_FAIL, Mangle
from foosim.vhub.stages.custom_model import MODEL, MODEL_FAILED
from foosim.vhub.stages.duty import Duty
from foosim.vhub.stages.queue import CODEL, QUEUE_FULL
from foosim.vhub.stages.receiver import RECEIVER_DOWN, RECEIVER_FULL
from foosim.vhub.stages.residual import Residual
from foosim.vhub.state.in_flight_limit import TRANSIT_FULL
from foosim.world.frame import Frame

Told = tuple[str, dict[str, Any]]
"""What a stage found, as a text and as facts."""

STAGE_NAMES: Final = (
    *("admission", "policy", "duty", "queue", "medium", "channel", "residual", "custom_model", "corruption", "delay"),
    "receiver",
)
_AT_SENDING: Final = {
    **dict.fromkeys(("too_big", "node_down", "no_route"), "admission"),
    **dict.fromkeys(("partition", "filtered"), "policy"),
    **dict.fromkeys(("duty_cycle",), "duty"),
    **dict.fromkeys(("queue_full", "queue_codel", "expired"), "queue"),
    **dict.fromkeys(("out_of_range", "blocked", "snr", "collision"), "channel"),
    **dict.fromkeys(("random_loss", "burst_loss"), "residual"),
    **dict.fromkeys((MODEL, MODEL_FAILED), "custom_model"),
    **dict.fromkeys(("crc_fail",), "corruption"),
    **dict.fromkeys((TRANSIT_FULL,), "receiver"),
}
_AT_ARRIVAL: Final = {
    **dict.fromkeys(("partition", "expired"), "policy"),
    **dict.fromkeys(("collision", "snr", "out_of_range"), "channel"),
    **dict.fromkeys(("rx_down", "rx_full"), "receiver"),
}
"""Which stage has dropped a packet, by cause."""


def _time(ns: int) -> str:
    return time_text(ns, EXACT)


def _share(word: int) -> str:
    return f"{word / UNIT:.6g}"


def _beside(draw: int, threshold: int) -> str:
    """Return a draw beside the threshold that it is compared with."""
    return f"draw {_share(draw)} is {'below' if draw < threshold else 'not below'} {_share(threshold)}"


class Evidence(Protocol):
    """The context of a row: a capture, or the recent state of a running system."""

    @property
    def deployment(self) -> Deployment: ...

    @property
    def versions(self) -> Mapping[str, str]:
        """Of libraries and link models, by name."""

    def asked(self, until: int) -> Iterable[tuple[int, str]]:
        """Return what was asked of the network up to a tick: ticks and events as JSON, in their order."""

    def frame(self, tick: int) -> Frame | None:
        """Return the newest frame at or before a tick, None where there is none."""

    def clients(self) -> Iterable[ClientRow]:
        """Return who joined and left, in their order."""


class Stages:
    """One row, and the link that it went over as it was then."""

    def __init__(self, evidence: Evidence, row: PacketRow) -> None:
        self.evidence, self.row = evidence, row
        self.tick_ns = evidence.deployment.tick_ns
        self.fabric = Fabric(evidence.deployment)
        self.tick = row.sent_ns // self.tick_ns
        last = max(self.tick, row.arrival_tick)
        asked = [*evidence.asked(last)]
        self._take(asked, 0, self.tick)
        self.link = self.fabric.link(row.source, row.destination, row.channel)
        self.setup: LinkSetup = self.link.setup_at(row.sent_ns)
        self.settings = self.setup.settings
        self.stages = dict(zip(STAGE_NAMES, (make(self.setup) for make in STAGES), strict=True))
        draws = self.setup.draws
        self.number = draws.number(row.sequence, self.tick, row.count)
        """The number of its draws under their key."""
        self.words = draw_words(draws.of(row.channel), self.number, row.copy)
        """Its draws by slot, made again."""
        self._take(asked, self.tick + 1, last)
        """From here on what is known of cuts is what was known when it arrived."""
        self.is_broadcast = row.published and self.setup.sends_once

    def _take(self, asked: list[tuple[int, str]], first: int, last: int) -> None:
        for tick, event in asked:
            if first <= tick <= last:
                self.fabric.take(tick, tick * self.tick_ns, event)

    def has(self, name: str) -> bool:
        """Whether a stage is on the link, or has dropped the packet all the same: whose body was out of service."""
        return self.stages[name] is not None or name == self.dropped_by

    def tell(self, name: str) -> Told:
        """Return what a stage found."""
        tell: Callable[[], Told] = getattr(self, f"_{name}")
        return tell()

    @property
    def agrees(self) -> bool:
        """Whether no draw of the row is another when it is made again."""
        row = self.row
        of_row = {Slot.LOSS: row.loss_word, Slot.JITTER: row.jitter_word, Slot.ERROR: row.error_word}
        return all(not word or word == f"{self.words[slot]:016x}" for slot, word in of_row.items())

    @property
    def dropped_by(self) -> str:
        """The stage that has dropped it; empty for none."""
        row = self.row
        if row.fate != "dropped":
            return ""
        if row.decided_by.collision == "contention":
            return "medium"
        return (_AT_ARRIVAL if row.arrival_tick >= 0 else _AT_SENDING).get(row.cause, "receiver")

    # --- stages ------------------------------------------------------------------------------------------------------

    def _admission(self) -> Told:
        row, longest = self.row, self.settings.payload_max
        if not self.setup.is_routed:
            return "the ends have no radio in common, or not that of their rule", {"routed": False}
        is_down = row.cause == NODE_DOWN
        state = f"out of service{self._on_board(row.source)}" if is_down else "in service"
        limit = "any size" if longest is None else f"at most {longest} B"
        return f"{row.size} B of {limit}, sender {state}", {"size": row.size, "mtu": longest, "sender": state}

    def _on_board(self, endpoint: str) -> str:
        body = self.fabric.world.body(endpoint)
        return "" if body == endpoint else f" with {body}, which it is on board of"

    def _policy(self) -> Told:
        row, settings = self.row, self.settings
        cut, found = self._cut(row.sent_ns)
        parts = [f"at sending {found}"]
        facts: dict[str, Any] = {"cut_at_sending": cut, "allow": settings.allow, "ttl_ns": settings.ttl_ns}
        if not settings.allow:
            parts.append("nothing may pass (allow is off)")
        if row.arrival_tick >= 0:
            facts["cut_at_arrival"], found = self._cut(row.due_ns)
            parts.append(f"at arrival {found}")
            if settings.ttl_ns is not None:
                age_ns = row.due_ns - row.sent_ns
                parts.append(f"{_time(age_ns)} old of at most {_time(settings.ttl_ns)}")
        return ", ".join(parts), facts

    def _cut(self, at_ns: int) -> tuple[str, str]:
        """Return the event that cuts the link at a time, and a text of it; `event N` is the deployment's, from 0 on."""
        cut = self.fabric.timeline.cut_at(self.row.source, self.row.destination, at_ns)
        if cut is None:
            return "", "no partition"
        until = f" to {_time(cut.end_ns)}" if cut.end_ns < FOREVER_NS else " on"
        return cut.event, f"cut by {cut.event}, from {_time(cut.start_ns)}{until}"

    def _duty(self) -> Told:
        row, settings, stage = self.row, self.settings, self.stages["duty"]
        assert isinstance(stage, Duty)
        share, window_ns = settings.duty_cycle, settings.duty_window_ns
        airtime_ns = stage.airtime_ns(row.size, row.published)
        facts: dict[str, Any] = {"duty_cycle": share, "window_ns": window_ns, "airtime_ns": airtime_ns}
        text = f"{100 * share:g} % of any {_time(window_ns)} on air, the packet takes {_time(airtime_ns)}"
        if self.dropped_by == "duty":
            facts["left_ns"] = row.decided_by.duty_left_ns
            text += f", {_time(row.decided_by.duty_left_ns)} is left of the one that ends with it"
        return text, facts

    def _queue(self) -> Told:
        row, decided = self.row, self.row.decided_by
        queue = (self.setup.shared if self.setup.sends_once and row.published else self.settings).queue
        facts: dict[str, Any] = {"bytes": row.queue_bytes, "wait_ns": row.queue_ns, "packets_max": queue.packets}
        facts |= {"bytes_max": queue.bytes_max, "wait_max_ns": queue.wait_ns, "drop": queue.drop}
        limits = f"{queue.packets} packets, {queue.bytes_max} B, {_time(queue.wait_ns)}; {queue.drop}"
        before = f"{row.queue_bytes} B"
        if row.cause in (QUEUE_FULL, CODEL):
            facts["packets"] = decided.queue_packets
            before = f"{decided.queue_packets} packets of {row.queue_bytes} B"
        text = f"{before} before it, waits {_time(row.queue_ns)} (at most {limits})"
        if row.cause == CODEL:
            facts |= {"target_ns": queue.codel_target_ns, "interval_ns": queue.codel_interval_ns}
            facts |= {"above_ns": decided.codel_above_ns, "drops": decided.codel_drops}
            above, target = _time(decided.codel_above_ns), _time(queue.codel_target_ns)
            text += f", for {above} above {target}, drop {decided.codel_drops}"
        return text, facts

    def _medium(self) -> Told:
        row = self.row
        facts: dict[str, Any] = {"rate_bps": row.rate_bps, "airtime_ns": row.airtime_ns}
        text = f"{_time(row.airtime_ns)} on the {'air' if self.setup.is_radio else 'wire'}"
        text += f" at {rate_text(row.rate_bps)}" if row.rate_bps else ""
        if not self.setup.is_radio:
            return text, facts
        how = "broadcast, once" if self.is_broadcast else "unicast"
        facts |= {"contenders": row.contenders, "access_ns": row.access_ns, "retries": row.retries, "how": how}
        stations = "no other station" if row.contenders <= 1 else f"{row.contenders} stations contend"
        text = f"{how}: {stations}, access {_time(row.access_ns)}, {row.retries} retries, {text}"
        chance, attempts = attempts_of(row, self.number, self.setup, broadcast=self.is_broadcast)
        if attempts:
            facts |= {"collision_chance": chance, "attempts": attempts}
            runs = [(what, len(list(those))) for what, those in groupby(attempts)]
            told = ", ".join(what if count == 1 else f"{count} x {what}" for what, count in runs)
            text += f"; {told}" + (f" (an attempt collides with {chance:.6g})" if chance else "")
        return text, facts

    def _channel(self) -> Told:
        row = self.row
        budget = self.setup.budget
        assert budget is not None, "a radio"
        noise = budget.propagation.noise_cdbm / 100.0
        walls = self._walls()
        facts: dict[str, Any] = {"distance_m": row.distance_mm / 1000.0, "walls": walls, "line_of_sight": not walls}
        facts["walls_db"] = row.walls_cdb / 100.0
        through = f", through {_listed(walls)} ({row.walls_cdb / 100.0:g} dB in all)" if walls else ", in line of sight"
        text = f"{row.distance_mm / 1000.0:g} m{through}"
        if row.cause in ("out_of_range", "blocked") and not row.received_cdbm:
            facts["range_m"] = range_m = self.settings.path_loss.range_m
            reach = f" (range {range_m:g} m)" if range_m is not None and row.cause == "out_of_range" else ""
            return f"{text}, nothing gets through{reach}", facts
        facts |= {
            "path_loss_db": row.path_loss_cdb / 100.0,
            "shadowing_db": row.shadowing_cdb / 100.0,
            "fading_db": row.fading_cdb / 100.0,
            "received_dbm": row.received_cdbm / 100.0,
            "noise_dbm": noise,
            "snr_db": row.snr_cdb / 100.0,
            "interference_dbm": row.interference_cdbm / 100.0 if row.interference_cdbm else None,
            "error_rate": row.error_ppm / 1e6,
            "half_duplex": row.decided_by.collision == "half_duplex",
        }
        text += f", path loss {row.path_loss_cdb / 100.0:g} dB (shadowing {row.shadowing_cdb / 100.0:g}"
        text += f", fading {row.fading_cdb / 100.0:g})" if self.settings.fading is not None else ")"
        text += f", {row.received_cdbm / 100.0:g} dBm over {noise:g} dBm of noise is {row.snr_cdb / 100.0:g} dB"
        return text + self._judged(facts), facts

    def _judged(self, facts: dict[str, Any]) -> str:
        """Return what the channel compares a signal with."""
        row, settings = self.row, self.settings
        if row.decided_by.collision == "half_duplex":
            return f"; {row.destination} is on air itself meanwhile and hears nothing (half duplex)"
        if settings.medium == "lora":
            return lora_text(row, settings, facts)
        text = ""
        if row.interference_cdbm:
            facts["sinr_db"] = ratio_db(row, self.setup)
            text += f", others {row.interference_cdbm / 100.0:g} dBm make it {facts['sinr_db']:g} dB"
        if row.cause == "out_of_range":
            facts["sensitivity_dbm"] = settings.sensitivity_dbm
            return f"{text}, the receiver needs {settings.sensitivity_dbm:g} dBm"
        word = word_of(row.error_word)
        if word is None:
            return text
        text += f", error rate {row.error_ppm / 1e6:.6g}"
        if not self.is_broadcast and settings.medium in ("wifi", "ieee802154"):
            return f"{text} an attempt"
        facts["error_draw"] = word / UNIT
        return f"{text}, draw {_share(word)}"

    def _walls(self) -> dict[str, float | None]:
        """Return what is in the way, with what each takes in dB; None where it is not known any more.

        Bodies move: the newest captured frame before the packet tells, if what it says adds up to what the row has.
        """
        row, budget = self.row, self.setup.budget
        frame = self.evidence.frame(self.tick) if row.walls else None
        if frame is None or budget is None:
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

    def _residual(self) -> Told:
        row, stage = self.row, self.stages["residual"]
        assert isinstance(stage, Residual)
        if stage.is_out(row.sent_ns):
            return "an outage, in which all is lost", {"outage": True}
        threshold, draw = stage.threshold(bad=row.is_bad), self.words[Slot.LOSS]
        state = "bad" if row.is_bad else "good"
        facts = {"state": state, "loss_rate": threshold / UNIT, "loss_draw": draw / UNIT}
        return f"{state} state, loss {_beside(draw, threshold)}", facts

    def _custom_model(self) -> Told:
        model, extra_ns = self.settings.model, self.row.model_ns
        assert model is not None, "a link with a model of one's own"
        facts = {"model": model.name, "parameters": dict(model.parameters), "extra_ns": extra_ns}
        facts["package"] = self.evidence.versions.get(VERSION_KEY + model.name, "")
        failed = ", which failed" if self.row.cause == MODEL_FAILED else ""
        return f"{model.name} of {facts['package']}{failed}, {_time(extra_ns)} more delay", facts

    def _corruption(self) -> Told:
        row, settings, stage = self.row, self.settings, self.stages["corruption"]
        assert isinstance(stage, Mangle)
        parts: list[str] = []
        facts: dict[str, Any] = {"bits_flipped": row.bits_flipped}
        if settings.corrupt is not None:
            rate, bits = settings.corrupt.bit_error_rate, 8 * row.size
            draw, threshold = self.words[Slot.CORRUPT], stage.threshold(bits) if rate else 0
            flipped = "some" if row.cause == CRC_FAIL else str(row.bits_flipped)
            facts |= {"error_rate": threshold / UNIT, "error_draw": draw / UNIT}
            parts.append(f"{flipped} bits flipped: {_beside(draw, threshold)}, {rate:g} a bit in {bits}")
        if settings.duplicate and row.copy == 0 and row.cause != CRC_FAIL:
            draw = self.words[Slot.DUPLICATE]
            copied = "a copy" if draw < chance_threshold(settings.duplicate) else "no copy"
            parts.append(f"{copied}: draw {_share(draw)}, {settings.duplicate:g}")
        return ", ".join(parts) or "a copy is not copied again", facts

    def _delay(self) -> Told:
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

    def _receiver(self) -> Told:
        row, decided = self.row, self.row.decided_by
        if row.cause == TRANSIT_FULL:
            return "what is on its way in the whole run leaves no room for it", {"due_ns": row.due_ns}
        facts: dict[str, Any] = {"due_ns": row.due_ns, "arrival_tick": row.arrival_tick}
        facts["wall_released_ns"] = row.wall_released_ns
        released = f", left for it at {row.wall_released_ns} ns of the vHub's clock" if row.wall_released_ns else ""
        taken = ""
        if row.cause == RECEIVER_DOWN:
            facts["receiver"] = state = self._receiver_state()
            taken = f", {row.destination} {state}"
        elif row.cause == RECEIVER_FULL:
            size = size_of_payload(row.size)
            facts |= {"message_bytes": size, "room_left": decided.room_left, "room_share": decided.room_share}
            left = f"{decided.room_left} B left of {decided.room_share} B"
            taken = f", {size} B in a message in which {row.source} has {left}"
        return f"due {_time(row.due_ns)}, arrives at tick {row.arrival_tick}{taken}{released}", facts

    def _receiver_state(self) -> str:
        """Return why a receiver did not take anything: a client that has left, or never came, or a body."""
        to, here = self.row.destination, False
        if to not in self.evidence.deployment.robots:
            for client in self.evidence.clients():
                if client.client == to and client.tick <= self.row.arrival_tick:
                    here = client.event == "joins"
            if not here:
                return "is not here"
        return f"is out of service{self._on_board(to)}"


def _listed(walls: dict[str, float | None]) -> str:
    return ", ".join(name if loss_db is None else f"{name} {loss_db:g} dB" for name, loss_db in walls.items())
