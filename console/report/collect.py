"""Collects a report on a captured run's network: counts, delays and losses over time, causes, ages, queues, places.

Gathered in one pass over the packets, with bins and samples of bounded size, whatever the length of the run. Times are
simulated; a packet is counted when it was sent.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from pydantic import ValidationError

from foosim.analysis.age_tallies import AgeAtUse, AgeTallies
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import DECODERS, TICK_MARKS, CaptureData, FrameReader, Scan, TickMark, chain_at_start
from foosim.capture.rows import AGES, PACKETS, TICK, PacketRow
from foosim.common.units import format_ns
from foosim.console.report.map import Map, MapMaker
from foosim.console.report.tallies import BinTally, LinkTally, RuleTally, SenderTally
from foosim.console.shown.asked import edit_text, moves
from foosim.console.shown.timeline import WorldEvents
from foosim.deployment.network.radios import Radio
from foosim.deployment.network.rules import event_of
from foosim.deployment.network.settings_text import event_words, impairments_text, radio_text, rule_ends, sends_once
from foosim.vhub.links.summary import delay_of, residual_of
from foosim.vhub.network.timeline import Timeline
from foosim.world.assembly.world import mark_kinds
from foosim.world.frame import Frame, chain_next

BINS: Final = 60
"""At most so many spans of time."""
CHANNELS_MAX: Final = 64
"""Channels that are told apart; those that come later are one."""
CHANNELS_SHOWN: Final = 8
OTHERS: Final = "(others)"
BANDS_MAX: Final = 500
LINKS_OF_LOSSES: Final = 50


@dataclass(frozen=True, slots=True)
class RadioText:
    """A radio of the deployment, who carries it, and what of it is not a default."""

    name: str
    preset: str
    carriers: int
    settings: str


@dataclass(frozen=True, slots=True)
class RuleText:
    """A rule of the deployment: its selectors, and its settings."""

    name: str
    ends: str
    settings: str


@dataclass(frozen=True, slots=True)
class LinkReport:
    """One directed link. Delays are of what was delivered; ages are None where nothing was."""

    source: str
    destination: str
    offered: int
    delivered: int
    dropped: int
    causes: dict[str, int]
    delay_mean_ms: float
    delay_most_ms: float
    age_mean_ms: float | None
    age_most_ms: float | None


@dataclass(frozen=True, slots=True)
class UseReport:
    """One channel at one receiver: how old its newest packet was when the receiver acted, beside the mean delay."""

    source: str
    destination: str
    channel: str
    delay_mean_ms: float
    """Of the link, over all its channels."""
    age: AgeAtUse


@dataclass(frozen=True, slots=True)
class BinReport:
    """One channel in one span of time; delays are 0 where nothing was delivered."""

    delivered: int
    dropped: int
    p50_ms: float
    p95_ms: float


@dataclass(frozen=True, slots=True)
class ChannelReport:
    """One channel over time, and over the whole run."""

    name: str
    packets: int
    delivered: int
    dropped: int
    bins: tuple[BinReport, ...]


@dataclass(frozen=True, slots=True)
class SenderReport:
    """One radio of an endpoint, or one queue of a wire, and what was sent by it."""

    source: str
    medium: str
    """The radio's name, or the rule's."""
    transmissions: int
    queue_mean_ms: float
    queue_p95_ms: float
    queue_most_ms: float
    access_mean_ms: float
    access_most_ms: float
    retries: int
    airtime_share: float


@dataclass(frozen=True, slots=True)
class RuleReport:
    """What is configured for a rule's links over a radio, and what was measured on them.

    The link's own loss is what was lost singly or in bursts, of what came so far; its own delay is all that queue,
    medium, way, clocks and clogs do not explain. Radios, partitions and events do the rest.
    """

    rule: str
    radio: str
    links: int
    packets: int
    own_loss_configured: float
    own_loss: float
    own_delay_configured_ms: float
    own_delay_ms: float
    loss: float
    delay_mean_ms: float
    delay_p50_ms: float
    delay_p95_ms: float
    is_changed: bool
    """Whether events changed settings meanwhile."""


@dataclass(frozen=True, slots=True)
class Happening:
    """An event of the network or of the world, and whether it was asked for while the run went on; `kind` is that of
    what the world's rules did (`console.shown.timeline`)."""

    at_ns: int
    text: str
    is_asked: bool
    kind: str = ""


@dataclass(frozen=True, slots=True)
class Band:
    """A time in which something held: `partition`, `clog` or `settings`."""

    kind: str
    start_ns: int
    end_ns: int
    text: str


@dataclass(frozen=True, slots=True)
class Mark:
    """A loss or return of a process."""

    at_ns: int
    text: str


@dataclass(frozen=True, slots=True)
class Report:
    """A captured run's network."""

    name: str
    metadata: dict[str, str]
    finished: bool
    start_ns: int
    end_ns: int
    tick_ns: int
    ticks: int
    digest: str
    chain: str
    fates: dict[str, int]
    copies: int
    causes: dict[str, int]
    radios: tuple[RadioText, ...]
    rules: tuple[RuleText, ...]
    defaults: str
    bin_ns: int
    links: tuple[LinkReport, ...]
    uses: tuple[UseReport, ...]
    channels: tuple[ChannelReport, ...]
    causes_over_time: dict[str, tuple[int, ...]]
    senders: tuple[SenderReport, ...]
    measured: tuple[RuleReport, ...]
    happenings: tuple[Happening, ...]
    looks: dict[str, str]
    """How marks of the kinds that the world's rules bring look, by kind."""
    bands: tuple[Band, ...]
    bands_left: int
    marks: tuple[Mark, ...]
    map: Map


def gather(capture: CaptureData, name: str) -> Report:
    """Return the report of an opened capture; `name` is what it is called. Raises CaptureError for a damaged one."""
    gathered = _Gathered(capture)
    scan = Scan(capture.path)
    frames = FrameReader(scan, capture.deployment)
    for message in scan.messages(FrameReader.TOPICS | {PACKETS, TICK, AGES}):
        if message.topic == PACKETS:
            gathered.take_packet(scan.decode(DECODERS[PACKETS], message))
        elif message.topic == TICK:
            gathered.take_tick(scan.decode(TICK_MARKS, message))
        elif message.topic == AGES:
            gathered.ages.take_row(scan.decode(DECODERS[AGES], message))
        else:
            frame = frames.frame(message)
            if frame is not None:
                gathered.take_frame(frame)
    return gathered.result(name)


def bin_width_ns(span_ns: int, tick_ns: int) -> int:
    """Return the least width of 1, 2 or 5 times a power of ten ns, at least a tick, with which BINS cover a span."""
    width, step = 1, 0
    while width * BINS < span_ns or width < tick_ns:
        step += 1
        width = (1, 2, 5)[step % 3] * 10 ** (step // 3)
    return width


class _Gathered:
    def __init__(self, capture: CaptureData) -> None:
        self._capture = capture
        deployment = self._deployment = capture.deployment
        self._tick_ns = deployment.tick_ns
        ticks = capture.ticks
        self._start_ns = int(ticks[0]) * self._tick_ns if len(ticks) else 0
        self._end_ns = int(ticks[-1]) * self._tick_ns if len(ticks) else 0
        self._bin_ns = bin_width_ns(self._end_ns - self._start_ns, self._tick_ns)
        self._bins = max(1, -(-(self._end_ns - self._start_ns) // self._bin_ns))
        network = deployment.network
        seed = deployment.seed if network.seed is None else network.seed
        self._timeline = Timeline(network, seed, deployment.endpoints())
        self._happenings = [Happening(event.at_ns, event_words(event), is_asked=False) for event in network.events]
        self._fates: Counter[str] = Counter()
        self._copies = 0
        self._causes: dict[str, list[int]] = {}
        self._links: defaultdict[tuple[str, str], LinkTally] = defaultdict(LinkTally)
        self._channels: dict[str, list[BinTally]] = {}
        self._packets: Counter[str] = Counter()
        self._senders: dict[tuple[str, str], SenderTally] = {}
        self._rules: dict[tuple[str, str], RuleTally] = {}
        self._settings: dict[tuple[str, str], Radio] = {}
        self._map, self._rules_did = MapMaker(deployment, self._tick_ns), WorldEvents(deployment)
        self.ages = AgeTallies(self._tick_ns)

    # --- rows --------------------------------------------------------------------------------------------------------

    def take_packet(self, row: PacketRow) -> None:
        number = min(max(row.sent_ns - self._start_ns, 0) // self._bin_ns, self._bins - 1)
        self._fates[row.fate] += 1
        self._copies += row.copy > 0
        self._links[row.source, row.destination].add(row)
        self._channel(row.channel)[number].add(row)
        if row.fate == "dropped":
            self._causes.setdefault(row.cause, [0] * self._bins)[number] += 1
            self._map.take_loss(row)
        by = row.rule, row.radio
        if by not in self._rules:
            self._rules[by], self._settings[by] = RuleTally(*by), self._profile(row)
        self._rules[by].add(row)
        if row.airtime_ns or row.queue_ns or row.access_ns:
            sender = row.source, row.radio or row.rule
            if sender not in self._senders:
                self._senders[sender] = SenderTally(*sender)
            self._senders[sender].add(row, sends_once=sends_once(self._settings[by]))

    def _channel(self, name: str) -> list[BinTally]:
        if name not in self._channels and len(self._channels) >= CHANNELS_MAX:
            name = OTHERS
        self._packets[name] += 1
        if name not in self._channels:
            self._channels[name] = [BinTally("channel", name, str(n)) for n in range(self._bins)]
        return self._channels[name]

    def _profile(self, row: PacketRow) -> Radio:
        profiles = self._deployment.profiles()
        return profiles.find(row.source, row.destination, row.channel).settings

    def take_tick(self, row: TickMark) -> None:
        for edit in row.edits:
            text = edit_text(edit)
            if text:
                edited_ns = (row.tick - 1) * self._tick_ns  # an edit belongs to the tick that led to this frame
                self._happenings.append(Happening(edited_ns, text, is_asked=True))
            if edit.kind == "network":
                at_ns = row.tick * self._tick_ns
                try:
                    event = event_of(edit.event, at_ns)
                except (ValidationError, ValueError, TypeError) as error:
                    raise CaptureError(
                        f"{self._capture.path}: tick {row.tick}: no event of a network: {error}"
                    ) from None
                self._timeline.add(event)
                self._happenings.append(Happening(at_ns, event_words(event), is_asked=True))

    def take_frame(self, frame: Frame) -> None:
        self._map.take_frame(frame)
        did = self._rules_did.take(frame)
        self._happenings += [Happening(mark.tick * self._tick_ns, mark.text, False, mark.kind) for mark in did]

    # --- the result --------------------------------------------------------------------------------------------------

    def result(self, name: str) -> Report:
        capture, network = self._capture, self._deployment.network
        chain = chain_at_start(capture.about)
        for number, digest in enumerate(capture.digests):
            chain = chain if number == 0 else chain_next(chain, digest.tobytes())
        moved = [Happening(tick * self._tick_ns, text, is_asked=True) for tick, text in moves(capture.epochs)]
        bands = sorted(self._bands(), key=lambda band: (band.start_ns, band.kind, band.text))
        return Report(
            name,
            {**capture.about.metadata, **capture.about.end},
            capture.finished,
            self._start_ns,
            self._end_ns,
            self._tick_ns,
            max(0, len(capture.ticks) - 1),
            capture.digests[-1].tobytes().hex() if len(capture.digests) else "",
            chain.hex() if len(capture.digests) else "",
            {"offered": self._fates.total(), **{f: self._fates[f] for f in ("delivered", "dropped", "in_flight")}},
            self._copies,
            {cause: sum(counts) for cause, counts in sorted(self._causes.items())},
            tuple(self._radios()),
            tuple(RuleText(rule.id, rule_ends(rule), impairments_text(rule)) for rule in network.links),
            f"preset {network.defaults.preset}, phase {format_ns(network.defaults.phase_ns)}, "
            f"in flight when a partition begins: {network.defaults.in_flight_on_partition}",
            self._bin_ns,
            tuple(self._link(*ends) for ends in sorted(self._links)),
            tuple(UseReport(*ends, self._delay_ms(*ends[:2]), age) for ends, age in self.ages.result().items()),
            tuple(self._channel_report(channel) for channel, _ in self._packets.most_common(CHANNELS_SHOWN)),
            {cause: tuple(counts) for cause, counts in sorted(self._causes.items())},
            tuple(self._sender(*key) for key in sorted(self._senders)),
            tuple(self._rule(*key) for key in sorted(self._rules)),
            tuple(sorted([*self._happenings, *moved], key=lambda happening: happening.at_ns)),
            {name: kind.look for name, kind in mark_kinds(self._deployment).items()},
            tuple(bands[:BANDS_MAX]),
            max(0, len(bands) - BANDS_MAX),
            tuple(self._marks()),
            self._map.result(LINKS_OF_LOSSES),
        )

    def _radios(self) -> Iterator[RadioText]:
        network = self._deployment.network
        profiles = self._deployment.profiles(network)
        ends = self._deployment.endpoints()
        carried = Counter(radio for endpoint in ends for radio in profiles.radios_of(endpoint))
        for name, radio in network.radios.items():
            yield RadioText(name, radio.preset, carried[name], radio_text(radio))

    def _link(self, source: str, destination: str) -> LinkReport:
        tally = self._links[source, destination]
        age = tally.age_ns(self._end_ns)
        counts = tally.offered, tally.delivered, tally.dropped, dict(sorted(tally.causes.items()))
        delays_ms = self._delay_ms(source, destination), _ms(tally.delay_most_ns)
        return LinkReport(source, destination, *counts, *delays_ms, *((None, None) if age is None else map(_ms, age)))

    def _delay_ms(self, source: str, destination: str) -> float:
        """Return a link's mean delay, 0 where nothing was delivered."""
        tally = self._links.get((source, destination))
        return _ms(tally.delay_total_ns / tally.delivered) if tally is not None and tally.delivered else 0.0

    def _channel_report(self, name: str) -> ChannelReport:
        tallies = self._channels[name]
        bins = tuple(
            BinReport(tally.delivered, tally.dropped, _ms(tally.delay.quantile(0.5)), _ms(tally.delay.quantile(0.95)))
            for tally in tallies
        )
        delivered, dropped = sum(tally.delivered for tally in tallies), sum(tally.dropped for tally in tallies)
        return ChannelReport(name, self._packets[name], delivered, dropped, bins)

    def _sender(self, source: str, medium: str) -> SenderReport:
        tally, span_ns = self._senders[source, medium], self._end_ns - self._start_ns
        queue, access = tally.queue, tally.access
        queue_ms = _ms(queue.mean), _ms(queue.quantile(0.95)), _ms(queue.most)
        access_ms = _ms(access.mean), _ms(access.most)
        share = round(tally.airtime_ns / span_ns, 6) if span_ns else 0.0
        return SenderReport(source, medium, queue.count, *queue_ms, *access_ms, tally.retries, share)

    def _rule(self, rule: str, radio: str) -> RuleReport:
        tally, settings = self._rules[rule, radio], self._settings[rule, radio]
        delivered = tally.delay.count
        judged = delivered + tally.dropped
        changes = [
            change
            for change in self._timeline.settings
            if change.start_ns < min(change.end_ns, self._end_ns) and change.rule in (rule, "")
        ]
        return RuleReport(
            rule,
            radio,
            len(tally.links),
            tally.offered,
            round(residual_of(settings)[0], 9),
            round(tally.residual / (tally.passed + tally.residual), 9) if tally.passed + tally.residual else 0.0,
            _ms(delay_of(settings, self._deployment.asset_files)[0]),
            _ms(tally.own.mean),
            round(tally.dropped / judged, 9) if judged else 0.0,
            _ms(tally.delay.mean),
            _ms(tally.delay.quantile(0.5)),
            _ms(tally.delay.quantile(0.95)),
            bool(changes),
        )

    def _bands(self) -> Iterator[Band]:
        timeline = self._timeline
        for cut in timeline.cuts:
            groups = " | ".join(_members(group) for group in cut.groups)
            yield from self._band(
                "partition", cut.start_ns, cut.end_ns, groups if cut.is_symmetric else f"{groups}, one way"
            )
        for hold in timeline.holds:
            yield from self._band(
                "clog", hold.start_ns, hold.end_ns, f"{_members(hold.sources)} to {_members(hold.destinations)}"
            )
        for change in timeline.settings:
            yield from self._band(
                "settings", change.start_ns, change.end_ns, f"{change.rule}: {impairments_text(change.changes)}"
            )

    def _band(self, kind: str, start_ns: int, end_ns: int, text: str) -> Iterator[Band]:
        """Yield a band as far as it lies in the run."""
        start_ns, end_ns = max(start_ns, self._start_ns), min(end_ns, self._end_ns)
        if start_ns < end_ns:
            yield Band(kind, start_ns, end_ns, text)

    def _marks(self) -> Iterator[Mark]:
        for row in self._capture.recoveries:
            outage = f", {row.wall_outage_ns / 1e6:.0f} ms without a commit" if row.wall_outage_ns else ""
            yield Mark(row.tick * self._tick_ns, f"{row.what} {row.name}: {row.reason}{outage}")


def _ms(ns: float) -> float:
    return round(ns / 1e6, 6)


def _members(names: frozenset[str]) -> str:
    shown = sorted(names)[:6]
    return ", ".join(shown) + (f" and {len(names) - len(shown)} more" if len(names) > len(shown) else "")
