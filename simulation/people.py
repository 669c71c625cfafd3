"""Operators and viewers of a rehearsal: requests to the supervisor, sent once or repeated until answered."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from foosim.common.json_text import encode_json
from foosim.protocol import channels
from foosim.protocol.channels import Channel
from foosim.protocol.codec import decode, encode
from foosim.protocol.messages import Answer, Inquiry, Request
from foosim.runtime.roles.bus import Bus

OPERATOR: Final = "operator"


class People:
    """The requests of a run. `later(after_ns, action)` schedules a repetition."""

    def __init__(self, bus: Bus, later: Callable[[int, Callable[[], object]], None]) -> None:
        self.answers: dict[str, Answer] = {}
        self.verbs: dict[str, str] = {}
        """The verb of each request that was not given up, by id."""
        self._bus = bus
        self._later = later
        self._requests = 0
        self.viewed: list[bytes] = []
        """The views received, in order of arrival."""
        bus.subscribe(OPERATOR, (*channels.OPERATOR_READS, *channels.VIEW_READS))

    def request(
        self, verb: str, again_ns: int, arguments: dict[str, Any], who: str = OPERATOR, *, only_looks: bool = False
    ) -> str:
        """Send a request, every `again_ns` until it is answered (0: once); return the request's id.

        With `only_looks` it is sent as a viewer's.
        """
        self._requests += 1
        identity = f"request-{self._requests}"
        self.verbs[identity] = verb
        kind, channel = (Inquiry, channels.INQUIRY) if only_looks else (Request, channels.REQUEST)
        self._bus.subscribe(who, channels.OPERATOR_READS)
        self._send(identity, channel, who, encode(kind(who, identity, verb, encode_json(arguments))), again_ns)
        return identity

    def give_up(self, verb: str) -> None:
        """Stop repeating unanswered requests."""
        for identity in [known for known, what in self.verbs.items() if what == verb and known not in self.answers]:
            self.verbs.pop(identity)

    def hear(self, channel: Channel, payload: bytes) -> None:
        """Handle an answer or a view."""
        if channel is channels.VIEW:
            self.viewed.append(payload)
        elif channel is channels.ANSWER:
            answer = decode(Answer, payload)
            self.answers[answer.id] = answer

    def _send(self, identity: str, channel: Channel, who: str, payload: bytes, again_ns: int) -> None:
        if identity in self.answers or identity not in self.verbs:
            return
        self._bus.put(who, channel, who, payload, self._bus.now_ns)
        if again_ns:
            self._later(again_ns, lambda: self._send(identity, channel, who, payload, again_ns))
