"""The gateway `tclserv`: requests of Pocolibs in lines of text, as MORSE serves them on the protocol of TCLserv.

A program sends `HELLO`, and then `RQST ::ROBOT.COMPONENT::SERVICE PARAMETERS`. That is answered by `OK NUMBER` or
`ERROR`, and a request that was taken ends with the event `NUMBER ::ROBOT.COMPONENT::SERVICE TERM OK RESULT`. Posters,
which are shared memory, are absent; `get_local_data` reads a sensor.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import chain, count
from typing import Any, Final, TypeVar

from foosim.common.addresses import Address, parse_address
from foosim.common.errors import Refused
from foosim.deployment.hosts import Listen
from foosim.gateways.lines import Connection, LineServer
from foosim.gateways.rows import MANAGER, Component, services_of
from foosim.gateways.run import Called
from foosim.world.component_types.jobs import JobState
from foosim.world.component_types.registry import gateway
from foosim.world.component_types.settings import GatewaySettings

NOTHING_TO_DO: Final = ("LM", "UNLM", "KILL", "ACK", "exec", "cs::init", "modules::connect")
"""Commands that manage modules, which a simulator does not have."""
INTERRUPTED: Final = "stdGenoM_ACTIVITY_INTERRUPTED"
SEVERAL: Final = (Mapping, list, tuple)
T = TypeVar("T")


class TclservSettings(GatewaySettings):
    """Requests at `listen`."""

    listen: Listen = "127.0.0.1:9473"


@gateway("tclserv", TclservSettings)
class Tclserv(LineServer):
    """Services of components as requests of Pocolibs."""

    clients: dict[str, Client]
    running: dict[str, Called]
    port = 0

    def draws(self, component: Component) -> bool:
        return False

    async def open(self) -> str:
        """Listen. Raises Refused where the port is not free."""
        self.clients, self.running, self.numbers, self.requests = {}, {}, count(), count()
        address = parse_address(self.settings.listen)
        self.port = await self.listen(address.host, range(address.port, address.port + 1), partial(Client, self))
        return f"requests at {Address(address.host, self.port)}"


class Client(Connection[Tclserv]):
    """A program that sends requests. Jobs continue when it leaves."""

    what = "requests"

    def __init__(self, gateway: Tclserv) -> None:
        super().__init__(gateway)
        self._number = ""
        self._events: Client = self
        """The program that gets the events of this one's requests."""

    def connection_lost(self, error: Exception | None) -> None:
        super().connection_lost(error)
        self._gateway.clients.pop(self._number, None)

    def received(self, lines: list[bytes]) -> None:
        for line in lines:
            words = line.decode(errors="replace").split()
            if words and not self.transport.is_closing():
                self._take(*words)

    def _take(self, command: str, *words: str) -> None:
        if not self._number and command == "HELLO":
            self._number = str(next(self._gateway.numbers))
            self._gateway.clients[self._number] = self
            self._write(f"HELLO {self._number}")
        elif command == "BYE":
            self.transport.close()
        elif not self._number:
            self._gateway.log.warning("%s begins with %r, not with HELLO: it is closed", self.peer, command[:80])
            self.transport.close()
        else:
            try:
                self._request(*words) if command == "RQST" else self._write(f"OK {self._answer(command, words)}")
            except Refused as refused:
                self._write(f"ERROR {refused}")

    def _answer(self, command: str, words: Sequence[str]) -> str:
        server = self._gateway
        if command == "REPLYTO":
            self._events = _found(server.clients, words, "client")
            return words[0]
        if command == "ABORT":
            server.run.cancel(_found(server.running, words, "running request"))
            return ""
        if command == "cs::lsmbox":
            return " ".join(server.run.components)
        if command == "info" and words[:1] == ("commands",):
            name = "".join(words[1:]).partition("::")[0]
            component = _found(server.run.components, [name], "component")
            return " ".join(f"::{name}::{service}Send" for service in services_of(component.row))
        if command in NOTHING_TO_DO:
            return ""
        posters = " Posters are absent: request get_local_data" if "poster" in command.lower() else ""
        raise Refused(f"0 command {command[:80]} not implemented!{posters}")

    def _request(self, target: str = "", *words: str) -> None:
        """Call a service; a refused request has a number, too. Its events come after the answer."""
        name, _, service = target.strip(":").rpartition("::")
        component, number = self._gateway.run.components.get(name), str(next(self._gateway.requests))
        if component is None or service not in services_of(component.row):
            raise Refused(f'1 invalid command name \\"{service[:80]}Send\\"')
        event = f"{number} ::{name}::{service}"

        def ended(called: Called) -> None:
            self._gateway.running.pop(number, None)
            self._notify(f"{event} TERM {_outcome(name, called)}")

        end = ""
        try:
            result = self._gateway.run.call(component, service, [*map(_parameter, words)], ended)
        except Refused as refused:
            text = str(refused)
            if text.startswith(MANAGER):
                raise Refused(f"1 wrong {'type in' if 'wrong parameter type' in text else '#'} args") from None
            end = _failure(name, text)
        else:
            if isinstance(result, Called):
                self._gateway.running[number] = result
            else:
                end = _result(result)
        self._write(f"OK {number}")
        self._notify(f"{event} TERM {end}" if end else f"{event} ACK 0")

    def _notify(self, event: str) -> None:
        """Write to the program that gets the events."""
        (self if self._events.transport.is_closing() else self._events)._write(event)

    def _write(self, text: str) -> None:
        self.answer(f"{text}\r\n".encode())


def _found(table: Mapping[str, T], words: Sequence[str], what: str) -> T:
    """Return what the first word names. Raises Refused."""
    name = words[0] if words else ""
    if name not in table:
        raise Refused(f"1 no {what} {name[:80]}")
    return table[name]


def _parameter(word: str) -> Any:
    """Return the value of a word: that of JSON, else the word itself."""
    try:
        return json.loads(word)
    except (ValueError, RecursionError):
        return word


def _outcome(component: str, called: Called) -> str:
    state = called.job.state
    if state == JobState.DONE:
        return _result(called.answer)
    return _failure(component, called.job.why or "UNKNOWN_ERROR" if state == JobState.FAILED else INTERRUPTED)


def _failure(component: str, why: str) -> str:
    return f"S_{component}_{'_'.join(why.split())}"


def _result(value: Any) -> str:
    """Return a result as MORSE writes it, without what is false; of a mapping also the keys."""
    words = _words(value) if isinstance(value, SEVERAL) else [_word(value)]
    return f"OK {'  '.join(words)}" if value else "OK"


def _words(value: Any) -> list[str]:
    return [_word(one) for one in (chain.from_iterable(value.items()) if isinstance(value, Mapping) else value)]


def _word(value: Any) -> str:
    """Return a value as a word of Tcl: lists, mappings and texts with blanks in braces."""
    text = " ".join(_words(value)) if isinstance(value, SEVERAL) else str(value)
    is_plain = not isinstance(value, SEVERAL) and text.split() == [text]
    return text if is_plain else f"{{{text}}}"
