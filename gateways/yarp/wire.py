"""YARP's wire: bottles as bytes and as text, messages, images. Pure; `ports` has the connections.

A bottle is a list. Its items are int (32 bits, 64 where it needs them), float (64 bits), str, `Vocab`, bytes, and lists
of these; None is the vocab `null`. Integers are little-endian. Measured against YARP 3.5.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Sequence
from typing import Any, Final

from foosim.common.errors import Malformed, show
from foosim.common.limits import YARP_DEPTH_MAX

INT32, STRING, VOCAB, FLOAT64, BLOB, INT64, LIST, DICT = 1, 4, 9, 10, 12, 17, 256, 512
NUMBERS: Final = {INT32: "i", FLOAT64: "d", INT64: "q", 32: "b", 64: "h", 128: "f"}
"""How `struct` calls numbers: senders also have integers of 8 and 16 bits and floats of 32."""
_TOKEN: Final = re.compile(
    r'(?P<open>\()|(?P<close>\))|"(?P<string>(?:[^"\\]|\\.)*)"|\{(?P<blob>[\d\s]*)\}|\[(?P<vocab>[^\]]{0,4})\]'
    r'|(?P<word>[^\s,()"{}\[\]]+)|(?P<wrong>[^\s,])'
)
_INTEGER: Final = re.compile(r"[+-]?\d{1,18}|0[xX][0-9a-fA-F]{1,8}")
_PLAIN: Final = re.compile(r"[A-Za-z_][A-Za-z_0-9.-]*")
_ESCAPES: Final = {"\n": "n", "\r": "r", "\0": "0", "\\": "\\", '"': '"'}
_LETTERS: Final = {letter: char for char, letter in _ESCAPES.items()}
_WORDS: Final = {"true": "1", "false": "", "null": "null"}


class Vocab(str):
    """A word of at most four bytes, sent as an integer. The empty one is `false`, "1" is `true`."""

    __slots__ = ()


def _item(value: Any) -> tuple[int, bytes]:
    """Return the tag and the bytes after it."""
    if isinstance(value, float):
        return FLOAT64, struct.pack("<d", value)
    if isinstance(value, int):
        tag = INT32 if -(2**31) <= value < 2**31 else INT64
        return tag, struct.pack("<" + NUMBERS[tag], value)
    if value is None or isinstance(value, Vocab):
        return VOCAB, struct.pack("4s", b"null" if value is None else value.encode())
    if isinstance(value, str | bytes):
        raw = value.encode() if isinstance(value, str) else value
        return STRING if isinstance(value, str) else BLOB, struct.pack("<i", len(raw)) + raw
    items = [_item(item) for item in value]
    tags = {tag for tag, _ in items}
    common = tags.pop() if len(tags) == 1 else LIST
    if common & LIST:
        return LIST, struct.pack("<i", len(items)) + b"".join(struct.pack("<i", tag) + raw for tag, raw in items)
    return LIST | common, struct.pack("<i", len(items)) + b"".join(raw for _, raw in items)  # of one type, without tags


def encode(values: Sequence[Any]) -> bytes:
    """Return the bytes of a bottle."""
    tag, raw = _item(values)
    return struct.pack("<i", tag) + raw


def decode(data: bytes) -> list[Any]:
    """Return the items of a bottle; raises Malformed."""
    try:
        (tag,) = struct.unpack_from("<i", data)
        values, at = _value(data, 4, tag, 0)
    except (struct.error, UnicodeDecodeError) as error:
        raise Malformed(f"a bottle of {len(data)} bytes: {error}") from None
    if not isinstance(values, list) or at != len(data):
        raise Malformed(f"a bottle that starts with tag {tag} and has {len(data) - at} bytes after its last item")
    return values


def _value(data: bytes, at: int, tag: int, depth: int) -> tuple[Any, int]:
    """Return the item at an offset, and the offset after it."""
    if code := NUMBERS.get(tag):
        return struct.unpack_from("<" + code, data, at)[0], at + struct.calcsize(code)
    if tag == VOCAB:
        return Vocab(struct.unpack_from("4s", data, at)[0].rstrip(b"\0").decode()), at + 4
    if tag not in (STRING, BLOB) and not (0 < tag < 2 * DICT and tag & LIST):
        raise Malformed(f"no item of a bottle has the tag {tag}")
    (count,), at = struct.unpack_from("<i", data, at), at + 4
    if not 0 <= count <= len(data) - at or depth > YARP_DEPTH_MAX:
        raise Malformed(f"an item of size {count} with {len(data) - at} bytes left, in {depth} lists")
    if tag in (STRING, BLOB):
        raw = bytes(data[at : at + count])
        return raw if tag == BLOB else raw.rstrip(b"\0").decode(), at + count
    common = tag & ~(LIST | DICT)
    if code := NUMBERS.get(common):
        return list(struct.unpack_from(f"<{count}{code}", data, at)), at + count * struct.calcsize(code)
    values = []
    for _ in range(count):
        if not common:
            (tag,), at = struct.unpack_from("<i", data, at), at + 4
        value, at = _value(data, at, common or tag, depth + 1)
        values.append(value)
    return values, at


def to_text(value: Any) -> str:
    """Return a bottle as the text carriers have it, or one item."""
    if isinstance(value, list | tuple):
        return " ".join(f"({to_text(item)})" if isinstance(item, list | tuple) else to_text(item) for item in value)
    if value is None or isinstance(value, Vocab):
        return {"1": "true", "": "false", None: "[null]"}.get(value, f"[{value}]")
    if isinstance(value, bytes):
        return "{" + " ".join(map(str, value)) + "}"
    if not isinstance(value, str):
        return repr(value + 0)  # a truth value as a number
    if _PLAIN.fullmatch(value) and value not in _WORDS:
        return value
    return '"' + "".join("\\" + _ESCAPES[char] if char in _ESCAPES else char for char in value) + '"'


def from_text(line: str) -> list[Any]:
    """Return the items of a bottle in a line of text; raises Malformed."""
    lists: list[list[Any]] = [[]]
    for found in _TOKEN.finditer(line):
        kind, text = found.lastgroup or "", found[found.lastgroup or 0]
        if kind == "open" and len(lists) <= YARP_DEPTH_MAX:
            lists.append([])
        elif kind == "close" and len(lists) > 1:
            inner = lists.pop()
            lists[-1].append(inner)
        elif kind == "string":
            lists[-1].append(re.sub(r"\\(.)", lambda escape: _LETTERS.get(escape[1], escape[1]), text))
        elif kind == "blob" and all(len(byte) < 4 and int(byte) < 256 for byte in text.split()):
            lists[-1].append(bytes(map(int, text.split())))
        elif kind == "vocab" or text in _WORDS:
            lists[-1].append(Vocab(_WORDS.get(text, text)))
        elif kind == "word":
            lists[-1].append(_word(text))
        else:
            raise Malformed(f"not the text of a bottle from column {found.start() + 1}, {show(line[found.start() :])}")
    if len(lists) > 1:
        raise Malformed(f"a bottle with '(' and without ')', {show(line)}")
    return lists[0]


def _word(text: str) -> int | float | str:
    try:
        return int(text, 16 if "x" in text.lower() else 10) if _INTEGER.fullmatch(text) else float(text)
    except ValueError:
        return text


def image(width: int, height: int, rgba: bytes) -> list[Any]:
    """Return an ImageRgba: rows from the top, four bytes a pixel."""
    quantum = 8 if width % 2 == 0 else 4  # the length of a row is a multiple of it
    return [Vocab("mat"), Vocab("rgba"), [4, len(rgba), quantum, width, height], rgba]


def magic(number: int) -> bytes:
    """Return the eight bytes that carry a number between bottles."""
    return struct.pack("<2si2s", b"YA", number, b"RP")


def message(command: str, values: Sequence[Any] | None = None, text: bool = False) -> bytes:
    """Return a message: `D` data, `d` data to be answered, `a` administration, `q` the end of the connection."""
    if text:
        return f"{command}\r\n".encode() + (b"" if values is None else f"{to_text(values)}\r\n".encode())
    word = b"q\0" if command == "q" else b""
    blocks = [struct.pack("<i4s", len(word), b"~" + (b"\0" if word else command.encode()) + b"\0\1") + word]
    if values is not None:
        blocks.append(encode(values))
    sizes = struct.pack(f"<B9s{len(blocks) + 1}i", len(blocks), b"\1" + b"\xff" * 8, *map(len, blocks), 0)
    return b"".join((magic(10), sizes, *blocks))
