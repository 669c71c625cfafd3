"""The console's board: the last messages of each source, the subscriptions of browsers, and their distribution.

A browser that joins gets the sources, their scenes, the last moment and the last of each message, so that it draws
at once. Pure: time is given by `clock`, bytes leave through each reader's outbox.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Final

from foosim.common.errors import Malformed
from foosim.common.json_text import encode_json
from foosim.console.server.page_messages import Plot, Show, Watch
from foosim.console.server.reader import Follows, Reader, Shown, TooSlow
from foosim.console.shown.curves import points_of
from foosim.console.shown.source import About, Curve, Link, Moment, Source, Wanted

MARKS_MAX: Final = 4096
"""The last marks of one source."""
WATCHED_MAX: Final = 64
"""Links, and readings, that all browsers together have looked at."""
KEPT: Final = frozenset({"status", "links", "compared", "overlay", "presence", "jobs"})
"""Types of messages of which the last one is kept for new browsers, and only the newest waits."""
PLOTTED: Final = frozenset({"status", "links", "readings"})


@dataclass
class SourceFeed:
    """The last messages of one source, and its feed (`source.Feed`): all that comes goes to the board's readers."""

    board: Board
    number: int
    about: About
    generation: int = 0
    described: Mapping[str, Any] = field(default_factory=dict)
    """The scene as its source has it."""
    scene: bytes = b""
    links: int = 0
    numbers: int = 0
    shown: Shown | None = None
    kept: dict[str, bytes] = field(default_factory=dict)
    warning: bytes = b""
    presence: Mapping[str, Any] = field(default_factory=dict)
    """Its last reported presence."""
    watched: dict[Link, bytes] = field(default_factory=dict)
    """The last message about each watched link."""
    marks: list[Mapping[str, Any]] = field(default_factory=list)

    def describe(self, about: About, scene: Mapping[str, Any]) -> None:
        changed, self.about = about != self.about, about
        if changed:
            for reader in self.board.readers.values():
                reader.put_first("sources", self.board.welcome(reader, "sources"))
        if scene == self.described:
            return
        self.generation += 1
        self.described, self.shown = scene, None
        self.links = len(scene["links"])
        self.numbers = max((run["index"] + run["count"] for run in scene["fields"]), default=0)
        self.scene = encode_json({"type": "scene", "source": self.number, "generation": self.generation, **scene})
        self.kept.pop("overlay", None)
        for reader in self.board.readers.values():
            reader.put_first(("scene", self.number), self.scene)
            reader.follows[self.number].fields = ()  # they were places in another world

    def show(self, moment: Moment) -> None:
        assert len(moment.poses) == self.links, f"{len(moment.poses)} poses of a scene of {self.links} links"
        self.shown = Shown(self.number, self.generation, moment)
        now_s = self.board.clock()
        for reader in self.board.readers.values():
            reader.show(self.shown, now_s)

    def publish(self, message: Mapping[str, Any]) -> None:
        kind = message["type"]
        whole = {"source": self.number, **message}
        if kind == "overlay":
            whole["generation"] = self.generation
        if kind == "marks":
            self.marks += message["marks"]
            del self.marks[:-MARKS_MAX]
        text = b"" if kind == "readings" else encode_json(whole)
        if kind in KEPT:
            self.kept[kind] = text
        if kind == "watched":
            self.watched[message["link"][0], message["link"][1]] = text
        if kind == "presence":
            self.presence = message
            self.warning = b""  # the warning was about this load
        if kind == "note":
            self.warning = b"" if message["level"] == "info" else text
        for reader in list(self.board.readers.values()):
            try:
                self._send(reader, kind, whole, text)
            except TooSlow as slow:
                self.board.cut_off(reader, str(slow))

    def _send(self, reader: Reader, kind: str, message: Mapping[str, Any], text: bytes) -> None:
        """Send a reader a message, if it has subscribed, and the new points of its curves. Raises TooSlow."""
        follows = reader.follows[self.number]
        if kind == "watched":
            if follows.link == tuple(message["link"]):
                reader.put_newest((kind, self.number), text)
        elif kind == "overlay":
            if follows.overlays:
                reader.put_newest((kind, self.number), text)
        elif kind in KEPT:
            reader.put_newest((kind, self.number), text)
        elif kind != "readings":
            reader.put(text)
        if kind in PLOTTED and follows.curves:
            series = points_of(follows.curves, message)
            if series:
                reader.put(encode_json({"type": "plotted", "source": self.number, "series": series}))


class Board:
    """Distributes messages of sources to readers; all of it in one thread."""

    def __init__(
        self,
        sources: Sequence[Source],
        version: str,
        clock: Callable[[], float],
        cut_off: Callable[[Reader, str], None] = lambda reader, why: None,
    ) -> None:
        """`clock` gives seconds; `cut_off` ends the connection of a reader."""
        self.sources = sources
        self.readers: dict[str, Reader] = {}
        """By name."""
        self.clock, self.cut_off = clock, cut_off
        self._version = version
        self.feeds = [SourceFeed(self, number, source.about) for number, source in enumerate(sources)]
        self._wanted = [Wanted() for _ in sources]

    # --- browsers ----------------------------------------------------------------------------------------------------

    def join(self, reader: Reader) -> None:
        """Serve one more browser: all that it needs to draw waits for it."""
        self.readers[reader.name] = reader
        reader.follows = {source: Follows() for source in range(len(self.sources))}
        reader.put_first("sources", self.welcome(reader, "welcome"))
        for source, state in enumerate(self.feeds):
            if state.scene:
                reader.put_first(("scene", source), state.scene)
            if state.shown is not None:
                reader.show(state.shown, self.clock())
            for kind, message in state.kept.items():
                reader.put_newest((kind, source), message)
            if state.marks:
                reader.put(encode_json({"type": "marks", "source": source, "marks": state.marks}))
            if state.warning:
                reader.put(state.warning)
        self._look()

    def leave(self, reader: Reader) -> None:
        """Forget a browser."""
        if self.readers.pop(reader.name, None) is not None:
            self._look()

    def follow(self, reader: Reader, message: Show | Watch | Plot) -> tuple[Curve, ...]:
        """Set a page's subscription to a source; return the curves that it did not plot before. Raises Malformed."""
        follows = reader.follows[self.checked(message.source)]
        new: tuple[Curve, ...] = ()
        if isinstance(message, Show):
            follows.hz, follows.overlays = message.hz, frozenset(message.overlays)
        elif isinstance(message, Watch):
            follows.link = message.link
            known = None if message.link is None else self.feeds[message.source].watched.get(message.link)
            if known is not None:
                reader.put_newest(("watched", message.source), known)
        else:
            curves = tuple(series.curve() for series in message.series)
            new = tuple(curve for curve in curves if curve not in follows.curves)
            follows.curves = curves
            follows.fields = self._fields(message, curves)
        shown = self.feeds[message.source].shown
        if shown is not None:  # a paused world shows no other one
            follows.next_s = 0.0
            reader.show(shown, self.clock())
        self._look()
        return new

    def _fields(self, message: Plot, curves: Iterable[Curve]) -> tuple[int, ...]:
        """Return the numbers of the frame among curves. Raises Malformed for one that the frame does not have."""
        state = self.feeds[message.source]
        if not state.scene or message.generation not in (None, state.generation):
            return ()
        fields = tuple(curve.field for curve in curves if curve.field is not None)
        wrong = [place for place in fields if place >= state.numbers]
        if wrong:
            raise Malformed(f"series of field {wrong[0]}: the frame has {state.numbers} numbers")
        return fields

    def checked(self, source: int) -> int:
        """Return the number of a source, or raise `Malformed`."""
        if source >= len(self.sources):
            raise Malformed(f"no source {source}: valid are 0 to {len(self.sources) - 1}")
        return source

    def welcome(self, reader: Reader, kind: str) -> bytes:
        sources = [
            {
                "id": source,
                **asdict(state.about),
                "verbs": state.about.verbs if reader.role == "operator" else (),
                "span": None
                if state.about.span is None
                else dict(zip(("first", "last"), state.about.span, strict=True)),
            }
            for source, state in enumerate(self.feeds)
        ]
        return encode_json(
            {"type": kind, "role": reader.role, "name": reader.name, "sources": sources, "version": self._version}
        )

    def _look(self) -> None:
        """Send each source the union of the browsers' subscriptions, if it has changed."""
        for number, source in enumerate(self.sources):
            all_follow = [reader.follows[number] for reader in self.readers.values()]
            links = sorted({follows.link for follows in all_follow if follows.link is not None})
            curves = [curve for follows in all_follow for curve in follows.curves]
            readings = sorted({curve.reading for curve in curves if curve.reading is not None})
            wanted = Wanted(
                len(self.readers),
                max((follows.hz for follows in all_follow), default=0.0),
                frozenset().union(*(follows.overlays for follows in all_follow)),
                tuple(links[:WATCHED_MAX]),
                tuple(readings[:WATCHED_MAX]),
            )
            watched = self.feeds[number].watched
            for link in [known for known in watched if known not in wanted.links]:
                del watched[link]
            if wanted != self._wanted[number]:
                self._wanted[number] = wanted
                source.want(wanted)

    def has_ended(self) -> str:
        """Return how the first source has ended; empty while it runs."""
        presence = self.feeds[0].presence
        return str(presence["text"]) if presence.get("state") == "ended" else ""
