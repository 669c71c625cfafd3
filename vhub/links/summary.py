"""The summary of a network: mean loss, bursts, delay, airtime, throughput, range.

Nothing here decides a fate: the means of the formulas that the stages use. Ranges are without shadowing and
fading, of ends 1.5 m above the ground where no place is written, and antennas mounted as they are.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp, gcd, inf
from typing import Final

from foosim.common.units import format_ns
from foosim.deployment.network.impairments import Burst, GilbertElliott, Impairments, Markov4
from foosim.deployment.network.link_settings import NO_RADIO, Profile, over, preset_radio
from foosim.deployment.network.radios import Radio
from foosim.deployment.network.rules import Network
from foosim.deployment.network.traces import read_opportunities
from foosim.deployment.schema import Deployment
from foosim.deployment.validate_network import unheeded
from foosim.vhub.links.offered_load import crowded_queues, flows_of, long_packets, offered_hz, used_links
from foosim.vhub.network.jitter import interpolate_ns, jitter_ns, moments_ns
from foosim.vhub.radio import errors
from foosim.vhub.radio.airtime import (
    LRWPAN_OVERHEAD_BYTES,
    WIFI_OVERHEAD_BYTES,
    lora_airtime_ns,
    lrwpan_airtime_ns,
    serialisation_ns,
    wifi_ack_ns,
    wifi_airtime_ns,
)
from foosim.vhub.radio.contention import saturation_rate_hz, sensing
from foosim.vhub.radio.noise import noise_dbm as radio_noise_dbm
from foosim.vhub.radio.path_loss import range_m
from foosim.vhub.radio.propagation import environment_of
from foosim.vhub.radio.timings import LORA_DUTY_CYCLES, LRWPAN
from foosim.vhub.stages.duty import packets_an_hour
from foosim.vhub.stages.medium import BASE_STATION_DBM, OPPORTUNITY_BYTES, mode_of, wifi_modes, wifi_timing
from foosim.vhub.stages.residual import chain_of_burst

SMALL_BYTES: Final = 100
LARGE_BYTES: Final = 1500
MANY: Final = 10
"""Number of stations for the throughput of a saturated channel."""
HEIGHT_M: Final = 1.5
SPACING_NS: Final = 10_000_000
"""Interval of packets for the share that is overtaken."""
SHARE_LEAST: Final = 0.2
"""Share of the mean age by the phase from which on it is reported."""

Ends = tuple[str, str, str]
"""A player, and the endpoint and channel that it receives."""
Phase = tuple[int, int, int]
"""In ticks: the age, its part by the delay, and the player's offset with which only the delay remains."""


@dataclass(frozen=True, slots=True)
class SharedSettings:
    """The settings of links: those of a rule over a radio, of a radio alone, or of neither."""

    rule: str
    radio: str
    settings: Radio
    links: int | None = None
    """Directed pairs with these settings; None where endpoints are unknown."""
    used: int | None = None
    """Those with a declared load."""
    example: tuple[str, str] | None = None
    heights_m: tuple[float, float] = (HEIGHT_M, HEIGHT_M)
    """Of the ends of the example above the ground, without the mount of the antennas."""


@dataclass(frozen=True, slots=True)
class Throughput:
    """Packets of one size: airtime of one attempt, throughput in bit/s of one station and of MANY together."""

    size: int
    airtime_ns: int
    goodput_bps: int
    shared_bps: int | None
    """None where senders do not share the medium."""


@dataclass(frozen=True, slots=True)
class LinkSummary:
    """The summary of settings. Times are in ns, lengths in m; None: not applicable, inf: unlimited."""

    rule: str
    radio: str
    links: int | None
    used: int | None
    example: tuple[str, str] | None
    medium: str
    loss: float
    """Residual loss, without geometry and interference: 0 to 1."""
    burst_packets: float | None
    """Mean number of losses in a row."""
    burst_ns: int | None
    """Mean length of a bad period."""
    delay_mean_ns: int
    """The delay without queue, medium and propagation: constant delay, jitter, bad periods and reordering."""
    delay_sd_ns: int
    delay_p99_ns: int
    reordered: float | None
    """The share of packets that the next one overtakes, when one comes every SPACING_NS; None where none does."""
    rate_bps: int | None
    carried: tuple[Throughput, ...]
    broadcast_bps: int | None
    """The bit rate of broadcasts, where it is not that of unicasts."""
    broadcast: tuple[Throughput, ...]
    """What is carried of broadcasts alone; `carried` where all packets are sent alike."""
    range_los_m: float | None
    """At which 90 % of single frames of SMALL_BYTES arrive, at the lowest rate, in line of sight."""
    range_nlos_m: float | None
    duty_packets_h: int | None
    """Packets of SMALL_BYTES in an hour that the duty cycle allows, hour after hour."""
    queue_ns: int | None
    """Waiting time of the last packet of a full queue."""
    model: str | None
    """The custom link model, if any; the figures are without it."""
    warnings: tuple[str, ...]

    @property
    def name(self) -> str:
        name = self.rule if self.radio in ("", self.rule) else f"{self.rule} via {self.radio}"
        return name if self.model is None else f"{name} with link model {self.model}"


# --- which settings there are ----------------------------------------------------------------------------------------


def uses_of(deployment: Deployment) -> list[SharedSettings]:
    """Return the settings of all links of a deployment, in the order of rules, and radios that no link uses; the
    example of each is a link that carries packets, if there is one."""
    network, profiles = deployment.network, deployment.profiles()
    used = used_links(flows_of(deployment, profiles))
    found: dict[tuple[str, str], SharedSettings] = {}
    links: Counter[tuple[str, str]] = Counter()
    endpoints = deployment.endpoints()
    alike = {name: (tuple(profiles.radios_of(name)), name == profiles.console) for name in endpoints}
    known: dict[tuple[object, ...], Profile] = {}
    """By what decides the profile of a pair: there may be a million pairs."""
    pairs = ((source, destination) for source in endpoints for destination in endpoints if source != destination)
    for source, destination, rule in ((*pair, rule) for pair in pairs for rule in profiles.rules_for(*pair)):
        pair = source, destination
        is_on_board = profiles.body(source) == profiles.body(destination)
        deciding = rule and rule.id, alike[source], alike[destination], is_on_board
        profile = known.get(deciding)
        if profile is None:
            profile = known[deciding] = profiles.of_rule(rule, source, destination)
        key = profile.rule, profile.radio
        links[key] += 1
        carrying = used.get(key, set())
        if key in found and (found[key].example in carrying or pair not in carrying):
            continue
        one, other = (HEIGHT_M if place is None else place[2] for place in map(network.place_of, pair))
        count = len(carrying)
        found[key] = SharedSettings(profile.rule, profile.radio, profile.settings, 0, count, pair, (one, other))
    found = {key: replace(one, links=links[key]) for key, one in found.items()}
    order = {rule.id: number for number, rule in enumerate(network.links)}
    uses = sorted(found.values(), key=lambda use: (order.get(use.rule, len(order)), use.rule, use.radio))
    idle = [name for name in network.radios if all(use.radio != name for use in uses)]
    return [*uses, *(SharedSettings(name, name, network.radios[name], 0, 0) for name in idle)]


def uses_alone(network: Network) -> list[SharedSettings]:
    """Return the settings that a network's section has, without endpoints: each radio, each rule over its radio, or
    over each that there is."""
    uses = [SharedSettings(name, name, radio) for name, radio in network.radios.items()]
    for rule in network.links:
        via = [rule.via] if rule.via is not None else [*network.radios] or [""]
        for name in via:
            base = network.radios[name] if name else preset_radio(network.defaults.preset)
            uses.append(SharedSettings(rule.id, name, over(base, rule)))
    return uses or [SharedSettings(network.defaults.preset, "", preset_radio(network.defaults.preset))]


# --- what they mean --------------------------------------------------------------------------------------------------


def summaries(deployment: Deployment) -> list[LinkSummary]:
    """Return the summary of a deployment's network; the deployment has its files."""
    uses = uses_of(deployment)
    flows = [*flows_of(deployment, deployment.profiles())]
    offered, too_long, crowded = offered_hz(flows), long_packets(deployment, flows), crowded_queues(deployment, flows)
    files = deployment.asset_files
    phased = phase_warnings(deployment, lambda settings: delay_of(settings, files)[2])
    found = []
    for use in uses:
        summary = summary_of(use, files)
        key = use.rule, use.radio
        warnings = [*summary.warnings, *phased.get(key, ()), *(of[key] for of in (too_long, crowded) if key in of)]
        if use.links == 0:
            warnings.append("no link uses it")
        loads_hz = offered.get((key, False), 0.0), offered.get((key, True), 0.0)
        busy = loads_hz[0] / _capacity_hz(summary.carried) + loads_hz[1] / _capacity_hz(summary.broadcast)
        if busy > 1.0:
            which = "all together offer" if use.settings.is_on_air else "one sender offers"
            what = f"{which} {sum(loads_hz):.0f} frames/s as declared; of {SMALL_BYTES} B it carries"
            warnings.append(f"{what} {sum(loads_hz) / busy:.3g}/s")
        found.append(replace(summary, warnings=tuple(warnings)))
    return found


def summary_of(use: SharedSettings, files: Mapping[str, bytes]) -> LinkSummary:
    """Return the summary of settings; `files` are the contents of the files that they name, by path."""
    settings = use.settings
    loss, burst_packets, burst_ns = residual_of(settings)
    mean_ns, sd_ns, p99_ns = delay_of(settings, files)
    carried, is_slow = carried_of(settings, files), settings.medium == "wifi" and settings.sends_once
    los_m, nlos_m = ranges_of(settings, use.heights_m)
    duty = settings.duty_cycle
    is_limited = settings.is_on_air and duty < 1.0 and carried
    summary = LinkSummary(
        use.rule,
        use.radio,
        use.links,
        use.used,
        use.example,
        settings.medium,
        loss,
        burst_packets,
        burst_ns,
        mean_ns,
        sd_ns,
        p99_ns,
        reordered_of(settings, files),
        rate_of(settings, files),
        carried,
        errors.MODES[_wifi_mode(settings, lowest=True)].rate_bps if is_slow else None,
        tuple(_carried(settings, one.size, 0, lowest=True) for one in carried) if is_slow else carried,
        los_m,
        nlos_m,
        packets_an_hour(duty, settings.duty_window_ns, carried[0].airtime_ns) if is_limited else None,
        _queue_ns(settings, carried),
        None if settings.model is None else settings.model.name,
        (),
    )
    return replace(summary, warnings=tuple(_warnings(use, summary)))


def residual_of(settings: Impairments) -> tuple[float, float | None, int | None]:
    """Return the mean loss of a link's residual stage; of bursts the mean number of losses in a row, and the mean
    length of a bad period in ns; None without bursts."""
    burst, outages, chain = settings.burst, settings.outages, settings.gilbert_elliott
    if burst is not None and burst.mean_burst is not None:
        chain = chain_of_burst(burst)
    lost, run, bad_ns = settings.loss, None, None
    if chain is not None or settings.markov4 is not None:
        steps, losses = _chain(chain) if chain is not None else _four_states(settings.markov4)
        lost, run = _runs(steps, [state + (1.0 - state) * lost for state in losses])
    elif burst is not None:
        lost, bad_ns = lost + (1.0 - lost) * burst.loss, burst.mean_bad_ns
    if outages is not None:
        on_ns, off_ns = outages.mean_on_ns, outages.mean_off_ns
        lost, bad_ns = lost + (1.0 - lost) * off_ns / (on_ns + off_ns), max(bad_ns or 0, off_ns)
    return lost, run, bad_ns


Matrix = list[list[float]]


def _chain(chain: GilbertElliott) -> tuple[Matrix, list[float]]:
    return [[1.0 - chain.p, chain.p], [chain.r, 1.0 - chain.r]], [1.0 - chain.k, 1.0 - chain.h]


def _four_states(chain: Markov4 | None) -> tuple[Matrix, list[float]]:
    """Return the steps between good, a delivery within a burst, a burst, a single loss; and what each loses."""
    assert chain is not None
    steps = [
        [1.0 - chain.p14 - chain.p13, 0.0, chain.p13, chain.p14],
        [0.0, 1.0 - chain.p23, chain.p23, 0.0],
        [chain.p31, chain.p32, 1.0 - chain.p31 - chain.p32, 0.0],
        [1.0, 0.0, 0.0, 0.0],
    ]
    return steps, [0.0, 0.0, 1.0, 1.0]


def _runs(steps: Matrix, lost: Sequence[float]) -> tuple[float, float | None]:
    """Return the mean loss L of a chain from its first state on, and of its runs of losses: L / (L - P(two))."""
    count = len(steps)
    power = [[(step + (row == column)) / 2.0 for column, step in enumerate(line)] for row, line in enumerate(steps)]
    for _ in range(64):  # the chain that stays with 1/2 has the same shares, and no period
        squared = [
            [sum(power[row][inner] * power[inner][column] for inner in range(count)) for column in range(count)]
            for row in range(count)
        ]
        power = [[step / sum(line) for step in line] for line in squared]  # else rounding errors double, too
    shares = power[0]
    loss = sum(share * of for share, of in zip(shares, lost, strict=True))
    two = sum(shares[a] * lost[a] * steps[a][b] * lost[b] for a in range(count) for b in range(count))
    return loss, loss / (loss - two) if loss > two else None


def delay_of(settings: Impairments, files: Mapping[str, bytes]) -> tuple[int, int, int]:
    """Return mean, standard deviation and 99th percentile of a link's own delay, in ns, by the table of its jitter.

    What bad times and reordering add to what passes is in the mean alone, and shifts the percentile by it.
    """
    base_ns = settings.delay_ns
    if settings.burst is not None:
        base_ns += round(settings.burst.bad_extra_delay_ns * _bad_share(settings.burst))
    if settings.reorder is not None:
        base_ns += round(settings.reorder.extra_ns * settings.reorder.probability)
    jitter = settings.jitter
    if jitter is None:
        return base_ns, 0, base_ns
    quantiles = jitter_ns(jitter, files)
    mean_ns, sd_ns = moments_ns(quantiles)
    p99_ns = interpolate_ns(quantiles, int(0.99 * 2**64))
    return base_ns + round(mean_ns), round(sd_ns), base_ns + p99_ns


def reordered_of(settings: Impairments, files: Mapping[str, bytes]) -> float | None:
    """Return the share of packets that the next one overtakes, one every SPACING_NS; None where order is kept.

    That is P(J > d + J') for two draws of jitter a time d apart, where order is free; and the same with its `extra` for
    the share that is reordered on purpose.
    """
    reorder, jitter = settings.reorder, settings.jitter
    if reorder is None and (settings.order == "fifo" or jitter is None):
        return None
    quantiles = jitter_ns(jitter, files)
    drawn_ns = [interpolate_ns(quantiles, (2 * n + 1) << 54) for n in range(512)] if quantiles else [0]

    def overtaken(extra_ns: int) -> float:
        later = sum(bisect_left(drawn_ns, one + extra_ns - SPACING_NS) for one in drawn_ns)
        return later / len(drawn_ns) / len(drawn_ns)

    share = 0.0 if settings.order == "fifo" else overtaken(0)
    if reorder is not None:
        share += reorder.probability * (overtaken(reorder.extra_ns) - share)
    return share


def _bad_share(burst: Burst) -> float:
    """Return the share of the passing packets that pass in a bad period."""
    passing = 1.0 - burst.loss
    return burst.loss / burst.bad_loss * (1.0 - burst.bad_loss) / passing if passing else 0.0


def rate_of(settings: Radio, files: Mapping[str, bytes]) -> int | None:
    """Return the bit rate of a unicast near by; None where there is none."""
    if settings.medium == "wifi":
        return errors.MODES[_wifi_mode(settings)].rate_bps
    if settings.medium == "ieee802154":
        return errors.MODES["oqpsk_250"].rate_bps
    if settings.medium == "lora":
        factor = settings.spreading_factor
        return factor * 4 * int(settings.bandwidth_hz) // ((4 + settings.coding_rate) << factor)
    if settings.medium == "lte":
        direction = "down" if settings.tx_power_dbm >= BASE_STATION_DBM else "up"
        return errors.lte_rate_bps(errors.SNR_MAX, int(settings.bandwidth_hz), direction)
    if settings.trace is not None and not settings.is_on_air:
        times_ms = read_opportunities(files[settings.trace.file].decode("ascii"))
        return len(times_ms) * OPPORTUNITY_BYTES * 8000 // times_ms[-1]
    return settings.rate_bps


def _wifi_mode(settings: Radio, *, lowest: bool = False) -> str:
    modes = wifi_modes(settings)
    if settings.rates == "fixed":
        return mode_of(modes, settings.fixed_rate_bps)
    return modes[0] if lowest else modes[-1]


def carried_of(settings: Radio, files: Mapping[str, bytes]) -> tuple[Throughput, ...]:
    """Return the figures of small and large packets; none where no rate limits them."""
    longest = LARGE_BYTES if settings.payload_max is None else min(LARGE_BYTES, settings.payload_max)
    sizes = sorted({min(SMALL_BYTES, longest), longest})
    rate_bps = rate_of(settings, files)
    return () if not rate_bps else tuple(_carried(settings, size, rate_bps) for size in sizes if size)


def _carried(settings: Radio, size: int, rate_bps: int, *, lowest: bool = False) -> Throughput:
    """Return the figures of a size; with `lowest` those of broadcasts over Wi-Fi, without acknowledgements."""
    bits = 8 * size
    if settings.medium == "wifi":
        mode, timing = _wifi_mode(settings, lowest=lowest), wifi_timing(settings)
        airtime_ns, ack_ns = wifi_airtime_ns(mode, size, timing), 0 if lowest else wifi_ack_ns(mode, timing)
        one, many = (saturation_rate_hz(n, airtime_ns, ack_ns, timing) for n in (1, MANY))
        return Throughput(size, airtime_ns, int(bits * one), int(bits * many))
    if settings.medium == "ieee802154":
        airtime_ns = lrwpan_airtime_ns(size)
        timing_154 = replace(LRWPAN, retries=settings.retries)
        one, many = (sensing(n, airtime_ns, True, timing_154).rate_hz for n in (1, MANY))
        return Throughput(size, airtime_ns, int(bits * one), int(bits * many))
    if settings.medium == "lora":
        airtime_ns = lora_airtime_ns(settings.spreading_factor, size, int(settings.bandwidth_hz), settings.coding_rate)
        load = min(0.5, MANY * settings.duty_cycle)  # pure ALOHA: G e^-2G, at most at G = 1/2
        one, many = (share * bits * 1e9 / airtime_ns for share in (settings.duty_cycle, load * exp(-2.0 * load)))
        return Throughput(size, airtime_ns, int(one), int(many))
    airtime_ns = serialisation_ns(size + settings.overhead_bytes, rate_bps)
    return Throughput(size, airtime_ns, bits * 1_000_000_000 // airtime_ns, None)


def ranges_of(settings: Radio, ends_m: tuple[float, float] = (HEIGHT_M, HEIGHT_M)) -> tuple[float | None, float | None]:
    """Return the range with and without line of sight; None on wires, and where walls alone decide it.

    `ends_m` are the heights of the two ends above the ground, beside which the antennas are mounted.
    """
    if not settings.is_on_air:
        return None, None
    gain_db, path_loss = settings.antenna.gain_dbi, settings.path_loss
    power_dbm = settings.tx_power_dbm + 2.0 * gain_db
    noise_dbm = radio_noise_dbm(settings.bandwidth_hz, settings.noise_figure_db)
    loss_db = power_dbm - max(settings.sensitivity_dbm, _least_dbm(settings, noise_dbm))
    environment = environment_of(settings)
    hard_m = inf if path_loss.range_m is None else path_loss.range_m
    heights = ends_m[0] + settings.antenna.mount[2], ends_m[1] + settings.antenna.mount[2]
    los_m = min(hard_m, range_m(environment, loss_db, settings.frequency_hz, *heights))
    if path_loss.strict_los:
        return los_m, 0.0
    if not environment.has_nlos_curve:
        return los_m, None
    return los_m, min(hard_m, range_m(environment, loss_db, settings.frequency_hz, *heights, nlos=True))


def _least_dbm(settings: Radio, noise_dbm: float) -> float:
    """Return the power that 90 % of single frames need."""
    if settings.medium == "lora":
        floors = errors.LORA_GATEWAY_SENSITIVITY_DBM if settings.gateway else errors.LORA_SENSITIVITY_DBM
        return floors[settings.spreading_factor - 7]
    if settings.medium == "lte":
        return noise_dbm + errors.LTE_FLOOR_CENTI_DB / 100.0
    if settings.medium == "wifi":
        mode = _wifi_mode(settings, lowest=True)
        return noise_dbm + errors.snr_needed(mode, SMALL_BYTES + WIFI_OVERHEAD_BYTES) / 100.0
    if settings.medium == "ieee802154":
        return noise_dbm + errors.snr_needed("oqpsk_250", SMALL_BYTES + LRWPAN_OVERHEAD_BYTES) / 100.0
    return -inf


def _queue_ns(settings: Radio, carried: Sequence[Throughput]) -> int | None:
    if not carried:
        return None
    last, queue = carried[-1], settings.queue
    packets = min(queue.packets, queue.bytes_max // max(1, last.size + settings.overhead_bytes))
    share = settings.duty_cycle if settings.medium == "lora" else 1.0
    return min(queue.wait_ns, int(packets * 8e9 * last.size / max(1.0, last.goodput_bps / share)))


def _warnings(use: SharedSettings, summary: LinkSummary) -> Iterator[str]:
    settings = use.settings
    if summary.loss > 0.5:
        yield f"more than half of all packets is lost: {100.0 * summary.loss:.1f} %"
    if settings.ttl_ns is not None and summary.delay_mean_ns > settings.ttl_ns:
        yield f"the mean delay of {summary.delay_mean_ns / 1e6:g} ms is above ttl, {settings.ttl_ns / 1e6:g} ms"
    if not settings.allow:
        yield "nothing passes: allow is off"
    if summary.range_los_m is not None and summary.range_los_m < 1.0:
        yield f"it does not reach 1 m ({summary.range_los_m:.2f} m)"
    for low_hz, high_hz, share in LORA_DUTY_CYCLES if settings.medium == "lora" else ():
        at_hz = settings.frequency_hz
        if low_hz <= at_hz <= high_hz and settings.duty_cycle > share:
            yield f"duty_cycle is above the {100.0 * share:g} % that the EU allows at {at_hz / 1e6:g} MHz"
    for key, value in (("rate", settings.rate_bps), ("trace", settings.trace), ("overhead", settings.overhead_bytes)):
        unused = unheeded(key, settings.medium) if value else None
        if unused is not None:
            yield f"{key} {unused}"
    if summary.carried and settings.queue.bytes_max < summary.carried[-1].size:
        yield f"a packet of {summary.carried[-1].size} B does not fit into the queue of {settings.queue.bytes_max} B"
    if not settings.has_queue and "queue" in settings.model_fields_set:
        yield "the queue has no effect: no rate, no medium"
    if use.rule == NO_RADIO:
        yield "these endpoints have no radio in common, or not that of their rule: nothing passes (no_route)"


def _capacity_hz(carried: Sequence[Throughput]) -> float:
    if not carried:
        return inf
    small = carried[0]
    bps = small.goodput_bps if small.shared_bps is None else max(small.goodput_bps, small.shared_bps)
    return max(bps, 1) / 8.0 / small.size


# --- the phase between sensor and player: where both act at fixed times, it adds to the delay of every packet ---------


def phase_warnings(deployment: Deployment, late_ns: Callable[[Radio], int]) -> dict[tuple[str, str], list[str]]:
    """Return the warnings about sensors and players in step, by rule and radio of their links.

    `late_ns` is the delay, by a link's settings, that all but few of its packets keep.
    """
    found: dict[tuple[str, str], dict[Phase, list[Ends]]] = {}
    for rule, phase, ends in _phases(deployment, late_ns):
        found.setdefault(rule, {}).setdefault(phase, []).append(ends)
    return {
        rule: [_phase_text(phase, heard, deployment.tick_ns) for phase, heard in phases.items()]
        for rule, phases in found.items()
    }


def _phases(deployment: Deployment, late_ns: Callable[[Radio], int]) -> Iterator[tuple[tuple[str, str], Phase, Ends]]:
    """Yield the channels whose age the delay does not explain.

    A sample of tick s is there at s + a, with the delay a. The player acts at ticks that leave the remainder `own` by
    `period`, the sensor samples at ticks that leave `sampled` by `every`. With g their greatest common divisor, the
    newest sample has waited for (own - a - sampled) mod g ticks at the least, and for (every - g) / 2 more in the mean:
    the first is a matter of the phase alone.
    """
    profiles = deployment.profiles()
    tick_ns = deployment.tick_ns
    for name, player in deployment.players.items():
        if not player.lockstep or player.act != "period":
            continue
        period, own = deployment.turns(player)
        for source, channel in deployment.heard_by(name):
            robot = deployment.robots.get(source)
            if robot is None or channel not in robot.sensors:
                continue
            step, shift, turn = deployment.schedule(robot.sensors[channel])
            if turn % step:  # its readings are not as many ticks apart each time: it is in step with no player
                continue
            every = turn // step
            sampled = -(shift // step) % every
            profile = profiles.find(source, name, channel)
            delay = -(-(late_ns(profile.settings) + robot.sensors[channel].late_by_ns) // tick_ns)
            common = gcd(period, every)
            waits = (own - delay - sampled) % common
            mean = delay + waits + (every - common) / 2
            if waits and waits >= SHARE_LEAST * mean:
                best = (own - waits) % period
                yield (profile.rule, profile.radio), (delay + waits, delay, best), (name, source, channel)


def _phase_text(phase: Phase, heard: list[Ends], tick_ns: int) -> str:
    age, delay, best = (format_ns(ticks * tick_ns) for ticks in phase)
    player, source, channel = heard[0]
    players = len({name for name, _, _ in heard})
    players_text = f"{player} sees" if players == 1 else f"{player} and {players - 1} more see"
    channels = len({(endpoint, sent) for _, endpoint, sent in heard})
    source_text = f"{source} {channel}" + (f" and {channels - 1} more channels" if channels > 1 else "")
    return (
        f"{players_text} {source_text} {age} old, of which the delay explains {delay}: sensor and player are in step; "
        f"an offset of {best} of the player, or act: arrival, leaves {delay}"
    )
