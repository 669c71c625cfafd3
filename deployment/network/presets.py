"""Presets of radios and wires: every value with its source.

The mark before a source says how far to trust it: [S] read in a standard's reference code or a project's source,
[M] measured in a cited paper, [C] computed from such, [R] recalled from a standard that was not at hand: unverified,
[J] judgement, without a source. Keys and units are those of `radios`; what a preset does not say has its default there.
"""

from collections.abc import Iterator, Mapping
from typing import Any, Final, NamedTuple


class Sourced(NamedTuple):
    """A value as it is written in a file, and its source."""

    value: Any
    source: str


_v: Final = Sourced


_NS3 = "[S] ns-3"
_INH = "[S] 3GPP TR 38.901 InH-office, as ns-3 three-gpp-propagation-loss-model.cc has it"
_OFDM_RETRIES = f"{_NS3} wifi: 7 retries of unicast, none of broadcast"
_UNICAST_QUEUE = {"packets": _v(100, "[J]"), "bytes": _v("64 KiB", "[J]")}

_WIFI: Final[Mapping[str, Any]] = {
    "medium": _v("wifi", "IEEE 802.11"),
    "bandwidth": _v("20 MHz", "IEEE 802.11 OFDM"),
    "noise_figure": _v("7 dB", f"{_NS3} wifi-phy.cc; -94.0 dBm in 20 MHz [C]"),
    "carrier_sense": _v("-82 dBm", f"{_NS3} CCA threshold of a Wi-Fi preamble"),
    "path_loss": {"environment": _v("indoor", _INH)},
    "standard": _v("802.11a/g", "[J] write 802.11n for MCS 0 to 7"),
    "rates": _v("ideal", "[J] the highest rate with at most 10 % errors"),
    "retries": _v(7, _OFDM_RETRIES),
    "queue": _UNICAST_QUEUE,
    "order": _v("fifo", "[J] one hop"),
    "mtu": _v("1500 B", "IEEE 802.3 payload, usual over Wi-Fi"),
}

PRESETS: Final[Mapping[str, Mapping[str, Any]]] = {
    "perfect": {"medium": _v("none", "nothing is lost, nothing is late")},
    "range_only": {
        "medium": _v("radio", "a hard radius, as swarm papers assume"),
        "path_loss": {
            "environment": _v("free_space", "any: the radius decides"),
            "range": _v("10 m", "[J] write yours"),
        },
        "shadowing": {"on": _v(False, "a hard radius")},
        "tx_power": _v("100 dBm", "so that the radius alone decides"),
    },
    "acoustic": {
        "medium": _v("radio", "[J] an acoustic modem: few bits, long delays"),
        "speed": _v("1500 m/s", "sound in water, usual value"),
        "path_loss": {"environment": _v("free_space", "[J]"), "range": _v("1000 m", "[J] write your modem's")},
        "shadowing": {"on": _v(False, "[J]")},
        "tx_power": _v("100 dBm", "so that the radius alone decides"),
        "rate": _v("5 kbit/s", "[J] write your modem's"),
        "loss": _v("1 %", "[J]"),
        "queue": {"packets": _v(10, "[J]")},
        "mtu": _v("512 B", "[J]"),
    },
    "wifi_2_4_indoor": {
        **_WIFI,
        "frequency": _v("2.437 GHz", "IEEE 802.11 channel 6"),
        "tx_power": _v("20 dBm", "[R] the EU's limit (EIRP); ns-3's default is 16.02 dBm [S]"),
        "burst": _v({"loss": "0.1 %", "mean_bad": "20 ms"}, "[J]; mean bursts of 3 packets [M] doi 10.3390/s22228592"),
        "delay": _v("0.5 ms", "[J] besides access and airtime"),
        "jitter": _v({"shape": "gamma", "sd": "0.5 ms"}, "[J]"),
    },
    "wifi_5_indoor": {
        **_WIFI,
        "frequency": _v("5.25 GHz", "IEEE 802.11 channel 50"),
        "tx_power": _v("23 dBm", "[R] the EU's indoor limit (EIRP)"),
        "burst": _v({"loss": "0.05 %", "mean_bad": "20 ms"}, "[J]; mean bursts of 3 packets [M] doi 10.3390/s22228592"),
        "delay": _v("0.3 ms", "[J] besides access and airtime"),
        "jitter": _v({"shape": "gamma", "sd": "0.3 ms"}, "[J]"),
    },
    "dot11p": {
        **_WIFI,
        "frequency": _v("5.9 GHz", "IEEE 802.11p"),
        "bandwidth": _v("10 MHz", f"{_NS3} wave"),
        "tx_power": _v("23 dBm", "[R]"),
        "noise_figure": _v("9 dB", "[J]; -95.0 dBm in 10 MHz [C]"),
        "carrier_sense": _v("-85 dBm", "[R]"),
        "path_loss": {"environment": _v("v2v_urban", "[S] 3GPP TR 37.885, as ns-3 has it")},
        "standard": _v("802.11a/g", "IEEE 802.11p is that in 10 MHz"),
        "rates": _v("fixed", "[R] safety messages go at one rate"),
        "fixed_rate": _v("6 Mbit/s", "[R] QPSK 1/2 at 10 MHz"),
        "retries": _v(0, "[R] broadcast"),
        "queue": {"packets": _v(50, "[J]")},
        "burst": _v({"loss": "0.5 %", "mean_bad": "100 ms"}, "[J]"),
        "delay": _v("0.5 ms", "[J] besides access and airtime"),
        "jitter": _v({"shape": "gamma", "sd": "0.2 ms"}, "[J]"),
        "mtu": _v("1400 B", "[R]"),
    },
    "lte": {
        "medium": _v("lte", "a link between a terminal and a base station"),
        "frequency": _v("2.0 GHz", "[J]"),
        "bandwidth": _v("10 MHz", "[J]"),
        "tx_power": _v("23 dBm", "[R] a terminal; write 46 dBm for a base station [R]"),
        "noise_figure": _v("8.5 dB", "[R] 9 dB a terminal, 5 dB a base station; -95.5 dBm in 10 MHz [C]"),
        "path_loss": {"environment": _v("urban_macro", "[S] 3GPP TR 38.901 UMa, as ns-3 has it")},
        "outages": _v(
            {"mean_on": "5 s", "mean_off": "300 ms"},
            "[J] 5.7 % of the time; mahimahi's traces, driving, have 3 to 17 % in gaps up to 1.7 s [C]",
        ),
        "loss": _v("0.3 %", "[J]"),
        "delay": _v("30 ms", "[J] as two network tools have it"),
        "jitter": _v({"shape": "gamma", "sd": "15 ms", "mean": "15 ms"}, "[J] the same"),
        "queue": {"packets": _v(1000, "[J]"), "wait": _v("500 ms", "[J]")},
        "order": _v("fifo", "[J] one bearer"),
        "mtu": _v("1428 B", "[R]"),
    },
    "lora_eu868": {
        "medium": _v("lora", "LoRa, pure ALOHA"),
        "frequency": _v("868.1 MHz", "[S] signetlabdei/lorawan"),
        "bandwidth": _v("125 kHz", "[S] the same"),
        "tx_power": _v("14 dBm", "[S] the same"),
        "noise_figure": _v("6 dB", "[J]; -117 dBm in 125 kHz [C]"),
        "path_loss": {"environment": _v("lora", "[S] signetlabdei/lorawan examples")},
        "spreading_factor": _v(7, "[J] write yours"),
        "coding_rate": _v(1, "[S] the same: 4/5"),
        "duty_cycle": _v("1 %", "[S] the same: 868.0 to 868.6 MHz"),
        "duty_window": _v("1 h", "[R] ETSI EN 300 220-1, observation interval: unverified"),
        "published": _v("broadcast", "ALOHA"),
        "retries": _v(0, "[J] unconfirmed"),
        "loss": _v("1 %", "[J]"),
        "delay": _v("5 ms", "[J]"),
        "queue": {"packets": _v(4, "[J]")},
        "mtu": _v("222 B", "[R] LoRaWAN at SF7 and SF8; by itself 115 B at SF9, 51 B from SF10 on"),
    },
    "zigbee": {
        "medium": _v("ieee802154", "IEEE 802.15.4 O-QPSK"),
        "frequency": _v("2.44 GHz", "IEEE 802.15.4"),
        "bandwidth": _v("2 MHz", "IEEE 802.15.4"),
        "tx_power": _v("0 dBm", "[J]; INET has 3.5 dBm [S]"),
        "noise_figure": _v("14.4 dB", "[C] INET's -96.6 dBm [S] in 2 MHz"),
        "sensitivity": _v("-100 dBm", "[S] INET; the standard requires -85 dBm"),
        "carrier_sense": _v("-85 dBm", "[J]"),
        "path_loss": {"environment": _v("indoor", _INH)},
        "retries": _v(3, f"{_NS3} lr-wpan-mac.cc"),
        "burst": _v({"loss": "1 %", "mean_burst": 4}, "[J] four lost in a row in the mean"),
        "delay": _v("2 ms", "[J] besides access and airtime"),
        "queue": {"packets": _v(10, "[J]")},
        "mtu": _v("102 B", "[S] 127 bytes of PSDU less headers"),
    },
    "wired_1g": {
        "medium": _v("wired", "Ethernet"),
        "rate": _v("1 Gbit/s", "IEEE 802.3"),
        "overhead": _v("38 B", "IEEE 802.3: preamble, header, check sum, gap"),
        "jitter": _v(
            {
                "shape": "mixture",
                "parts": [
                    {"share": "99.9 %", "from": "0.1 ms", "to": "0.8 ms"},
                    {"share": "0.1 %", "from": "0.8 ms", "to": "100 ms"},
                ],
            },
            "[S] FoundationDB fdbrpc/sim2.cpp",
        ),
        "corrupt": _v({"bit_error_rate": "1e-10 p"}, "[R] IEEE 802.3's bound"),
        "queue": {"packets": _v(1000, "[S] netem's default limit")},
        "order": _v("fifo", "one wire"),
        "mtu": _v("1500 B", "IEEE 802.3"),
    },
    "internet": {
        "medium": _v("wired", "ITU-T G.1050, profile B (partially managed)"),
        "rate": _v("100 Mbit/s", "[J]"),
        "delay": _v("20 ms", "[R] G.1050 B: 20 to 100 ms"),
        "jitter": _v(
            {"shape": "gamma", "mean": "15 ms", "sd": "15 ms"}, "[R] G.1050 B: up to 150 ms; the shape is [J]"
        ),
        "burst": _v({"loss": "1 %", "mean_bad": "100 ms"}, "[R] G.1050 B: 0 to 2 %, bursts of 40 to 200 ms"),
        "reorder": _v({"probability": "0.01 %", "extra": "10 ms"}, "[R] G.1050 B: 0 to 0.01 %"),
        "queue": {"packets": _v(1000, "[S] netem's default limit")},
        "order": _v(
            "free",
            "[J] many paths: with this jitter more overtake than G.1050 B's 0.01 % (lint: how many); none with fifo",
        ),
        "mtu": _v("1500 B", "[J]"),
    },
}


def preset_settings(name: str) -> dict[str, Any]:
    """Return a preset as it would be written in a file."""
    return {key: _plain(value) for key, value in PRESETS[name].items()}


def provenance(name: str) -> Iterator[tuple[str, str, str]]:
    """Yield (key, value, source) of every value of a preset."""
    for key, entry in PRESETS[name].items():
        if isinstance(entry, Sourced):
            yield key, _text(entry.value), entry.source
        else:
            for inner, sourced in entry.items():
                yield f"{key}.{inner}", _text(sourced.value), sourced.source


def _plain(entry: Any) -> Any:
    return entry.value if isinstance(entry, Sourced) else {key: sourced.value for key, sourced in entry.items()}


def _text(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key} {_text(inner)}" for key, inner in value.items())
    if isinstance(value, list):
        return "; ".join(_text(inner) for inner in value)
    return str(value)
