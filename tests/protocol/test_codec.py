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
from foosim.protocol.messages import Commit, Hello, Order, Part, Want
from foosim.world.edits import Add, Edit, Push, Remove, Set

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
        return None if kind.includes_none else _least_value(kind.types[0])  # None where a field may be left out
    if isinstance(kind, inspect.IntType):
        return kind.ge
    if isinstance(kind, inspect.StrType):
        return "x" * (kind.min_length or 0)
    if isinstance(kind, inspect.BytesType):
        return bytes(kind.min_length or 0)
    if isinstance(kind, inspect.StructType):
        return _least(kind.cls)
    if isinstance(kind, inspect.TupleType):
        return tuple(map(_least_value, kind.item_types))
    return {inspect.FloatType: 0.0, inspect.BoolType: False, inspect.ListType: []}[type(kind)]


def lengths(kind: Any) -> Iterator[tuple[str, inspect.Type]]:
    """(field, type) of every text, bytes and list of a message."""
    for field in inspect.type_info(kind).fields:  # type: ignore[attr-defined]
        if isinstance(field.type, inspect.StrType | inspect.BytesType | inspect.ListType):
            yield field.name, field.type


def of_length(kind: Any, length: int) -> object:
    """A text, bytes or a list of so many items."""
    if isinstance(kind, inspect.ListType):
        return [_least_value(kind.item_type)] * length
    return "x" * length if isinstance(kind, inspect.StrType) else bytes(length)


def parts_of(kind: Any) -> set[Any]:
    """A type of message, and those of the items that it has."""
    fields = [field.type for field in inspect.type_info(kind).fields]  # type: ignore[attr-defined]
    items = [its.item_type for its in fields if isinstance(its, inspect.ListType)]
    inner = [one for item in items for one in getattr(item, "types", [item]) if isinstance(one, inspect.StructType)]
    return {kind}.union(*(parts_of(one.cls) for one in inner))


@pytest.mark.parametrize("kind", sorted({part for kind in kinds() for part in parts_of(kind)}, key=str))
def test_what_is_longer_or_shorter_than_its_limits_is_refused(kind: Any) -> None:
    message = _least(kind)
    for name, its in lengths(kind):
        assert its.max_length is not None, f"{kind.__name__}.{name} has no limit"  # type: ignore[attr-defined]
        least, most = its.min_length or 0, its.max_length  # type: ignore[attr-defined]
        for length, fits in ((least, True), (most, True), (least - 1, False), (most + 1, False)):
            if 0 <= length <= 1 << 20:
                payload = encode(msgspec.structs.replace(message, **{name: of_length(its, length)}))
                if fits:
                    assert decode_any(kind, payload) is not None
                else:
                    with pytest.raises(Malformed):
                        decode_any(kind, payload)


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
