"""One hash of the network's model in force: its configuration, presets resolved, and results of its formulas.

Two captures with one hash were judged by the same model. Results of formulas are hashed where they are
rounded anyway (0.01 dB, parts per million, ns), so machines whose mathematical libraries differ in the last bit agree.
The world with its materials is excluded, and a custom link model counts by name and parameters alone: the deployment
and the versions beside it in the capture have these.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from hashlib import blake2b
from typing import Final

from msgspec import json

from foosim.common.keyed_random import draw_words
from foosim.deployment.network.impairments import TableJitter
from foosim.deployment.schema import Deployment
from foosim.vhub.network.draw_address import DrawKeys
from foosim.vhub.network.memory import RadioState, Transmission
from foosim.vhub.network.turns import Contest, Turn
from foosim.vhub.radio.airtime import lora_airtime_ns, lrwpan_airtime_ns, wifi_ack_ns, wifi_airtime_ns
from foosim.vhub.radio.contention import sensing, wifi_access, wifi_contention
from foosim.vhub.radio.errors import (
    LORA_FACTORS,
    LORA_GATEWAY_SENSITIVITY_DBM,
    LORA_ISOLATION_DB,
    LORA_SENSITIVITY_DBM,
    MODES,
    lte_rate_bps,
    per_threshold,
)
from foosim.vhub.radio.materials import MATERIALS, slab_loss_db
from foosim.vhub.radio.noise import centi
from foosim.vhub.radio.path_loss import ENVIRONMENTS
from foosim.vhub.radio.timings import DOT11P, WIFI_2_4, WIFI_5
from foosim.vhub.stages.duty import packets_an_hour

MODEL_HASH: Final = "model_hash"
"""The entry of the metadata `foosim`."""
_PPM_SHIFT: Final = 44
"""From units of 2^-64 to units of about a millionth."""
_HEIGHTS_M: Final = (1.5, 3.0)


def model_hash(deployment: Deployment) -> str:
    """Return the hash, BLAKE2b of 16 bytes in hex, of a deployment's network."""
    network = deployment.network
    settings = [*network.links, *network.radios.values()]
    files = {of.jitter.file for of in settings if isinstance(of.jitter, TableJitter)}
    files |= {of.trace.file for of in settings if of.trace is not None}
    hasher = blake2b(_formulas(), digest_size=16)
    seed = deployment.seed if network.seed is None else network.seed
    hasher.update(json.encode([seed, network.model_dump(mode="json", warnings=False)], order="sorted"))
    for path in sorted(files):
        hasher.update(json.encode([path, deployment.asset_files[path]]))
    return hasher.hexdigest()


@cache
def _formulas() -> bytes:
    lora = LORA_SENSITIVITY_DBM, LORA_GATEWAY_SENSITIVITY_DBM, LORA_ISOLATION_DB
    return json.encode([list(_losses()), list(_errors()), list(_airtimes()), lora, list(_lte()), list(_draws())])


def _losses() -> Iterator[object]:
    """Yield path losses by environment, distance and frequency, and what walls take (0.01 dB)."""
    for name, of in sorted(ENVIRONMENTS.items()):
        yield name, of.sigma_los, of.sigma_nlos, of.d_corr_los, of.d_corr_nlos
        for distance_m in (1.0, 10.0, 100.0, 1000.0):
            for frequency_hz in (868.1e6, 5.25e9):
                yield [centi(loss_db) for loss_db in of.both_db(distance_m, frequency_hz, _HEIGHTS_M)]
    for name in sorted(MATERIALS):
        yield name, [centi(slab_loss_db(name, 0.1, frequency_hz)) for frequency_hz in (868.1e6, 2.437e9, 5.25e9)]


def _errors() -> Iterator[object]:
    """Yield error rates of frames by mode, ratio and size."""
    for name in sorted(MODES):
        for size in (100, 1500):
            yield [per_threshold(name, snr, size) >> _PPM_SHIFT for snr in range(-1000, 3000, 200)]
        yield name, MODES[name].rate_bps


def _airtimes() -> Iterator[object]:
    """Yield times on the air (ns), how likely attempts collide, what is counted down (ns), whose turn is first, and
    what a duty cycle leaves."""
    for timing in (WIFI_2_4, WIFI_5, DOT11P):
        family = "ofdm10" if timing is DOT11P else "ofdm"
        modes = sorted(name for name, mode in MODES.items() if mode.family == family)
        yield [(name, wifi_airtime_ns(name, 300, timing), wifi_ack_ns(name, timing)) for name in modes]
        yield [wifi_contention(n, timing, unicast=n % 2 == 0).threshold >> _PPM_SHIFT for n in range(1, 20)]
        yield [wifi_access(_collides_once, n, 0, 136_000, 28_000, timing).backoff_ns for n in range(1, 20)]
    yield lrwpan_airtime_ns(50), [sensing(n, lrwpan_airtime_ns(50), True).threshold >> _PPM_SHIFT for n in range(1, 9)]
    yield [lora_airtime_ns(factor, 20) for factor in LORA_FACTORS]
    yield list(_turns()), [packets_an_hour(0.01, seconds * 1_000_000_000, 56_576_000) for seconds in (20, 3600)]


def _collides_once(block: int) -> tuple[int, ...]:
    """Return the draws of a packet that collides once if others contend; each attempt draws half its window."""
    half, most = 1 << 63, (1 << 64) - 1
    return half, 0, 0, 0, half, most, most, 0


def _turns() -> Iterator[int]:
    """Yield when turns begin (ns) of stations with several backoffs that meet two whose turns are known."""
    known = [Transmission("a", 1, 0, 0, 0, at_ns + 50_000, (0.0, 0.0, 0.0), 0, turn_ns=at_ns) for at_ns in (9, 90_000)]
    turns = [Turn(transmission, RadioState()) for transmission in known]
    for backoff_ns in range(0, 150_000, 15_000):
        yield Contest(0, 3, 0, list(turns), []).turn_ns(backoff_ns, WIFI_5.slot_ns)


def _lte() -> Iterator[object]:
    """Yield bit rates by ratio."""
    for snr in range(-1200, 3000, 300):
        yield lte_rate_bps(snr, 10_000_000, "down"), lte_rate_bps(snr, 10_000_000, "up")


def _draws() -> Iterator[int]:
    """Yield a draw of a client's packet and one of a robot's: by which address packets draw."""
    for by_channel in (False, True):
        keys = DrawKeys(1, "link", "a", "b", by_channel=by_channel)
        yield draw_words(keys.of("news"), keys.number(2, 3, 4))[0]
