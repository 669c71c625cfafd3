"""Radios and wires: what an endpoint carries, how its signal spreads, and how it gets at the medium.

A radio names a preset and writes what differs: a preset is the same keys with a source for each value (`presets`).
"""

from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal, Self

from pydantic import Field, ModelWrapValidatorHandler, PrivateAttr, model_validator

from foosim.common import units
from foosim.common.spec_base import Name, SpecBase, default
from foosim.common.units import Quantity
from foosim.deployment.network.impairments import LinkSettings
from foosim.deployment.network.presets import PRESETS, preset_settings

Frequency = Annotated[float, Quantity(units.FREQUENCY, "1 kHz", "100 GHz")]
Bandwidth = Annotated[float, Quantity(units.FREQUENCY, "1 kHz", "10 GHz")]
PowerLevel = Annotated[float, Quantity(units.POWER_LEVEL, "-200 dBm", "100 dBm")]
Gain = Annotated[float, Quantity(units.GAIN, "-50 dBi", "60 dBi")]
Level = Annotated[float, Quantity(units.LEVEL, "0 dB", "100 dB")]
Offset = Annotated[float, Quantity(units.LENGTH, "-100 m", "100 m")]
Place = Annotated[list[Offset], Field(min_length=3, max_length=3)]
Coordinate = Annotated[float, Quantity(units.LENGTH, "-100 km", "100 km")]
Site = Annotated[list[Coordinate], Field(min_length=3, max_length=3)]
Distance = Annotated[float, Quantity(units.LENGTH, "1 mm", "100 km")]
Spread = Annotated[int, Quantity(units.TIME, "1 ns", "60 s")]

PresetName = Literal[
    "perfect", "range_only", "acoustic", "wifi_2_4_indoor", "wifi_5_indoor", "dot11p", "lte", "lora_eu868",
    "zigbee", "wired_1g", "internet",
]  # fmt: skip
Environment = Literal[
    "free_space", "indoor", "v2v_urban", "v2v_highway", "urban_micro", "urban_macro", "log_distance", "two_ray",
    "itu_1238", "lora",
]  # fmt: skip


class Antenna(SpecBase):
    """Where the antenna is: x, y, z beside that of its body, in the body's frame; and its gain in every direction."""

    gain_dbi: Gain = default("0 dBi", "gain")
    mount: Place = Field(default=["0 m", "0 m", "0 m"], validate_default=True)


class PathLoss(SpecBase):
    """How a signal weakens with distance: an environment with its figures, and what bodies in between do.

    With `strict_los` a body in the way cuts the link (`blocked`), as for light. `range` is a hard radius.
    """

    environment: Environment = "free_space"
    exponent: Annotated[float, Field(ge=1.0, le=10.0)] = 3.0
    reference_db: Annotated[float, Quantity(units.LEVEL, "0 dB", "200 dB")] = default("46.68 dB", "reference_loss")
    site: Literal["home", "office", "shop"] = "office"
    floors: Annotated[int, Field(ge=0, le=20)] = 0
    strict_los: bool = False
    range_m: Distance | None = Field(default=None, alias="range")


class Shadowing(SpecBase):
    """Slow changes of the loss from place to place; by default those of the environment."""

    on: bool = True
    sigma_db: Level | None = Field(default=None, alias="sigma")
    correlation_m: Distance | None = Field(default=None, alias="correlation")


class Fading(SpecBase):
    """Fast changes of the loss, the same within a block of `coherence`."""

    kind: Literal["rayleigh", "rician", "nakagami"]
    k_db: Level = default("8 dB", "k")
    """By default as INET has it."""
    m: Annotated[float, Field(ge=0.5, le=100.0)] | None = None
    coherence_ns: Spread = default("10 ms", "coherence")


class RadioKeys(LinkSettings):
    """All settings of a radio."""

    medium: Literal["none", "wired", "radio", "wifi", "ieee802154", "lora", "lte"] = "none"
    air: Name | None = None
    """Radios with the same air share a channel; by default those of one name do."""
    frequency_hz: Frequency = default("2.4 GHz", "frequency")
    bandwidth_hz: Bandwidth = default("20 MHz", "bandwidth")
    tx_power_dbm: PowerLevel = default("20 dBm", "tx_power")
    noise_figure_db: Level = default("7 dB", "noise_figure")
    sense_dbm: PowerLevel = default("-82 dBm", "carrier_sense")
    """A station hears another one, and waits for it, from this power on."""
    sensitivity_dbm: PowerLevel = default("-200 dBm", "sensitivity")
    """A signal below it is not received at all."""
    antenna: Antenna = Field(default_factory=Antenna)
    path_loss: PathLoss = Field(default_factory=PathLoss)
    shadowing: Shadowing = Field(default_factory=Shadowing)
    fading: Fading | None = None
    standard: Literal["802.11a/g", "802.11n"] = "802.11a/g"
    """Of Wi-Fi: 6 to 54 Mbit/s (half of it in 10 MHz, 802.11p), or MCS 0 to 7 in 20 MHz with the long guard interval,
    6.5 to 65 Mbit/s, broadcasts at 6 Mbit/s."""
    rates: Literal["ideal", "fixed"] = "ideal"
    fixed_rate_bps: Annotated[int, Quantity(units.BITRATE, "1 kbit/s", "1 Gbit/s")] = default("6 Mbit/s", "fixed_rate")
    access: Literal["best_effort", "video", "voice"] = "best_effort"
    """The Wi-Fi access category: its window and its waiting time."""
    retries: Annotated[int, Field(ge=0, le=31)] = 7
    published: Literal["broadcast", "unicast"] = "broadcast"
    """The transmission of a packet for all subscribers: once for all without acknowledgement, or once for each.

    Over LTE it is once for each."""
    spreading_factor: Annotated[int, Field(ge=7, le=12)] = 7
    coding_rate: Annotated[int, Field(ge=1, le=4)] = 1
    """Of LoRa: 4 / (4 + this)."""
    gateway: bool = False
    """Of LoRa: the receiver is a gateway's, which hears weaker signals than a device's."""
    duty_cycle: Annotated[float, Quantity(units.PROBABILITY, "0.001 %", "100 %")] = default("100 %")
    """In no `duty_window`, wherever it begins, is the radio on air for more than this share of it."""
    duty_window_ns: Annotated[int, Quantity(units.TIME, "1 s", "24 h")] = default("1 h", "duty_window")
    speed_m_s: Annotated[float, Quantity(units.SPEED, "1 m/s", "299792458 m/s")] = default("299792458 m/s", "speed")
    """At which the signal travels."""

    @property
    def is_on_air(self) -> bool:
        """Whether packets go by radio: where the ends are decides, and others on air."""
        return self.medium not in ("none", "wired")

    @property
    def sends_once(self) -> bool:
        """Whether a broadcast is one transmission for all its receivers; a base station sends to each by itself."""
        return self.is_on_air and self.published == "broadcast" and self.medium != "lte"

    @property
    def has_queue(self) -> bool:
        """Whether packets wait until the one before them is sent."""
        return self.medium != "none" or self.rate_bps is not None or self.trace is not None


LORA_LONGEST: Final = (222, 222, 115, 51, 51, 51)
"""Bytes that LoRaWAN allows by spreading factor 7 to 12 in Europe; recalled, unverified."""


def lora_longest(factor: object) -> int | None:
    """Return the longest payload of a spreading factor, in bytes; None for an unknown factor."""
    return LORA_LONGEST[factor - 7] if isinstance(factor, int) and 7 <= factor <= 12 else None


_PART_BY_PART = ("antenna", "path_loss", "shadowing", "queue")
"""Mappings of which a radio may write one key and keep the preset's others; the rest replace the preset's whole."""


def over(base: dict[str, Any], settings: dict[str, Any]) -> dict[str, Any]:
    """Return settings over those of a preset."""
    merged = {**base, **settings}
    for key in _PART_BY_PART:
        if isinstance(base.get(key), dict) and isinstance(settings.get(key), dict):
            merged[key] = {**base[key], **settings[key]}
    return merged


class Radio(RadioKeys):
    """A radio (or a wire) that endpoints carry: its preset, and what differs from it."""

    preset: PresetName = "perfect"

    _written: Mapping[str, Any] = PrivateAttr(default_factory=dict)

    @property
    def written(self) -> Mapping[str, Any]:
        """Return its keys in the file, as plain data; the rest is of its preset."""
        return self._written

    @model_validator(mode="wrap")
    @classmethod
    def _take_preset(cls, value: Any, read: ModelWrapValidatorHandler[Self]) -> Self:
        """Settings over those of their preset; the payloads of LoRa are as long as its spreading factor lets them."""
        name = value.get("preset", "perfect") if isinstance(value, dict) else None
        if not isinstance(name, str) or name not in PRESETS:
            return read(value)
        merged = over(preset_settings(name), value)
        longest = lora_longest(merged.get("spreading_factor", 7)) if merged.get("medium") == "lora" else None
        radio = read(merged if longest is None or "mtu" in value else {**merged, "mtu": f"{longest} B"})
        radio._written = value
        return radio
