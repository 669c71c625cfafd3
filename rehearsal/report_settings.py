"""A network's settings as people read them, and what they amount to on average.

Neighbours: `report` compares this with what was measured; the vHub's stages decide fates.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from foosim.protocol.codec import encode_json
from foosim.protocol.impairments import Burst, Impairments, LinkSettings, Markov4, TableJitter
from foosim.protocol.network import Event, LinkRule
from foosim.protocol.radios import Radio
from foosim.protocol.table import Part
from foosim.protocol.traces import read_table
from foosim.protocol.units import format_ns
from foosim.vhub.jitter import moments_ns, quantiles_ns

_UNITS: Final = (
    ("_bps", "bit/s"),
    ("_hz", "Hz"),
    ("_dbm", "dBm"),
    ("_dbi", "dBi"),
    ("_db", "dB"),
    ("_m_s", "m/s"),
    ("_m", "m"),
    ("_bytes", "B"),
)
"""What the end of a field's name says of its unit."""
_SHORT: Final = {"bytes_max": "size_bytes", "payload_max": "mtu_bytes", "sense_dbm": "carrier_sense_dbm"}
"""Fields whose keys in a file are other words."""
_PREFIXES: Final = ((1e9, "G"), (1e6, "M"), (1e3, "k"))
_SHARES: Final = frozenset({"loss", "duplicate", "bad_loss", "share", "probability", "duty_cycle", "p", "r", "h", "k"})
_SHARES_OF_CHAINS: Final = frozenset({"p13", "p31", "p32", "p23", "p14", "bit_error_rate"})


def settings_text(settings: Part) -> str:
    """Return what is written of settings, all else being defaults: `delay 1 ms, loss 0.5 %`."""
    return ", ".join(_entries(settings.model_dump(exclude_unset=True)))


def radio_text(radio: Radio) -> str:
    """Return what of a radio, its preset's settings included, is not as without any."""
    return ", ".join(_entries(_differing(radio.model_dump(exclude={"preset"}), Radio().model_dump())))


def _differing(content: Mapping[str, Any], base: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries that are not those of `base`, of mappings that both have the differing ones alone."""
    found = {}
    for name, value in content.items():
        other = base.get(name)
        if value is not None and value != other:
            found[name] = _differing(value, other) if isinstance(value, dict) and isinstance(other, dict) else value
    return found


def impairments_text(settings: Impairments) -> str:
    """Return what a rule, or an event that changes one, writes beside its ends."""
    written = settings.model_fields_set & set(LinkSettings.model_fields)
    values = {name: getattr(settings, name) for name in written}
    return settings_text(LinkSettings.model_construct(_fields_set=written, **values))


def event_text(event: Event) -> str:
    """Return what an event does, without when."""
    if event.partition is not None:
        what = f"partition {' | '.join(', '.join(group) for group in event.partition)}"
        what += "" if event.symmetric else ", one way"
    elif event.clog is not None:
        what = f"clog from {', '.join(event.clog.from_)} to {', '.join(event.clog.to)}"
    elif event.set is not None:
        what = f"set {event.set.link}: {impairments_text(event.set)}"
    elif event.chaos is not None:
        what = f"chaos {event.chaos.preset} among {', '.join(event.chaos.among)}"
    else:
        what = f"heal {event.heal}"
    if event.lasts is not None:
        what += f", for {format_ns(event.lasts.ns)}{' on average' if event.lasts.is_random else ''}"
    return what if event.until_ns is None else f"{what}, until {format_ns(event.until_ns)}"


def _entries(content: Mapping[str, Any]) -> list[str]:
    return [_entry(_SHORT.get(name, name), value) for name, value in content.items() if value is not None]


def _entry(name: str, value: Any) -> str:
    if name == "model":  # whose parameters are what its package takes
        parameters = encode_json(value["parameters"]).decode() if value.get("parameters") else ""
        return f"link model {value['name']} {parameters}".rstrip()
    if isinstance(value, dict):
        return f"{name.rstrip('_')} ({', '.join(_entries(value))})"
    if isinstance(value, list):
        return f"{name.rstrip('_')} [{', '.join(_item(item) for item in value)}]"
    if isinstance(value, bool):
        return f"{name} {'on' if value else 'off'}"
    if name.endswith("_ns"):
        return f"{name.removesuffix('_ns').rstrip('_')} {format_ns(value)}"
    if name in _SHARES or name in _SHARES_OF_CHAINS:
        return f"{name} {100.0 * value:.6g} %"
    for suffix, unit in _UNITS:
        if name.endswith(suffix) and not isinstance(value, str):
            return f"{name.removesuffix(suffix)} {_scaled(value, unit)}"
    return f"{name} {value:.6g}" if isinstance(value, float) else f"{name} {value}"


def _item(item: Any) -> str:
    if isinstance(item, dict):
        return f"({', '.join(_entries(item))})"
    return f"{item:.6g}" if isinstance(item, float) else str(item)


def _scaled(value: float, unit: str) -> str:
    for size, prefix in _PREFIXES if unit in ("bit/s", "Hz") else ():
        if value >= size:
            return f"{value / size:.6g} {prefix}{unit}"
    return f"{value:.6g} {unit}"


def rule_ends(rule: LinkRule) -> str:
    """Return whose packets a rule is for."""
    if rule.between is not None:
        ends = f"between {rule.between[0]} and {rule.between[1]}"
    else:
        ends = f"from {', '.join(rule.from_ or ())} to {', '.join(rule.to or ())}"
    if rule.channels is not None:
        ends += f" on {', '.join(rule.channels)}"
    return ends if rule.via is None else f"{ends} via {rule.via}"


def mean_loss(settings: Impairments) -> float:
    """Return the share that is lost on average for reasons that geometry does not explain."""
    kept = 1.0 - settings.loss
    if settings.outages is not None:
        on, off = settings.outages.mean_on_ns, settings.outages.mean_off_ns
        kept *= on / (on + off)
    if settings.burst is not None:
        kept *= 1.0 - settings.burst.loss
    chain = settings.gilbert_elliott
    if chain is not None:
        kept *= (chain.r * chain.k + chain.p * chain.h) / (chain.p + chain.r)
    if settings.markov4 is not None:
        kept *= 1.0 - _mean_of_four(settings.markov4)
    return 1.0 - kept


def _mean_of_four(chain: Markov4) -> float:
    """Return the mean loss of four states, by the balance of flows between each two of them.

    Source: Salsano, Ludovici and Ordine (2009), as `stages.residual` names it.
    """
    if not chain.p13:
        return chain.p14 / (1.0 + chain.p14)
    if chain.p32 and not chain.p23:
        return 0.0  # whoever comes to state 2 stays
    within = chain.p32 / chain.p23 if chain.p23 else 0.0
    if not chain.p31:
        return 1.0 / (1.0 + within)
    lost = chain.p13 / chain.p31
    return (lost + chain.p14) / (1.0 + chain.p14 + lost + lost * within)


def mean_own_delay_ns(settings: Impairments, files: Mapping[str, bytes]) -> float:
    """Return the mean of what a link adds by itself: constant delay, jitter, bad times, what is reordered."""
    mean = float(settings.delay_ns)
    if settings.burst is not None:
        mean += _bad_share(settings.burst) * settings.burst.bad_extra_delay_ns
    if settings.reorder is not None:
        mean += settings.reorder.probability * settings.reorder.extra_ns
    jitter = settings.jitter
    if jitter is None:
        return mean
    table = read_table(files[jitter.file].decode("ascii", "replace")) if isinstance(jitter, TableJitter) else ()
    return mean + moments_ns(quantiles_ns(jitter, table))[0]


def _bad_share(burst: Burst) -> float:
    """Return the share of what passes that passes in a bad time."""
    share = burst.loss / burst.bad_loss if burst.bad_loss else 0.0
    return share * (1.0 - burst.bad_loss) / (1.0 - burst.loss)


def sends_once(settings: Radio) -> bool:
    """Whether a broadcast is one transmission for all its receivers."""
    return settings.medium not in ("none", "wired", "lte") and settings.published == "broadcast"
