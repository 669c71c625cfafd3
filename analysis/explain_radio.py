"""What a captured packet met on its radio's medium and channel, worked out again from its row and its draws."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from foosim.capture.rows import PacketRow
from foosim.common.keyed_random import UNIT, draw_words
from foosim.deployment.network.radios import Radio
from foosim.vhub.network.link_context import BLOCK_SHIFT, LinkSetup
from foosim.vhub.radio.airtime import lrwpan_airtime_ns
from foosim.vhub.radio.contention import sensing, wifi_contention
from foosim.vhub.radio.errors import (
    LORA_FACTORS,
    LORA_GATEWAY_SENSITIVITY_DBM,
    LORA_ISOLATION_DB,
    LORA_SENSITIVITY_DBM,
)
from foosim.vhub.radio.noise import ratio_cdb, units_of
from foosim.vhub.radio.timings import LRWPAN
from foosim.vhub.stages.medium import ACCESS_BLOCK, wifi_timing


def attempts_of(row: PacketRow, number: int, setup: LinkSetup, *, broadcast: bool) -> tuple[float, list[str]]:
    """Return the probability of a collision per attempt, and the result of each, none on media without contenders.

    `number` is that of the packet's draws.
    """
    settings, contenders = setup.settings, max(1, row.contenders)
    if settings.medium == "wifi":
        threshold = wifi_contention(contenders, wifi_timing(settings), unicast=not broadcast).threshold
        access_threshold = 0
    elif settings.medium == "ieee802154":
        timing = replace(LRWPAN, retries=settings.retries)
        point = sensing(contenders, lrwpan_airtime_ns(row.size, timing), not broadcast, timing)
        threshold, access_threshold = point.threshold, point.access_threshold
    else:
        return 0.0, []
    attempts: list[str] = []
    key = (setup.sending if broadcast else setup.draws).of(row.channel)
    is_lost = row.decided_by.collision == "contention" or row.cause in ("snr", "out_of_range", "blocked")
    for attempt in range(row.retries + 1):
        block = draw_words(key, number, row.copy | ACCESS_BLOCK + (attempt >> 1) << BLOCK_SHIFT)
        at = (attempt & 1) << 2
        if block[at + 3] < access_threshold:
            attempts.append("the channel was never free")
        elif block[at + 1] < threshold:
            attempts.append("collision")
        else:
            attempts.append("error" if attempt < row.retries or (is_lost and not broadcast) else "got across")
    return threshold / UNIT, attempts


def ratio_db(row: PacketRow, setup: LinkSetup) -> float:
    """Return the ratio (dB) of a packet's signal to noise and to what others sent meanwhile."""
    assert setup.budget is not None, "a radio"
    noise_cdbm = setup.budget.propagation.noise_cdbm
    return ratio_cdb(row.received_cdbm, noise_cdbm, units_of(row.interference_cdbm)) / 100.0


def lora_text(row: PacketRow, settings: Radio, facts: dict[str, Any]) -> str:
    """Return what LoRa compares a signal with: the receiver's floor, and others by spreading factor."""
    place = settings.spreading_factor - LORA_FACTORS[0]
    floors = LORA_GATEWAY_SENSITIVITY_DBM if settings.gateway else LORA_SENSITIVITY_DBM
    power_dbm, floor_dbm = row.received_cdbm / 100.0, floors[place]
    facts["sensitivity_dbm"] = max(floor_dbm, settings.sensitivity_dbm)
    text = f", the receiver needs {facts['sensitivity_dbm']:g} dBm"
    levels, isolations = row.decided_by.by_factor_cdbm, LORA_ISOLATION_DB[place]
    facts["others"] = others = {
        factor: {"dbm": level / 100.0, "ratio_db": round(power_dbm - level / 100.0, 2), "needed_db": float(needed_db)}
        for factor, level, needed_db in zip(LORA_FACTORS, levels, isolations, strict=False)
        if level
    }
    for factor, other in others.items():
        text += f", others at SF{factor} {other['dbm']:g} dBm: {other['ratio_db']:g} dB over them"
        text += f" of {other['needed_db']:g} dB needed"
    return text
