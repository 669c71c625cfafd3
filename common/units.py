"""Quantities: their texts (`2 ms`, `0.5 %`, `84 mm`) and their numbers in the code.

In a file every quantity is a string with its unit. In the code it is a float in SI units, except time, which is an
integer count of nanoseconds, counts of ticks, which are integers, and rates, which are exact fractions of hertz.
Numbers are read as exact fractions and rounded once, so `84 mm` is the float nearest to 0.084.

`Quantity` is the annotation for the fields of the deployment's models.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Annotated, Any, Final, Literal

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from foosim.common.errors import BadValue
from foosim.common.names import nearest_name

NS_PER_S: Final = 1_000_000_000
NUMBERS_KEPT: Final = 4_096
"""Cached quantities: the robots of a fleet have most of theirs in common."""

_NUMBER: Final = r"[+-]?[0-9]{1,20}(?:\.[0-9]{1,30})?(?:[eE][+-]?[0-9]{1,2})?"
_RATIO: Final = r"[0-9]{1,20}/[1-9][0-9]{0,19}"
_QUANTITY = re.compile(rf"({_NUMBER}|{_RATIO}) *([A-Za-z%\u00b0\u00b5].*)?")
# Alternative characters in units, and their replacements.
_SIGNS: Final = str.maketrans({"^": "", "\u00b2": "2", "\u00b0": "deg", "\u00b7": " ", "*": " ", "\u00b5": "u"})
_DEGREE: Final = Fraction(math.pi) / 180


@dataclass(frozen=True, slots=True, eq=False)
class Dimension:
    """What a unit measures: the name used in messages, the units with their size, and the type of the result."""

    name: str
    units: Mapping[str, Fraction]
    kind: Literal["float", "int", "fraction"] = "float"
    usual: str = ""
    """The suggested unit for a number without one; empty where that is the unit that values are shown in."""

    @property
    def base(self) -> str:
        """The unit whose size is 1, in which values are shown."""
        return next(unit for unit, size in self.units.items() if size == 1)

    @property
    def form(self) -> str:
        """Description of the accepted form."""
        return f"a number and one of {', '.join(self.units)}"

    @property
    def refusal(self) -> str:
        """Error text for a value of another form."""
        return f"not {self.one} ({self.form})"

    @property
    def one(self) -> str:
        """Its name with the indefinite article."""
        return f"{'an' if self.name[0] in 'aeiou' else 'a'} {self.name}"


def _sizes(**units: str) -> dict[str, Fraction]:
    return {unit: Fraction(size) for unit, size in units.items()}


TIME: Final = Dimension("time", _sizes(ns="1", us="1e3", ms="1e6", s="1e9", min="60e9", h="3600e9"), "int", "s")
TICKS: Final = Dimension("number of ticks", _sizes(ticks="1", tick="1"), "int")
_BINARY: Final = _sizes(KiB="1024", MiB="1048576", GiB="1073741824", TiB="1099511627776")
SIZE: Final = Dimension("size", _sizes(B="1", kB="1e3", MB="1e6", GB="1e9", TB="1e12") | _BINARY, "int")
RATE: Final = Dimension("rate", _sizes(Hz="1", kHz="1e3", mHz="1e-3"), "fraction")
LENGTH: Final = Dimension("length", _sizes(m="1", cm="1e-2", mm="1e-3", um="1e-6", km="1e3"))
MASS: Final = Dimension("mass", _sizes(kg="1", g="1e-3", mg="1e-6"))
ANGLE: Final = Dimension("angle", {"rad": Fraction(1), "mrad": Fraction(1, 1000), "deg": _DEGREE}, usual="deg")
SPEED: Final = Dimension(
    "speed", {"m/s": Fraction(1), "cm/s": Fraction(1, 100), "mm/s": Fraction(1, 1000), "km/h": Fraction(5, 18)}
)
SPIN: Final = Dimension("rotational speed", {"rad/s": Fraction(1), "deg/s": _DEGREE, "rpm": Fraction(math.pi) / 30})
ACCELERATION: Final = Dimension("acceleration", {"m/s2": Fraction(1), "mm/s2": Fraction(1, 1000)})
ANGULAR_ACCELERATION: Final = Dimension("angular acceleration", {"rad/s2": Fraction(1), "deg/s2": _DEGREE})
FORCE: Final = Dimension("force", _sizes(N="1", mN="1e-3", kN="1e3"))
TORQUE: Final = Dimension("torque", {"N m": Fraction(1), "mN m": Fraction(1, 1000)})
IMPULSE: Final = Dimension("impulse", {"N s": Fraction(1), "mN s": Fraction(1, 1000)})
LEVEL: Final = Dimension("level", _sizes(dB="1"))
ENERGY: Final = Dimension("energy", _sizes(J="1", kJ="1e3", Wh="3600", kWh="3.6e6"))
POWER: Final = Dimension("power", _sizes(W="1", mW="1e-3", kW="1e3"))
VOLTAGE: Final = Dimension("voltage", _sizes(V="1", mV="1e-3", kV="1e3"))
CURRENT: Final = Dimension("current", _sizes(A="1", mA="1e-3"))
TEMPERATURE: Final = Dimension("temperature", _sizes(degC="1"))
DENSITY: Final = Dimension("density", {"kg/m3": Fraction(1), "g/cm3": Fraction(1000)})
VISCOSITY: Final = Dimension("viscosity", {"Pa s": Fraction(1), "mPa s": Fraction(1, 1000)})
RESISTANCE: Final = Dimension("resistance", _sizes(Ohm="1", mOhm="1e-3"))
INERTIA: Final = Dimension("moment of inertia", {"kg m2": Fraction(1), "g cm2": Fraction(1, 10**7)})
FORCE_CONSTANT: Final = Dimension("force constant", {"N/A": Fraction(1)})
TORQUE_CONSTANT: Final = Dimension("torque constant", {"N m/A": Fraction(1), "mN m/A": Fraction(1, 1000)})
SPEED_CONSTANT: Final = Dimension("voltage per speed", {"V s/m": Fraction(1)})
SPIN_CONSTANT: Final = Dimension(
    "voltage per rotational speed", {"V s/rad": Fraction(1), "mV s/rad": Fraction(1, 1000)}
)
PROBABILITY: Final = Dimension("probability", {"p": Fraction(1), "%": Fraction(1, 100)}, usual="%")
FREQUENCY: Final = Dimension("frequency", _sizes(Hz="1", kHz="1e3", MHz="1e6", GHz="1e9"))
BITRATE: Final = Dimension(
    "bit rate", _sizes(**{"bit/s": "1", "kbit/s": "1e3", "Mbit/s": "1e6", "Gbit/s": "1e9"}), "int"
)
POWER_LEVEL: Final = Dimension("power level", _sizes(dBm="1"))
GAIN: Final = Dimension("antenna gain", _sizes(dBi="1"))

_DIMENSIONS: Final = [one for one in globals().values() if isinstance(one, Dimension)]


def parse(text: object, dimension: Dimension) -> Fraction:
    """The quantity in the dimension's base unit, exact; raises BadValue."""
    if not isinstance(text, str):
        raise BadValue(dimension.refusal, text)
    match = _QUANTITY.fullmatch(text.strip(" "))
    if match is None or ("/" in match[1] and dimension.kind != "fraction"):
        raise BadValue(dimension.refusal, text)
    number, unit = match[1], match[2]
    if unit not in dimension.units:
        # Dimensions are equal by their base unit, so MHz is one of a rate, too.
        for other in _DIMENSIONS:
            if unit in other.units and other.base not in dimension.units:
                raise BadValue(f"{dimension.refusal}; {unit} measures {other.one}", text)
        close = (dimension.usual or dimension.base) if unit is None else _nearest_unit(unit, dimension)
        nearest = None if close is None else repr(f"{number} {close}")
        raise BadValue(dimension.refusal, text, nearest)
    return Fraction(number) * dimension.units[unit]


def in_one_unit(texts: Sequence[str]) -> tuple[list[float], str] | None:
    """Quantities of one dimension as numbers of the first one's unit, with it; None for other texts.

    Plain numbers are quantities of the unit ''.
    """
    matches = [_QUANTITY.fullmatch(text.strip(" ")) for text in texts]
    found = [(Fraction(match[1]), match[2] or "") for match in matches if match is not None]
    if len(found) < len(texts) or not found:
        return None
    unit = found[0][1]
    for units in ({"": Fraction(1)}, *(one.units for one in _DIMENSIONS)):
        if all(own in units for _, own in found):
            return [float(number * units[own] / units[unit]) for number, own in found], unit
    return None


def _nearest_unit(unit: str, dimension: Dimension) -> str | None:
    """The unit that was probably meant: first one that differs in case alone, so that `MM` suggests `mm`."""
    plain = unit[:32].translate(_SIGNS)
    equal = [candidate for candidate in dimension.units if candidate.lower() == plain.lower()]
    return equal[0] if equal else nearest_name(plain, dimension.units, 0.5)


def parse_ns(text: object) -> int:
    """A time (`20s`, `2 ms`) in integer nanoseconds, at least 0; raises BadValue."""
    value = parse(text, TIME)
    if value < 0:
        raise BadValue("negative; a time is at least 0", text)
    if value.denominator != 1:
        raise BadValue("not a whole number of ns", text)
    return int(value)


def parse_offset_ns(text: str) -> int:
    """A time in integer nanoseconds that may be negative (`-1s`); raises BadValue."""
    sign = -1 if text.startswith("-") else 1
    return sign * parse_ns(text.removeprefix("-"))


def format_ns(time_ns: int) -> str:
    """A time in the largest unit that keeps it a whole number: `2 ms`, `500 us`, `20 s`."""
    for unit, size in (("s", 1_000_000_000), ("ms", 1_000_000), ("us", 1_000)):
        if time_ns % size == 0:
            return f"{time_ns // size} {unit}"
    return f"{time_ns} ns"


def format_rate(rate_hz: Fraction) -> str:
    """A rate that reads back as the same fraction: `100 Hz`, `12.5 Hz`, `500/3 Hz`."""
    denominator = rate_hz.denominator
    for prime in (2, 5):
        while denominator % prime == 0:
            denominator //= prime
    if denominator != 1:
        return f"{rate_hz.numerator}/{rate_hz.denominator} Hz"
    places = max(rate_hz.denominator.bit_length(), 1)
    text = f"{rate_hz.numerator * 10**places // rate_hz.denominator:0{places + 1}d}"
    return f"{text[:-places]}.{text[-places:]}".rstrip("0").rstrip(".") + " Hz"


def period_ticks(rate_hz: Fraction, tick_ns: int) -> int:
    """The ticks between two events of a rate; raises BadValue, naming the nearest valid rates, unless it is whole."""
    period = Fraction(NS_PER_S) / rate_hz / tick_ns
    if period.denominator == 1:
        return int(period)
    below, above = math.floor(period), math.ceil(period)
    rates = [repr(format_rate(Fraction(NS_PER_S, ticks * tick_ns))) for ticks in (above, below) if ticks >= 1]
    raise BadValue(f"not a whole number of ticks of {format_ns(tick_ns)}", format_rate(rate_hz), " and ".join(rates))


@dataclass(frozen=True, slots=True)
class Pace:
    """Pace of simulated time: unlimited, or `factor` times the wall clock."""

    kind: Literal["realtime", "fast"]
    factor: Fraction = Fraction(1)

    def __str__(self) -> str:
        if self.kind == "fast" or self.factor == 1:
            return self.kind
        return format_rate(self.factor).removesuffix(" Hz") + "x"


PACE_FACTOR_MIN: Final = Fraction(1, 1000)
PACE_FACTOR_MAX: Final = Fraction(1000)
_FACTOR = re.compile(rf"({_NUMBER}|{_RATIO})x")


def parse_pace(text: object) -> Pace:
    """`realtime`, `fast`, or a multiple of the wall clock such as `2x` and `0.5x`; raises BadValue."""
    if text == "fast":
        return Pace("fast")
    if text == "realtime":
        return Pace("realtime")
    match = _FACTOR.fullmatch(text) if isinstance(text, str) else None
    if match is None:
        close = nearest_name(text, ("realtime", "fast"))
        raise BadValue(
            "not a pace (realtime, fast or a factor such as 2x)", text, None if close is None else repr(close)
        )
    factor = Fraction(match[1])
    if not PACE_FACTOR_MIN <= factor <= PACE_FACTOR_MAX:
        raise BadValue(f"out of range {float(PACE_FACTOR_MIN)}x to {PACE_FACTOR_MAX}x", text)
    return Pace("realtime", factor)


@dataclass(frozen=True, slots=True)
class Quantity:
    """Annotation of a model's field: a string with a unit in the file, a number in the code, within bounds.

    The bounds are written as in a file, so that messages have the same texts.
    """

    dimension: Dimension
    low: str
    high: str

    def __post_init__(self) -> None:
        if parse(self.low, self.dimension) > parse(self.high, self.dimension):
            raise BadValue(f"a range with a lower bound above the upper bound {self.high}", self.low)

    def read(self, value: object) -> float | int | Fraction:
        """Return the number; raises pydantic's error for another quantity and for a value out of bounds."""
        return _number_of(self, value) if type(value) is str else self._number(value)

    def _number(self, value: object) -> float | int | Fraction:
        dimension = self.dimension
        try:
            exact = parse(value, dimension)
        except BadValue as bad:
            raise custom_error(bad) from None
        if not parse(self.low, dimension) <= exact <= parse(self.high, dimension):
            raise custom_error(BadValue(f"out of range {self.low} to {self.high}", value))
        if dimension.kind == "fraction":
            return exact
        if dimension.kind == "float":
            return float(exact)
        if exact.denominator != 1:
            raise custom_error(BadValue(f"not a whole number of {dimension.base}", value))
        return int(exact)

    def write(self, value: float | int | Fraction) -> str:
        """The text that reads back as exactly this value."""
        if isinstance(value, Fraction):
            return format_rate(value)
        if self.dimension is TIME:
            return format_ns(int(value))
        return f"{value!r} {self.dimension.base}"

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            self.read,
            serialization=core_schema.plain_serializer_function_ser_schema(self.write, when_used="json"),
        )

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        number = f"({_NUMBER}|{_RATIO})" if self.dimension.kind == "fraction" else f"({_NUMBER})"
        units = "|".join(re.escape(unit) for unit in self.dimension.units).replace(r"\ ", " ")
        return {
            "type": "string",
            "pattern": f"^{number} *({units})$".replace("(?:", "("),
            "description": f"{self.dimension.name}, {self.low} to {self.high}: {self.dimension.form}",
        }


@lru_cache(maxsize=NUMBERS_KEPT)
def _number_of(quantity: Quantity, text: str) -> float | int | Fraction:
    return quantity._number(text)


def custom_error(bad: BadValue) -> PydanticCustomError:
    """A BadValue in the form that pydantic collects; deployment/schema_errors.py reads it back."""
    context = {} if bad.nearest is None else {"nearest": bad.nearest}
    return PydanticCustomError("bad_value", "{what}", {"what": bad.problem, **context})


class _PaceText:
    """Annotation for a pace: text in the file, a `Pace` in the code."""

    @staticmethod
    def _read(value: object) -> Pace:
        try:
            return parse_pace(value)
        except BadValue as bad:
            raise custom_error(bad) from None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            self._read, serialization=core_schema.plain_serializer_function_ser_schema(str, when_used="json")
        )

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return {"type": "string", "pattern": f"^(realtime|fast|({_NUMBER}|{_RATIO})x)$".replace("(?:", "(")}


PaceField = Annotated[Pace, _PaceText()]
