"""The one encode and the one decode: every message there and back, and nothing but `Malformed` for what is none.

Messages are made from their own schema, so that a new one is tested without a line here. The `msgpack` library is the
second opinion: what we send is plain MessagePack, and what it packs we read.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from typing import Any, Final, get_args

import msgpack
import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import inspect

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.common.json_text import decode_json, encode_json
from foosim.protocol import codec
from foosim.protocol.channels import CHANNELS, Channel
from foosim.protocol.codec import decode, decode_any, encode
from foosim.protocol.messages import Commit, Deliveries, Done, End, Epoch, Hello, Order, Part, Request, Sent, Up, Want
from foosim.world.edits import Add, Edit, Push, Remove, Set
from foosim.world.robot_packets import Delivered

LONG: Final = 5
"""How long lists, texts and bytes of an example are at most; limits have tests of their own."""
TEXTS: Final = st.characters(codec="utf-8")


def strategy(kind: inspect.Type) -> st.SearchStrategy[Any]:
    """Values that fit one type of the schema."""
    makers: dict[type[inspect.Type], Callable[[Any], st.SearchStrategy[Any]]] = {
        inspect.IntType: lambda t: st.integers(t.ge or 0, t.le if t.le is not None else t.lt - 1),
        inspect.FloatType: lambda t: st.floats(allow_nan=False),
        inspect.BoolType: lambda t: st.booleans(),
        inspect.NoneType: lambda t: st.none(),
        inspect.StrType: lambda t: st.text(TEXTS, min_size=t.min_length or 0, max_size=min(t.max_length, LONG)),
        inspect.BytesType: lambda t: st.binary(min_size=t.min_length or 0, max_size=_longest(t)),
        inspect.ListType: lambda t: st.lists(strategy(t.item_type), max_size=LONG),
        inspect.TupleType: lambda t: st.tuples(*map(strategy, t.item_types)),
        inspect.UnionType: lambda t: st.one_of(*map(strategy, t.types)),
        inspect.StructType: lambda t: st.builds(t.cls, **{field.name: strategy(field.type) for field in t.fields}),
    }
    return makers[type(kind)](kind)


def _longest(kind: inspect.BytesType) -> int:
    assert kind.max_length is not None, "every bytes field has a limit"
    return max(kind.min_length or 0, min(kind.max_length, LONG))


def messages_of(channel: Channel) -> st.SearchStrategy[msgspec.Struct]:
    return strategy(inspect.type_info(channel.message))


def plain(value: object) -> object:
    """What a message is for a reader that knows arrays, texts, bytes and numbers only."""
    if isinstance(value, msgspec.Struct):
        tag = value.__struct_config__.tag
        head = [] if tag is None else [tag]
        return head + [plain(getattr(value, name)) for name in value.__struct_fields__]
    return [plain(item) for item in value] if isinstance(value, list | tuple) else value


def by_name(channel: Channel) -> str:
    return f"{channel.plane.name.lower()}-{channel.name}"


each_channel = pytest.mark.parametrize("channel", CHANNELS, ids=by_name)


@each_channel
@settings(max_examples=15)
@given(data=st.data())
def test_every_message_comes_back_and_is_plain_messagepack(channel: Channel, data: st.DataObject) -> None:
    message = data.draw(messages_of(channel))
    payload = encode(message)
    assert decode(channel.message, payload, channel.bytes_max) == message
    assert msgpack.unpackb(payload, use_list=True) == plain(message)
    assert decode_any(channel.message, msgpack.packb(plain(message))) == message


@each_channel
@settings(max_examples=10)
@given(data=st.data())
def test_what_is_cut_short_or_has_a_tail_is_refused(channel: Channel, data: st.DataObject) -> None:
    payload = encode(data.draw(messages_of(channel)))
    with pytest.raises(Malformed):
        decode(channel.message, payload[: data.draw(st.integers(0, len(payload) - 1))])
    for tail in (b"\x00", b"\xc0", payload):
        with pytest.raises(Malformed):
            decode(channel.message, payload + tail)


@each_channel
@settings(max_examples=30)
@given(data=st.data())
def test_whatever_comes_it_is_a_message_or_malformed(channel: Channel, data: st.DataObject) -> None:
    """Random bytes, and messages with bytes flipped, put in or taken out."""
    payload = bytearray(data.draw(st.one_of(st.binary(max_size=64), messages_of(channel).map(encode))))
    for _ in range(data.draw(st.integers(0, 3))):
        at = data.draw(st.integers(0, len(payload)))
        payload[at : at + data.draw(st.integers(0, 2))] = data.draw(st.binary(max_size=2))
    try:
        message = decode(channel.message, bytes(payload), channel.bytes_max)
    except Malformed as error:
        assert str(error)
    else:
        assert isinstance(message, channel.message)


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"\x91" * 100_000,  # nested deeper than any reader goes
        b"\xdd\xff\xff\xff\xff",  # an array of 2^32 items that are not there
        b"\xc6\xff\xff\xff\xff",
        b"\x92\xa6part.1\xc1",  # a byte that MessagePack never uses
        b"\x92\xa4\xff\xfe\xfd\xfc\x01",  # a text that is no UTF-8
        b"\x81\x90\x01",
        b"\xc7\x0c\xff" + b"\xff" * 12,  # a time that no calendar has
    ],
)
def test_bytes_that_break_careless_readers_are_malformed(payload: bytes) -> None:
    for channel in CHANNELS:
        with pytest.raises(Malformed):
            decode(channel.message, payload)


def test_another_version_is_named_with_both_versions() -> None:
    fields = plain(Want("n1", "part", 7, 1, []))
    assert isinstance(fields, list)
    for tag, other in (("want.1", "1"), ("want.99", "99"), ("part.17", "17")):
        with pytest.raises(Malformed, match=rf"protocol version {other}, this is {limits.PROTOCOL_VERSION}"):
            decode(Want, msgpack.packb([tag, *fields[1:]]))
    with pytest.raises(Malformed) as caught:
        decode(Want, msgpack.packb([f"wanted.{limits.PROTOCOL_VERSION}", *fields[1:]]))
    assert "protocol version" not in str(caught.value)


def test_hello_of_another_version_is_read_so_that_it_can_be_answered() -> None:
    hello = Hello("node", "n1", "boot", 99, "", bytes(32))
    assert decode(Hello, encode(hello)).version == 99
    assert "." not in str(Hello.__struct_config__.tag)


def test_a_message_is_at_most_as_long_as_its_channel_allows() -> None:
    part = Part(1, 2, "n1", bytes(32), [0], bytes(100), b"", [])
    payload = encode(part)
    assert decode(Part, payload, len(payload)) == part
    with pytest.raises(Malformed, match=f"{len(payload)} bytes, at most {len(payload) - 1}"):
        decode(Part, payload, len(payload) - 1)
    with pytest.raises(Malformed, match=f"at most {limits.MESSAGE_BYTES_MAX}"):
        decode(Part, bytes(limits.MESSAGE_BYTES_MAX + 1))


def counters(kind: Any) -> Iterator[tuple[str, int, int]]:
    """(field, least, greatest) of every whole number of a message."""
    for field in inspect.type_info(kind).fields:  # type: ignore[attr-defined]
        if isinstance(field.type, inspect.IntType):
            low, high = field.type.ge, field.type.le if field.type.le is not None else (field.type.lt or 0) - 1
            assert low is not None and high > 0, f"{kind.__name__}.{field.name} has no bounds"
            yield field.name, low, high


def kinds() -> list[Any]:
    """All types of message, of both planes."""
    return [kind for channel in CHANNELS for kind in get_args(channel.message) or (channel.message,)]


@pytest.mark.parametrize("kind", kinds(), ids=lambda kind: kind.__name__)
def test_counters_are_never_negative_and_fit_sixty_three_bits(kind: Any) -> None:
    message = _least(kind)
    for name, low, high in counters(kind):
        for value in (low, high):
            changed = msgspec.structs.replace(message, **{name: value})
            assert decode(kind, encode(changed)) == changed
        for value in (low - 1, high + 1, 2**64 - 1, -(2**63)):
            changed = msgspec.structs.replace(message, **{name: value})
            with pytest.raises(Malformed):
                decode(kind, encode(changed))


def _least(kind: Any) -> Any:
    """A message with the least value in every field."""
    return kind(*(_least_value(field.type) for field in inspect.type_info(kind).fields))  # type: ignore[attr-defined]


def _least_value(kind: inspect.Type) -> object:
    if isinstance(kind, inspect.UnionType):
        return None  # where a field may be left out
    if isinstance(kind, inspect.IntType):
        return kind.ge
    if isinstance(kind, inspect.StrType):
        return "x" * (kind.min_length or 0)
    if isinstance(kind, inspect.BytesType):
        return bytes(kind.min_length or 0)
    return {inspect.FloatType: 0.0, inspect.BoolType: False, inspect.ListType: []}[type(kind)]


def delivered(payload: bytes) -> Delivered:
    return Delivered(0, "s", 1, 0, "d", "c", payload)


def sent(payload: bytes) -> Sent:
    return Sent(1, "d", "c", 0, payload)


LONGEST = limits.NAME_LENGTH_MAX
OVERSIZED: Final[dict[str, tuple[Any, Any, Any]]] = {
    "a name": (Want, Want("n" * LONGEST, "k", 0, 0, []), Want("n" * (LONGEST + 1), "k", 0, 0, [])),
    "an empty name": (Want, Want("n", "k", 0, 0, []), Want("", "k", 0, 0, [])),
    "a digest": (Part, Part(1, 1, "n", bytes(32), [], b"", b"", []), Part(1, 1, "n", bytes(33), [], b"", b"", [])),
    "a payload": (
        Deliveries,
        Deliveries(0, [delivered(bytes(limits.PAYLOAD_BYTES_MAX))]),
        Deliveries(0, [delivered(bytes(limits.PAYLOAD_BYTES_MAX + 1))]),
    ),
    "packets": (
        Up,
        Up("c", "b", [sent(b"")] * limits.PACKETS_PER_MESSAGE_MAX),
        Up("c", "b", [sent(b"")] * (limits.PACKETS_PER_MESSAGE_MAX + 1)),
    ),
    "packets of a Done": (Done, Done("c", "b", 0, []), Done("c", "b", 0, [sent(b"")] * 65_537)),
    "solved": (
        Part,
        Part(1, 1, "n", bytes(32), list(range(limits.ENTITIES_MAX)), b"", b"", []),
        Part(1, 1, "n", bytes(32), list(range(limits.ENTITIES_MAX + 1)), b"", b"", []),
    ),
    "edits": (
        Order,
        Order(1, 0, [Remove("b")] * limits.ENTITIES_MAX),
        Order(1, 0, [Remove("b")] * (limits.ENTITIES_MAX + 1)),
    ),
    "owners": (
        Epoch,
        Epoch(1, 0, bytes(32), ["n"], [("r", "n")] * limits.ENTITIES_MAX, b""),
        Epoch(1, 0, bytes(32), ["n"], [("r", "n")] * (limits.ENTITIES_MAX + 1), b""),
    ),
    "arithmetic": (
        Epoch,
        Epoch(1, 0, bytes(32), ["n"], [], bytes(32)),
        Epoch(1, 0, bytes(32), ["n"], [], bytes(33)),
    ),
    "a text": (
        End,
        End(1, "r" * limits.TEXT_LENGTH_MAX, False),
        End(1, "r" * (limits.TEXT_LENGTH_MAX + 1), False),
    ),
    "arguments": (
        Request,
        Request("o", "1", "v", bytes(limits.TEXT_LENGTH_MAX)),
        Request("o", "1", "v", bytes(limits.TEXT_LENGTH_MAX + 1)),
    ),
}


@pytest.mark.parametrize("what", OVERSIZED)
def test_what_is_longer_than_its_limit_is_refused(what: str) -> None:
    kind, fits, too_long = OVERSIZED[what]
    assert decode(kind, encode(fits)) == fits
    with pytest.raises(Malformed):
        decode(kind, encode(too_long))


def test_unknown_and_missing_fields_are_refused() -> None:
    fields = plain(Want("n1", "part", 7, 1, []))
    assert isinstance(fields, list)
    for wrong in ([*fields, 0], fields[:-1], fields[1:], dict(enumerate(fields)), [*fields[:3], "7", *fields[4:]]):
        with pytest.raises(Malformed):
            decode(Want, msgpack.packb(wrong))


@settings(max_examples=50)
@given(numbers=st.lists(st.floats(width=64), max_size=20))
def test_number_arrays_are_raw_little_endian_floats(numbers: list[float]) -> None:
    raw = struct.pack(f"<{len(numbers)}d", *numbers)
    commit = Commit(1, 1, bytes(32), raw, [], [], False)
    assert raw in encode(commit)
    assert decode(Commit, encode(commit)).values == raw


def test_edits_are_told_apart_by_their_tags() -> None:
    edits: list[Edit] = [
        Add("b", [0.0, 0.1, 1.0, -0.0]),
        Push("ball", (0.0, 1e-300, 0.0)),
        Set("red.goal", "down", [1.0]),
        Remove("b"),
    ]
    order = decode(Order, encode(Order(1, 2, edits)))
    assert order.edits == edits
    assert str(order.edits[0].numbers[3]) == "-0.0"  # type: ignore[union-attr]


@settings(max_examples=100)
@given(content=st.recursive(st.none() | st.booleans() | st.integers(-(2**60), 2**60) | st.text(TEXTS), st.lists))
def test_json_comes_back(content: object) -> None:
    assert decode_json(encode_json(content)) == content


@settings(max_examples=200)
@given(payload=st.one_of(st.binary(max_size=40), st.text('[]{}",:0123456789.eE+-ntfu\\ ', max_size=40).map(str.encode)))
def test_bytes_that_are_no_json_are_malformed(payload: bytes) -> None:
    try:
        decode_json(payload)
    except Malformed as error:
        assert str(error)


@pytest.mark.parametrize("payload", [b"", b"[" * 100_000, b"1e400", b"1" * 5000, b"NaN", b'"\\ud800"', b"{} {}"])
def test_json_that_breaks_careless_readers_is_malformed(payload: bytes) -> None:
    with pytest.raises(Malformed):
        decode_json(payload)


def test_decoders_are_made_one_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two threads that make them at once crash the interpreter, now and then: so who makes one has to hold the lock."""
    made: list[Any] = []

    def make(kind: Any) -> Any:
        assert codec._making.locked()
        made.append(kind)
        return plain(kind)

    plain: Any = msgspec.msgpack.Decoder
    monkeypatch.setattr(msgspec.msgpack, "Decoder", make)
    kind = dict[str, tuple[int, str]]
    assert [decode_any(kind, msgpack.packb({"a": [1, "b"]})) for _ in range(2)] == [{"a": (1, "b")}] * 2
    assert made == [kind] and not codec._making.locked()
