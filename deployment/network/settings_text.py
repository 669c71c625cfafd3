"""Readable texts of a network's settings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from foosim.common.json_text import encode_json
from foosim.common.spec_base import SpecBase
from foosim.common.units import format_ns
from foosim.deployment.network.impairments import Impairments, LinkSettings
from foosim.deployment.network.radios import Radio
from foosim.deployment.network.rules import Event, LinkRule

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
"""The unit by the end of a field's name."""
_SHORT: Final = {"bytes_max": "size_bytes", "payload_max": "mtu_bytes", "sense_dbm": "carrier_sense_dbm"}
"""Fields whose keys in a file are other words."""
_PREFIXES: Final = ((1e9, "G"), (1e6, "M"), (1e3, "k"))
_SHARES: Final = frozenset({"loss", "duplicate", "bad_loss", "share", "probability", "duty_cycle", "p", "r", "h", "k"})
_SHARES_OF_CHAINS: Final = frozenset({"p13", "p31", "p32", "p23", "p14", "bit_error_rate"})


def settings_text(settings: SpecBase) -> str:
    """Return the text of the settings other than defaults: `delay 1 ms, loss 0.5 %`."""
    return ", ".join(_entries(settings.model_dump(exclude_unset=True)))


def radio_text(radio: Radio) -> str:
    """Return what of a radio, its preset's settings included, is not as without any."""
    return ", ".join(_entries(_differing(radio.model_dump(exclude={"preset"}), Radio().model_dump())))


def _differing(content: Mapping[str, Any], base: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries that differ from those of `base`, recursively where both are mappings."""
    found = {}
    for name, value in content.items():
        other = base.get(name)
        if value is not None and value != other:
            found[name] = _differing(value, other) if isinstance(value, dict) and isinstance(other, dict) else value
    return found


def impairments_text(settings: Impairments) -> str:
    """Return the text of the settings of a rule, or of an event that changes one, without its ends."""
    written = settings.model_fields_set & set(LinkSettings.model_fields)
    values = {name: getattr(settings, name) for name in written}
    return settings_text(LinkSettings.model_construct(_fields_set=written, **values))


def event_words(event: Event) -> str:
    """Return what an event does, without when."""
    if event.partition is not None:
        what = f"partition {' | '.join(', '.join(group) for group in event.partition)}"
        what += "" if event.symmetric else ", one way"
    elif event.clog is not None:
        what = f"clog from {', '.join(event.clog.from_)} to {', '.join(event.clog.to)}"
    elif event.set is not None:
        what = f"set {event.set.link}: {impairments_text(event.set)}"
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
