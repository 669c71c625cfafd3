"""Sources of the numbers that media have beside their settings: printed by `foosim net presets` below a preset's.

The numbers are read from the modules that use them. The marks before the sources
are the ones of `protocol.presets`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from foosim.common.format import rate_text
from foosim.deployment.network.link_settings import preset_radio
from foosim.deployment.network.radios import LORA_LONGEST, Radio
from foosim.vhub.radio import errors
from foosim.vhub.radio.airtime import LRWPAN_OVERHEAD_BYTES, WIFI_ACK_BYTES, WIFI_OVERHEAD_BYTES
from foosim.vhub.radio.noise import NEGLIGIBLE_CDB, THERMAL_DBM_HZ
from foosim.vhub.radio.propagation import environment_of
from foosim.vhub.radio.timings import (
    CATEGORIES,
    DOT11P_CATEGORIES,
    LORA_DUTY_CYCLES,
    LORA_PREAMBLE_SYMBOLS,
    LRWPAN,
)
from foosim.vhub.stages.medium import BASE_STATION_DBM, wifi_modes, wifi_timing

Row = tuple[str, str, str]
"""A name, a value and its source."""

_READ: Final = ("best_effort", "voice")
"""Access categories whose numbers were read in ns-3's wifi-mac.cc; the others were recalled."""
_LORAWAN: Final = "signetlabdei/lorawan"


def parameters_of(preset: str) -> Iterator[Row]:
    """Yield (name, value, source) of each number that decides on a preset's links and is no setting."""
    settings = preset_radio(preset)
    if not settings.is_on_air:
        return
    yield from _noise()
    yield from _path_loss(settings)
    if settings.medium == "wifi":
        yield from _wifi(settings)
    elif settings.medium == "ieee802154":
        yield from _lrwpan()
    elif settings.medium == "lora":
        yield from _lora()
    elif settings.medium == "lte":
        yield from _lte()


def _us(time_ns: int) -> str:
    return f"{time_ns / 1000:g} us"


def _each(values: tuple[float, ...] | tuple[int, ...]) -> str:
    return ", ".join(f"{value:g}" for value in values)


def _noise() -> Iterator[Row]:
    yield "noise density", f"{THERMAL_DBM_HZ:g} dBm/Hz", "thermal noise at room temperature"
    yield "interference left out", f"{NEGLIGIBLE_CDB / 100:g} dB below noise", "[J]"


def _path_loss(settings: Radio) -> Iterator[Row]:
    environment = environment_of(settings)
    yield "path loss", settings.path_loss.environment, environment.source
    if settings.shadowing.on:
        sigmas, distances = (
            (environment.sigma_los, environment.sigma_nlos),
            (environment.d_corr_los, environment.d_corr_nlos),
        )
        lora = settings.path_loss.environment == "lora"
        source = f"[S] {_LORAWAN}" if lora else "[S] as ns-3 has them: in sight, behind walls"
        yield "shadowing sigma", " / ".join(f"{sigma:g} dB" for sigma in sigmas), source
        yield "shadowing d_corr", " / ".join(f"{distance:g} m" for distance in distances), source


def _wifi(settings: Radio) -> Iterator[Row]:
    timing, is_dot11p = wifi_timing(settings), settings.bandwidth_hz < 15e6
    for name, time_ns in (
        ("slot", timing.slot_ns),
        ("SIFS", timing.sifs_ns),
        ("preamble", timing.preamble_ns),
        ("symbol", timing.symbol_ns),
        ("signal extension", timing.signal_extension_ns),
    ):
        if time_ns:
            yield name, _us(time_ns), timing.source.partition(";")[0]
    for category, (aifsn, low, high) in (DOT11P_CATEGORIES if is_dot11p else CATEGORIES).items():
        source = "[S] ns-3 wifi-mac.cc" if category in _READ and not is_dot11p else "[R] IEEE 802.11: unverified"
        yield f"AIFSN, CW of {category}", f"{aifsn}, {low} to {high}", source
    modes = wifi_modes(settings)
    rates = [rate_text(errors.MODES[mode].rate_bps) for mode in (modes[0], modes[-1])]
    yield "bit rates", " to ".join(rates), "[S] IEEE 802.11 OFDM; errors by ns-3's nist-error-rate-model.cc"
    yield "headers, acknowledgement", f"{WIFI_OVERHEAD_BYTES} B, {WIFI_ACK_BYTES} B", "IEEE 802.11 and 802.2"


def _lrwpan() -> Iterator[Row]:
    source = "[S] ns-3 lr-wpan"
    yield "rate", rate_text(errors.MODES["oqpsk_250"].rate_bps), f"{source}-error-model.cc"
    yield "unit backoff", _us(LRWPAN.unit_backoff_ns), source
    yield "carrier sensing", _us(LRWPAN.cca_ns), source
    yield "turnaround", _us(LRWPAN.turnaround_ns), source
    yield "BE", f"{LRWPAN.be_min} to {LRWPAN.be_max}", f"{source}-csmaca.cc"
    yield "backoffs", str(LRWPAN.backoffs), f"{source}-csmaca.cc"
    sizes = f"{LRWPAN_OVERHEAD_BYTES + LRWPAN.phy_bytes} B, {LRWPAN.ack_bytes} B"
    yield "headers, acknowledgement", sizes, f"{source}-mac.cc"


def _lora() -> Iterator[Row]:
    factors = f"SF{errors.LORA_FACTORS[0]} to {errors.LORA_FACTORS[-1]}"
    yield "preamble", f"{LORA_PREAMBLE_SYMBOLS} symbols", f"[S] {_LORAWAN}"
    device, gateway = errors.LORA_SENSITIVITY_DBM, errors.LORA_GATEWAY_SENSITIVITY_DBM
    yield f"sensitivity {factors}", f"{_each(device)} dBm", f"[S] SX1272 data sheet, as {_LORAWAN} has it"
    yield "sensitivity of a gateway", f"{_each(gateway)} dBm", f"[S] SX1301 data sheet, as {_LORAWAN} has it"
    for factor, isolation in zip(errors.LORA_FACTORS, errors.LORA_ISOLATION_DB, strict=True):
        source = f"[S] {_LORAWAN} lora-interference-helper.cc"
        yield f"isolation of SF{factor}", f"{_each(isolation)} dB", source
    for low_hz, high_hz, share in LORA_DUTY_CYCLES:
        band = f"duty cycle {low_hz / 1e6:g} to {high_hz / 1e6:g} MHz"
        yield band, f"{100 * share:g} %", f"[S] {_LORAWAN} lorawan-mac-helper.cc"
    yield f"mtu {factors}", f"{_each(LORA_LONGEST)} B", "[R] LoRaWAN, EU868: unverified"


def _lte() -> Iterator[Row]:
    source = "[R] 3GPP TR 36.942 A.2: unverified"
    for direction in ("down", "up"):
        limits = f"{errors.LTE_ALPHA[direction]:g}, {errors.LTE_MAX_BPS_HZ[direction]:g} bit/s/Hz"
        yield f"alpha, cap {direction}", limits, source
    yield "floor", f"{errors.LTE_FLOOR_CENTI_DB / 100:g} dB", source
    yield "HARQ round", _us(errors.HARQ_ROUND_NS), "[R] unverified"
    yield "HARQ transmissions", str(errors.HARQ_ATTEMPTS), "[R] unverified"
    yield "HARQ error rate", "10 % each", "[R] unverified"
    yield "base station", f"from {BASE_STATION_DBM:g} dBm on", "[J] who sends with so much sends down"
