"""The impairments of a link that are independent of geometry: loss, delay, rate, errors, copies.

These keys stand in a rule of the network and in a radio; what a rule does not write it takes from the radio. All
delays are one way.
"""

from typing import Annotated, Any, Final, Literal

from pydantic import Field, JsonValue

from foosim.common import units
from foosim.common.spec_base import Name, SpecBase, default
from foosim.common.units import Quantity
from foosim.world.scenery import AssetPath, Digest

Delay = Annotated[int, Quantity(units.TIME, "0 s", "60 s")]
Spread = Annotated[int, Quantity(units.TIME, "1 ns", "60 s")]
Dwell = Annotated[int, Quantity(units.TIME, "1 us", "1 h")]
Probability = Annotated[float, Quantity(units.PROBABILITY, "0 %", "100 %")]
Share = Annotated[float, Quantity(units.PROBABILITY, "0.000001 %", "99 %")]
Bitrate = Annotated[int, Quantity(units.BITRATE, "1 bit/s", "1000 Gbit/s")]
Bytes = Annotated[int, Quantity(units.SIZE, "0 B", "1 GiB")]
ErrorRate = Annotated[float, Quantity(units.PROBABILITY, "0 %", "50 %")]


# --- jitter: the addition to the constant delay, never negative -------------------------------------------------------


def _mean_is_sd(data: dict[str, Any]) -> int:
    return int(data["sd_ns"])


class GammaJitter(SpecBase):
    """Gamma distributed: skewed to the right, from 0."""

    shape: Literal["gamma"]
    sd_ns: Spread = Field(alias="sd")
    mean_ns: Spread = Field(alias="mean", default_factory=_mean_is_sd)


class UniformJitter(SpecBase):
    """Anything from 0 to `width`, equally likely."""

    shape: Literal["uniform"]
    width_ns: Spread = Field(alias="width")


class LognormalJitter(SpecBase):
    """The exponential of a normal number: a heavier tail than gamma."""

    shape: Literal["lognormal"]
    sd_ns: Spread = Field(alias="sd")
    mean_ns: Spread = Field(alias="mean", default_factory=_mean_is_sd)


class ShiftedExponentialJitter(SpecBase):
    """The greater of `min` and an exponential number with the mean `mean` (TigerBeetle's packet simulator)."""

    shape: Literal["shifted_exp"]
    min_ns: Delay = default("0 s", "min")
    mean_ns: Spread = Field(alias="mean")


PARETO_MAX: Final = "10 s"


class ParetoJitter(SpecBase):
    """A Lomax (Pareto II) distribution from 0, cut at `max`, with the mean `mean`: `alpha` above 1 is its tail."""

    shape: Literal["pareto"]
    mean_ns: Spread = Field(alias="mean")
    alpha: Annotated[float, Field(ge=1.01, le=100.0)] = 2.5
    max_ns: Spread = default(PARETO_MAX, "max")


class Component(SpecBase):
    """One part of a mixture: uniform between `from` and `to`, chosen with the probability `share`."""

    share: Probability
    from_ns: Delay = default("0 s", "from")
    to_ns: Delay = Field(alias="to")


class MixtureJitter(SpecBase):
    """Uniform parts with shares that add up to 100 %, as a usual delay and a rare long one."""

    shape: Literal["mixture"]
    parts: list[Component] = Field(min_length=1, max_length=16)


class TableJitter(SpecBase):
    """Quantiles from a file in netem's form: whitespace separated integers, 8192 a standard deviation; below 0 is 0."""

    shape: Literal["table"]
    file: AssetPath
    mean_ns: Spread = Field(alias="mean")
    sd_ns: Spread = Field(alias="sd")
    digest: Digest | None = None


Jitter = Annotated[
    GammaJitter
    | UniformJitter
    | LognormalJitter
    | ShiftedExponentialJitter
    | ParetoJitter
    | MixtureJitter
    | TableJitter,
    Field(discriminator="shape"),
]


# --- loss in bursts ---------------------------------------------------------------------------------------------------


class ParetoDwell(SpecBase):
    """Heavy-tailed lengths of bad times: Pareto with the tail `alpha`, cut at `max`, with the mean of `mean_bad`."""

    alpha: Annotated[float, Field(ge=1.01, le=10.0)]
    max_ns: Dwell = Field(alias="max")


BURST_MAX: Final = 1e6


class Burst(SpecBase):
    """Gilbert-Elliott by its effect: `loss` is the mean loss, `mean_bad` the mean length of a bad time.

    `mean_bad` is a time: all flows on a link see the same outages, whatever their rate. `mean_burst` instead counts
    lost packets in a row. In a bad time a packet is lost with `bad_loss`, else it comes later by `bad_extra_delay`.
    """

    loss: Share
    mean_bad_ns: Dwell | None = Field(default=None, alias="mean_bad")
    mean_burst: Annotated[float, Field(ge=1.0, le=BURST_MAX)] | None = None
    bad_loss: Probability = default("100 %")
    bad_extra_delay_ns: Delay = default("0 s", "bad_extra_delay")
    dwell: ParetoDwell | None = None


class GilbertElliott(SpecBase):
    """Gilbert-Elliott packet by packet: good to bad with `p`, back with `r`; delivered with `k` in good, `h` in bad."""

    p: Share
    r: Annotated[float, Quantity(units.PROBABILITY, "0.000001 %", "100 %")]
    h: Probability = default("0 %")
    k: Probability = default("100 %")


class Markov4(SpecBase):
    """Four states packet by packet (Salsano et al.): 1 good, 3 bad, 4 a loss within good, 2 a delivery within bad."""

    p13: Probability
    p31: Probability
    p32: Probability = default("0 %")
    p23: Probability = default("0 %")
    p14: Probability = default("0 %")


class Outages(SpecBase):
    """Random outages of the link, as of a mobile network: exponential times on and off."""

    mean_on_ns: Dwell = Field(alias="mean_on")
    mean_off_ns: Dwell = Field(alias="mean_off")


# --- rate, queue, errors, copies --------------------------------------------------------------------------------------


class Queue(SpecBase):
    """The send queue: limits of packets, bytes and waiting time; `codel` drops early."""

    packets: Annotated[int, Field(ge=1, le=1_000_000)] = 1000
    bytes_max: Bytes = default("64 MiB", "bytes")
    wait_ns: Annotated[int, Quantity(units.TIME, "1 us", "1 h")] = default("1 h", "wait")
    drop: Literal["tail", "codel"] = "tail"
    codel_target_ns: Spread = default("5 ms", "codel_target")
    codel_interval_ns: Spread = default("100 ms", "codel_interval")


class Corrupt(SpecBase):
    """Bit errors: a packet with one is lost (`crc_fail`), or delivered with its bits flipped when `deliver` is set."""

    bit_error_rate: ErrorRate
    deliver: bool = False


class Reorder(SpecBase):
    """Some packets come later by `extra`: later packets overtake them."""

    probability: Probability
    extra_ns: Spread = Field(alias="extra")


class Trace(SpecBase):
    """The link's capacity from a file in mahimahi's form: each line a time in ms at which 1500 bytes can leave."""

    file: AssetPath
    loop: bool = True
    digest: Digest | None = None


class Impairments(SpecBase):
    """The impairments of a link beside radio and geometry."""

    delay_ns: Delay = default("0 s", "delay")
    jitter: Jitter | None = None
    order: Literal["fifo", "free"] = "fifo"
    loss: Probability = default("0 %")
    burst: Burst | None = None
    gilbert_elliott: GilbertElliott | None = None
    markov4: Markov4 | None = None
    outages: Outages | None = None
    rate_bps: Bitrate | None = Field(default=None, alias="rate")
    overhead_bytes: Annotated[int, Quantity(units.SIZE, "0 B", "10 kB")] = default("0 B", "overhead")
    queue: Queue = Field(default_factory=Queue)
    trace: Trace | None = None
    corrupt: Corrupt | None = None
    duplicate: Probability = default("0 %")
    reorder: Reorder | None = None
    payload_max: Annotated[int, Quantity(units.SIZE, "1 B", "1 GiB")] | None = Field(default=None, alias="mtu")
    """The longest payload of a frame: a longer packet travels in several."""
    ttl_ns: Annotated[int, Quantity(units.TIME, "1 us", "1 h")] | None = Field(default=None, alias="ttl")
    """Packets with a greater delay are dropped (`expired`)."""
    allow: bool = True
    """Whether packets may pass at all; else they are `filtered`."""


class OwnModel(SpecBase):
    """A custom link model, of a package that is installed on the vHub's machine, and its parameters."""

    name: Name
    parameters: dict[str, JsonValue] = Field(default={}, max_length=256)


class LinkSettings(Impairments):
    """Settings of links in a radio or a rule; only these have a custom model, no event changes it."""

    model: OwnModel | None = None


BURSTS: Final = ("burst", "gilbert_elliott", "markov4")
"""Models of loss in bursts: a link has one of them at most."""
