"""Collects a report on a captured run's network: counts, delays and losses over time, causes, ages, queues, places.

One pass over the capture, with bins and samples of bounded size for a run of any length. Times are simulated; a packet
counts when it was sent. A report is a mapping as `foosim capture report --json` prints it; times end with their unit.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from typing import Any, Final

from pydantic import ValidationError

from foosim.analysis.age_tallies import AgeTallies
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import DECODERS, TICK_MARKS, CaptureData, FrameReader, Scan, TickMark, chain_at_start
from foosim.capture.rows import AGES, PACKETS, TICK, PacketRow
from foosim.common.units import format_ns
from foosim.console.report.map import MapMaker
from foosim.console.report.tallies import LinkAge, RuleTally, SenderTally, Tally, Times
from foosim.console.shown.timeline import EPOCH, MOVE, NETWORK, RECOVERY, Timeline
from foosim.deployment.network.link_settings import Profile
from foosim.deployment.network.rules import event_of
from foosim.deployment.network.settings_text import event_words, impairments_text, radio_text, rule_ends
from foosim.vhub.links.summary import delay_of, residual_of
from foosim.vhub.network.timeline import Timeline as NetworkTimeline
from foosim.world.assembly.world import mark_kinds
from foosim.world.frame import Frame, chain_next

BINS: Final = 60
"""The greatest number of spans of time."""
CHANNELS_MAX: Final = 64
"""Channels with bins of their own; later ones share one."""
CHANNELS_SHOWN: Final = 8
OTHERS: Final = "(others)"
BANDS_MAX: Final = 500
ENDPOINTS_MAX: Final = 60
REQUESTED: Final = frozenset({MOVE, "push", "set", "add", "remove"})
"""Kinds of marks of requests."""

Report = dict[str, Any]


def gather(capture: CaptureData, name: str) -> Report:
    """Return the report of an opened capture; `name` is its title. Raises CaptureError for a damaged one."""
    found = Collected(capture)
    scan = Scan(capture.path)
    frames = FrameReader(scan, capture.deployment)
    for message in scan.messages(FrameReader.TOPICS | {PACKETS, TICK, AGES}):
        if message.topic == PACKETS:
            found.take_packet(scan.decode(DECODERS[PACKETS], message))
        elif message.topic == TICK:
            found.take_tick(scan.decode(TICK_MARKS, message))
        elif message.topic == AGES:
            found.ages.take_row(scan.decode(DECODERS[AGES], message))
        elif (frame := frames.frame(message)) is not None:
            found.take_frame(frame)
    for epoch in capture.epochs:
        found.timeline.take_epoch(epoch)
    for recovery in capture.recoveries:
        found.timeline.take_recovery(recovery)
    return found.result(name)


def bin_width_ns(span_ns: int, tick_ns: int) -> int:
    """Return the least width of 1, 2 or 5 times a power of ten ns, at least a tick, with which BINS cover a span."""
    width, step = 1, 0
    while width * BINS < span_ns or width < tick_ns:
        step += 1
        width = (1, 2, 5)[step % 3] * 10 ** (step // 3)
    return width


class Collected:
    """The counts over one capture."""

    def __init__(self, capture: CaptureData) -> None:
        self._capture = capture
        deployment = self._deployment = capture.deployment
        self._tick_ns = deployment.tick_ns
        ticks = capture.ticks
        self._start_ns, self._end_ns = (int(ticks[at]) * self._tick_ns if len(ticks) else 0 for at in (0, -1))
        self._bin_ns = bin_width_ns(self._end_ns - self._start_ns, self._tick_ns)
        self._bins = max(1, -(-(self._end_ns - self._start_ns) // self._bin_ns))
        network = deployment.network
        seed = deployment.seed if network.seed is None else network.seed
        self._network = NetworkTimeline(network, seed, deployment.endpoints())
        self._all = [Tally() for _ in range(self._bins)]
        self._copies = 0
        self._channels: dict[str, list[Tally]] = {}
        self._links: defaultdict[tuple[str, str], Tally] = defaultdict(Tally)
        self._link_ages: defaultdict[tuple[str, str], LinkAge] = defaultdict(LinkAge)
        self._senders: dict[tuple[str, str], SenderTally] = {}
        self._rules: dict[tuple[str, str], RuleTally] = {}
        self._profiles: dict[tuple[str, str], Profile] = {}
        self.map = MapMaker(deployment)
        self.timeline = Timeline(deployment)
        self.ages = AgeTallies(self._tick_ns)

    # --- rows --------------------------------------------------------------------------------------------------------

    def take_packet(self, row: PacketRow) -> None:
        number = min(max(row.sent_ns - self._start_ns, 0) // self._bin_ns, self._bins - 1)
        link, by = (row.source, row.destination), (row.rule, row.radio)
        if by not in self._rules:
            self._rules[by] = RuleTally(*by)
            self._profiles[by] = self._deployment.profiles().find(*link, row.channel)
        self._all[number].add(row)
        self._channel(row.channel)[number].add(row)
        if row.fate == "delivered":
            self._link_ages[link].add(row.sent_ns, row.due_ns)
        elif row.fate == "dropped":
            self.map.take_loss(row)
        self._copies += row.copy > 0
        if not row.copy:
            self._links[link].add(row)
            self._rules[by].add(row)
        if row.airtime_ns or row.queue_ns or row.access_ns:
            sender = row.source, row.radio or row.rule
            if sender not in self._senders:
                self._senders[sender] = SenderTally(*sender)
            self._senders[sender].add(row, sends_once=self._profiles[by].settings.sends_once)

    def _channel(self, name: str) -> list[Tally]:
        if name not in self._channels and len(self._channels) >= CHANNELS_MAX:
            name = OTHERS
        if name not in self._channels:
            self._channels[name] = [Tally("channel", name, str(number)) for number in range(self._bins)]
        return self._channels[name]

    def take_tick(self, row: TickMark) -> None:
        self.timeline.take_edits(row.tick, row.edits)
        for edit in row.edits:
            if edit.kind == "network":
                try:
                    self._network.add(event_of(edit.event, row.tick * self._tick_ns))
                except (ValidationError, ValueError, TypeError) as error:
                    raise CaptureError(
                        f"{self._capture.path}: tick {row.tick}: not an event of a network: {error}"
                    ) from None

    def take_frame(self, frame: Frame) -> None:
        self.map.take_frame(frame)
        self.timeline.take_frame(frame)

    # --- the result --------------------------------------------------------------------------------------------------

    def result(self, name: str) -> Report:
        """Return the report."""
        capture, network = self._capture, self._deployment.network
        digests = [digest.tobytes() for digest in capture.digests]
        chain = chain_at_start(capture.about)
        for digest in digests[1:]:
            chain = chain_next(chain, digest)
        fates = sum((tally.fates for tally in self._all), Counter[str]())
        causes = sum((tally.causes for tally in self._all), Counter[str]())
        bands = sorted(self._bands(), key=lambda band: (band["start_ns"], band["kind"], band["text"]))
        return {
            "name": name,
            "metadata": {**capture.about.metadata, **capture.about.end},
            "finished": capture.finished,
            "start_ns": self._start_ns,
            "end_ns": self._end_ns,
            "tick_ns": self._tick_ns,
            "ticks": max(0, len(capture.ticks) - 1),
            "digest": digests[-1].hex() if digests else "",
            "chain": chain.hex() if digests else "",
            "fates": {"offered": fates.total(), **{f: fates[f] for f in ("delivered", "dropped", "in_flight")}},
            "copies": self._copies,
            "causes": dict(sorted(causes.items())),
            "causes_over_time": {cause: [tally.causes[cause] for tally in self._all] for cause in sorted(causes)},
            "radios": [*self._radios()],
            "rules": [
                {"name": rule.id, "ends": rule_ends(rule), "settings": impairments_text(rule)} for rule in network.links
            ],
            "defaults": f"preset {network.defaults.preset}, phase {format_ns(network.defaults.phase_ns)}, "
            f"in flight when a partition begins: {network.defaults.in_flight_on_partition}",
            "bin_ns": self._bin_ns,
            "channels": self._busiest_channels(),
            "endpoints": self._busiest_endpoints(),
            "links": [self._link(*ends) for ends in sorted(self._links)],
            "uses": [self._use(ends, age) for ends, age in self.ages.result().items()],
            "senders": [self._sender(*key) for key in sorted(self._senders)],
            "measured": [self._rule(*key) for key in sorted(self._rules)],
            "events": [*self._events()],
            "looks": {name: kind.look for name, kind in mark_kinds(self._deployment).items()},
            "bands": bands[:BANDS_MAX],
            "bands_left": max(0, len(bands) - BANDS_MAX),
            "map": self.map.result(),
            **self.map.drawn(),
        }

    def _radios(self) -> Iterator[Report]:
        profiles = self._deployment.profiles(self._deployment.network)
        ends = self._deployment.endpoints()
        carried = Counter(radio for endpoint in ends for radio in profiles.radios_of(endpoint))
        for name, radio in self._deployment.network.radios.items():
            yield {"name": name, "preset": radio.preset, "settings": radio_text(radio), "carriers": carried[name]}

    def _busiest_channels(self) -> list[Report]:
        packets = Counter({name: sum(map(_offered, bins)) for name, bins in self._channels.items()})
        return [
            {
                "name": name,
                "packets": count,
                "loss": _loss(self._channels[name]),
                "bins": [{**_counts(tally), **_quantiles(tally.delay)} for tally in self._channels[name]],
            }
            for name, count in packets.most_common(CHANNELS_SHOWN)
        ]

    def _busiest_endpoints(self) -> list[str]:
        packets: Counter[str] = Counter()
        for ends, tally in sorted(self._links.items()):
            for end in ends:
                packets[end] += _offered(tally)
        return sorted(name for name, _ in packets.most_common(ENDPOINTS_MAX))

    def _link(self, source: str, destination: str) -> Report:
        tally, age = self._links[source, destination], self._link_ages[source, destination].until(self._end_ns)
        return {
            "source": source,
            "destination": destination,
            **_counts(tally),
            "loss": tally.loss,
            "causes": dict(sorted(tally.causes.items())),
            "delay_mean_ms": _ms(tally.delay.mean),
            "delay_most_ms": _ms(tally.delay.most),
            "age_mean_ms": None if age is None else _ms(age[0]),
            "age_most_ms": None if age is None else _ms(age[1]),
        }

    def _use(self, ends: tuple[str, str, str], age: Any) -> Report:
        source, destination, channel = ends
        tally = self._links.get((source, destination))
        delay_ms = 0.0 if tally is None else _ms(tally.delay.mean)
        names = {"source": source, "destination": destination, "channel": channel, "delay_mean_ms": delay_ms}
        return {**names, "uses": age.uses, "p50_ms": age.p50_ms, "p99_ms": age.p99_ms, "most_ms": age.most_ms}

    def _sender(self, source: str, medium: str) -> Report:
        tally, span_ns = self._senders[source, medium], self._end_ns - self._start_ns
        return {
            "source": source,
            "medium": medium,
            "transmissions": tally.queue.count,
            "queue_mean_ms": _ms(tally.queue.mean),
            "queue_p95_ms": _ms(tally.queue.quantile(0.95)),
            "queue_most_ms": _ms(tally.queue.most),
            "access_mean_ms": _ms(tally.access.mean),
            "access_most_ms": _ms(tally.access.most),
            "retries": tally.retries,
            "airtime_share": round(tally.airtime_ns / span_ns, 6) if span_ns else 0.0,
        }

    def _rule(self, rule: str, radio: str) -> Report:
        """Return the configured and the measured figures of a rule's links over a radio.

        The own loss is the share lost singly or in bursts of the packets that came so far; the own delay is the part
        of the delay beside queue, medium, propagation, clocks and clogs.
        """
        tally, settings = self._rules[rule, radio], self._profiles[rule, radio].settings
        changes = [change for change in self._network.settings if change.rule in (rule, "")]
        return {
            "rule": rule,
            "radio": radio,
            "links": len(tally.links),
            "packets": _offered(tally),
            "own_loss_configured": round(residual_of(settings)[0], 9),
            "own_loss": round(tally.own_loss, 9),
            "own_delay_configured_ms": _ms(delay_of(settings, self._deployment.asset_files)[0]),
            "own_delay_ms": _ms(tally.own.mean),
            "loss": round(tally.loss or 0.0, 9),
            "delay_mean_ms": _ms(tally.delay.mean),
            **_quantiles(tally.delay),
            "is_changed": any(change.start_ns < min(change.end_ns, self._end_ns) for change in changes),
        }

    def _events(self) -> Iterator[Report]:
        """Yield the events of the run: by the deployment, by a request, by the world's rules, and recoveries."""
        planned = {event_words(event) for event in self._deployment.network.events}
        for mark in self.timeline.news():
            by = "requested" if mark.kind in REQUESTED or mark.kind == NETWORK else "rules"
            if mark.kind == NETWORK and mark.text in planned:
                by = "deployment"
            elif mark.kind == RECOVERY:
                by = "recovery"
            if mark.kind != EPOCH:
                yield {"at_ns": mark.tick * self._tick_ns, "kind": mark.kind, "text": mark.text, "by": by}

    def _bands(self) -> Iterator[Report]:
        network = self._network
        for cut in network.cuts:
            groups = " | ".join(_members(group) for group in cut.groups)
            yield from self._band("partition", cut, groups if cut.is_symmetric else f"{groups}, one way")
        for hold in network.holds:
            yield from self._band("clog", hold, f"{_members(hold.sources)} to {_members(hold.destinations)}")
        for change in network.settings:
            yield from self._band("settings", change, f"{change.rule}: {impairments_text(change.changes)}")

    def _band(self, kind: str, held: Any, text: str) -> Iterator[Report]:
        """Yield the part of a span that lies in the run."""
        start_ns, end_ns = max(held.start_ns, self._start_ns), min(held.end_ns, self._end_ns)
        if start_ns < end_ns:
            yield {"kind": kind, "start_ns": start_ns, "end_ns": end_ns, "text": text}


def _ms(ns: float) -> float:
    return round(ns / 1e6, 6)


def _quantiles(times: Times) -> Report:
    return {"p50_ms": _ms(times.quantile(0.5)), "p95_ms": _ms(times.quantile(0.95))}


def _offered(tally: Tally) -> int:
    return tally.fates.total()


def _counts(tally: Tally) -> Report:
    return {"offered": _offered(tally), "delivered": tally.fates["delivered"], "dropped": tally.fates["dropped"]}


def _loss(tallies: Sequence[Tally]) -> float | None:
    """Return the lost share of packets with a fate; None without one."""
    delivered, dropped = (sum(tally.fates[fate] for tally in tallies) for fate in ("delivered", "dropped"))
    return dropped / (delivered + dropped) if delivered + dropped else None


def _members(names: frozenset[str]) -> str:
    shown = sorted(names)[:6]
    return ", ".join(shown) + (f" and {len(names) - len(shown)} more" if len(names) > len(shown) else "")
