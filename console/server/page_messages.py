"""Messages from a page to the console: JSON, validated, bounded.

Any other message ends the connection with a reason.
"""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

import msgspec
from msgspec import Meta

from foosim.common.errors import Malformed
from foosim.console.shown.source import Curve

MESSAGE_BYTES_MAX: Final = 64 * 1024
CURVES_MAX: Final = 64
"""What one page may plot in one source."""
HZ_MAX: Final = 200.0

Number = Annotated[int, Meta(ge=0, le=2**31)]
Text = Annotated[str, Meta(max_length=64)]
Place = Annotated[int, Meta(ge=0, le=255)]
"""Of a source in the list of sources."""


class _Message(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type"):
    """One message; its type is a word."""


class Hello(_Message, frozen=True, tag="hello"):
    """The first message: authentication."""

    token: Annotated[str, Meta(max_length=128)]


class PageRequest(_Message, frozen=True, tag="request"):
    """A verb for a source; the answer has the same id."""

    id: Number
    verb: Text
    source: Place = 0
    arguments: dict[str, Any] = {}


class Show(_Message, frozen=True, tag="show"):
    """The page's subscription to a source, with the greatest rate."""

    source: Place = 0
    overlays: Annotated[list[Literal["contacts", "rays"]], Meta(max_length=8)] = []
    hz: Annotated[float, Meta(ge=0, le=HZ_MAX)] = 50.0


class Watch(_Message, frozen=True, tag="watch"):
    """The link whose last drops are explained; null for none."""

    source: Place = 0
    link: tuple[Text, Text] | None = None


class Series(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One curve: exactly one of a field, a link and its figure, a status value, a reading."""

    id: Text
    field: Number | None = None
    link: tuple[Text, Text] | None = None
    figure: Literal["", "offered", "delivered", "dropped", "loss", "delay_ms", "queue_ms"] = ""
    status: Annotated[str, Meta(max_length=128)] = ""
    reading: tuple[Text, Text] | None = None
    index: Place = 0

    def curve(self) -> Curve:
        """Return it, or raise `Malformed`."""
        given = [self.field is not None, self.link is not None, bool(self.status), self.reading is not None]
        if sum(given) != 1 or (self.link is None) != (not self.figure):
            raise Malformed(f"series {self.id}: give exactly one of field, link with figure, status, reading")
        return Curve(self.id, self.field, self.link, self.figure, self.status, self.reading, self.index)


class Plot(_Message, frozen=True, tag="plot"):
    """All that the page plots of a source: numbers of the frame among it follow the poses, in this order."""

    source: Place = 0
    series: Annotated[list[Series], Meta(max_length=CURVES_MAX)] = []
    generation: Number | None = None
    """The generation of the fields' scene: fields of an older scene are ignored."""


Message = Hello | PageRequest | Show | Watch | Plot
_decoder: Final[msgspec.json.Decoder[Message]] = msgspec.json.Decoder(Message)


def read_message(payload: str | bytes) -> Message:
    """Return a page's message, or raise `Malformed`."""
    if isinstance(payload, bytes):
        raise Malformed("a binary message; a page sends JSON")
    try:
        return _decoder.decode(payload)
    except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
        raise Malformed(f"not a message of a page: {error}") from None
