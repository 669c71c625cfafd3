"""Requests to a running system from another process: by id, repeated until they are answered.

An answer names the tick at which the request takes effect; a refusal raises `RequestRefused`.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, Literal

from foosim.client.requests import Take, Taken, answer_to, exchange
from foosim.common.closable import Closable
from foosim.common.errors import Failed, Refused
from foosim.common.json_text import decode_json, encode_json
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.asset_transfer import Fetching
from foosim.protocol.channels import Channel, Plane
from foosim.protocol.codec import encode
from foosim.protocol.messages import Answer, Fetch, Inquiry, Request
from foosim.runtime.command import PKI_VARIABLE
from foosim.runtime.roles.wire import Wire
from foosim.runtime.run_folder import RunInfo, find_run
from foosim.runtime.transport.certificates import Credentials, operator_credentials, viewer_credentials
from foosim.runtime.transport.inbox import Inbox
from foosim.runtime.transport.session import Session
from foosim.runtime.transport.settings import Security

ANSWER_S: Final = 30.0
"""How long an answer is waited for: adding waits until every node has built an engine."""
CONNECT_S: Final = 10.0
WAITING_MAX: Final = 256
Role = Literal["operator", "viewer"]
_REQUEST_OF: Final[dict[str, tuple[type[Request], Channel]]] = {
    "operator": (Request, channels.REQUEST),
    "viewer": (Inquiry, channels.INQUIRY),
}
_MAY: Final = {"operator": "an operator", "viewer": "a viewer or an operator"}


class RequestRefused(Refused):
    """The supervisor refused; the text has the reason."""


class NoAnswer(Failed):
    """The supervisor did not answer in time."""


class Control(Closable):
    """A connection to one running supervisor. Use it in `with`."""

    def __init__(
        self,
        address: str,
        credentials: Credentials | None = None,
        give_up: Callable[[], bool] = lambda: False,
        role: Role = "operator",
    ) -> None:
        """Connect to the simulation plane's address; raises ConnectError when it is not reachable, or at `give_up`.

        `credentials` are an operator's, where the run has certificates. A `viewer` (whose credentials may also be a
        viewer's) may only send the requests status, describe, watch.
        """
        # A certificate permits any name that begins with its own and a dot.
        stem = f"{role}-{os.getpid()}-" if credentials is None else f"{credentials.name}."
        self._role = role
        self._name = f"{stem}{os.urandom(4).hex()[:7]}"
        self._credentials = credentials
        self._inbox = Inbox(WAITING_MAX)
        security = None if credentials is None else Security(credentials)
        self._session = Session.client(address, CONNECT_S, give_up=give_up, security=security)
        self._wire = Wire(self._session, Plane.SIMULATION, self._inbox, self._name)
        self._wire.read(channels.OPERATOR_READS)
        self._requests = 0

    def close(self) -> None:
        self._session.close()

    def request(
        self, verb: str, timeout_s: float = ANSWER_S, give_up: Callable[[], bool] = lambda: False, **arguments: Any
    ) -> Answer:
        """Send a request and return the answer. Raises RequestRefused, or NoAnswer at the timeout or at `give_up`.

        A supervisor that is started again meanwhile gets the same request, and gives the same answer.
        """
        self._requests += 1
        identity = f"{self._name[-7:]}-{self._requests}"
        kind, channel = _REQUEST_OF[self._role]
        payload = encode(kind(self._name, identity, verb, encode_json(arguments)))
        answer = self._exchange(channel, payload, answer_to(channels.ANSWER, identity), timeout_s, give_up)
        if answer is None:
            raise NoAnswer(f"no answer to {verb} within {timeout_s:g} s{self._hint()}")
        if not answer.accepted:
            raise RequestRefused(answer.text)
        return answer

    def status(self, timeout_s: float = ANSWER_S, give_up: Callable[[], bool] = lambda: False) -> dict[str, Any]:
        """Return the state of the run. Raises NoAnswer."""
        content = decode_json(self.request("status", timeout_s, give_up).result)
        assert isinstance(content, dict), content
        return content

    def describe(self, timeout_s: float = ANSWER_S, give_up: Callable[[], bool] = lambda: False) -> dict[str, Any]:
        """Return the description that is needed to read frames, of `supervisor.viewing`. Raises NoAnswer."""
        content = decode_json(self.request("describe", timeout_s, give_up).result)
        assert isinstance(content, dict), content
        return content

    def view(self, inbox: Inbox) -> None:
        """Offer the frames that are shown to an inbox, as (key of `channels.VIEW`, ..., a `Commit`'s bytes). They come
        while a viewer has a lease: `request("watch", hz=50)`, again before it is over. Once for a connection.
        """
        self._session.subscribe(channels.VIEW.key_for_all, channels.VIEW.key, inbox)

    def files(
        self, deployment: Deployment, timeout_s: float = ANSWER_S, give_up: Callable[[], bool] = lambda: False
    ) -> dict[str, bytes]:
        """Return the files that a deployment (read from the text that `describe` gives) refers to, by path.

        Raises NoAnswer after `timeout_s` without a piece of a file.
        """
        fetching = Fetching(deployment.files(), {})
        while (lacking := fetching.lacking) is not None:
            digest, offset = lacking
            payload = encode(Fetch(self._name, self._name, bytes.fromhex(digest), offset))

            def take(key: str, name: str, content: bytes) -> bool | None:
                is_piece = key == channels.PIECE.key
                return (is_piece and fetching.take(channels.read(channels.PIECE, self._name, content))) or None

            if not self._exchange(channels.FETCH, payload, take, timeout_s, give_up):
                raise NoAnswer(f"no piece of a file of the deployment within {timeout_s:g} s{self._hint()}")
        return fetching.contents()

    def _exchange(
        self, channel: Channel, payload: bytes, take: Take[Taken], timeout_s: float, give_up: Callable[[], bool]
    ) -> Taken | None:
        return exchange(self._wire, self._inbox, channel, self._name, payload, take, timeout_s, give_up)

    def _hint(self) -> str:
        return "" if self._credentials is None else f"; is {self._credentials.identity} {_MAY[self._role]} of this run?"


def connect(run: str | None = None, role: Role = "operator", give_up: Callable[[], bool] = lambda: False) -> Control:
    """Connect to the newest live run, or to the one named. Raises NoRun, and what `Control`, `operator_credentials` and
    `viewer_credentials` raise.
    """
    folder = find_run(run)
    info = folder.info()
    assert info is not None, "a run that was found has a run file"
    pki = pki_of(info)
    credentials = operator_credentials(pki) if role == "operator" else viewer_credentials(pki)
    return Control(info.simulation, credentials, give_up, role)


def pki_of(info: RunInfo) -> Path | None:
    """Return the folder with certificates for a run: the one in the environment, else the run's own."""
    if not info.pki:
        return None
    return Path(os.environ.get(PKI_VARIABLE) or info.pki)


def request(verb: str, run: str | None = None, **arguments: Any) -> Answer:
    """Send a request to the newest live run, or to the one named, and return the answer; None arguments are left out.

    Raises the errors of `connect` and `Control.request`.
    """
    with connect(run) as control:
        return control.request(verb, **{name: value for name, value in arguments.items() if value is not None})


def status(run: str | None = None) -> dict[str, Any]:
    """Return the state of a run, as `supervisor.status` makes it."""
    with connect(run) as control:
        return control.status()
