"""What the vHub's loop runs once its run has ended, until the capture is closed: it shows that it lives, and how far it
is, and takes nothing more.

Neighbours: `core` has decided all that there was, `capture_writer` closes, `supervisor.progress` waits.
"""

from __future__ import annotations

from typing import Any

from msgspec.structs import replace

from foosim.protocol.channels import Channel
from foosim.protocol.messages import CAPTURE, Heartbeat
from foosim.vhub.core import HubCore


class ClosingCore:
    """The core of a vHub that closes its capture. `actions` is what the shell performs next."""

    def __init__(self, core: HubCore) -> None:
        self.actions: list[Any] = core.actions
        self._core = core

    def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None:
        """Drop a message: the run has ended."""

    def wake(self, now_ns: int) -> None:
        """Say the heartbeat when it is due; the report in it has the account of the capture."""
        self._core.member.wake(now_ns, self._heartbeat)

    def deadline_ns(self) -> int:
        """When `wake` has something to do next."""
        return self._core.member.deadline_ns

    def _heartbeat(self) -> Heartbeat:
        return replace(self._core.heartbeat(), waiting_for=CAPTURE)
