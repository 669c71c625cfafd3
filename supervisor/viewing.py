"""Who looks at a run: committed frames for people, as long as somebody has a lease on them.

`watch` begins or renews a lease of the one who asks, `describe` says what one has to know to read frames. A frame goes
out on `view` as the bytes that were journalled, at the highest rate that a lease asks for on the wall, one whose edits
change the layout at once, and what is behind them at the next wake: of a world that is paused the last frame was shown.
Leases are in no journal: after a loss of the supervisor they are asked for again. Neighbours: `core` commits,
`requests` has the verbs.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from foosim.protocol import channels, limits
from foosim.protocol.actions import Publish
from foosim.protocol.codec import encode_json
from foosim.protocol.errors import Refused, show
from foosim.protocol.messages import Add, Answer, Edit, Remove, Request

if TYPE_CHECKING:
    from foosim.supervisor.core import SupervisorCore

LEASE_NS: Final = 5_000_000_000
HZ_MAX: Final = 100.0
BYTES_PER_S_MAX: Final = 5_000_000
"""Of frames: a large world is shown less often."""
FRAME_BYTES_MAX: Final = 384 * 1024
"""A larger commit is not in the answer to `describe`, and comes with the lease."""
_NS_PER_S: Final = 1_000_000_000


class Viewing:
    """The leases, and what is published by them."""

    def __init__(self, core: SupervisorCore) -> None:
        self.is_shown = False
        """Whether somebody wants frames: all that a commit has to ask while nobody does."""
        self._core = core
        self._leases: dict[str, tuple[float, int]] = {}
        """By who asks: frames per second, and when the lease is over."""
        self._period_ns = self._due_ns = 0
        self._unseen = b""
        """The last commit, while it has not been shown."""

    def watch(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        """Begin or renew a lease; the answer has the rate that it gets and for how long. Raises Refused."""
        hz = _rate(arguments.get("hz"))
        self._end_leases(now_ns)
        if request.sender not in self._leases and len(self._leases) >= limits.OPERATORS_MAX:
            raise Refused(f"{limits.OPERATORS_MAX} look at the run already")
        was_shown = hz > 0.0 and self._leases.get(request.sender, (0.0, 0))[0] > 0.0
        self._leases[request.sender] = hz, now_ns + LEASE_NS
        self._set_rate()
        if hz and not was_shown:
            self._unseen = self._last_commit
        got = min(hz, _NS_PER_S / self._period_ns) if hz else 0.0
        return self._answer(request, {"hz": got, "lease_s": LEASE_NS / _NS_PER_S})

    def describe(self, request: Request, arguments: dict[str, Any], now_ns: int) -> Answer:
        """Say what is run, who owns what, and where the world is: what one has to know to read the frames."""
        core, run = self._core, self._core.settings
        commit = self._last_commit
        has_frame = 0 < len(commit) <= FRAME_BYTES_MAX
        what = {
            "run": run.run,
            "deployment_name": run.deployment_name,
            "deployment": run.deployment_text,
            "added": [(entity.name, entity.model) for entity in core.added_to(core.frame.layout)],
            "layout": core.frame.layout.digest.hex(),
            "pace": str(core.pacer.pace),
            "owners": core.owners,
            "epoch": core.epoch,
            "first_tick": core.first_tick,
            "tick": core.frame.tick,
            "frame": base64.b64encode(commit).decode() if has_frame else None,
        }
        return self._answer(request, what)

    def committed(self, payload: bytes, edits: Sequence[Edit], now_ns: int) -> None:
        """Show a commit when it is due, or when another layout begins with it."""
        self._unseen = payload
        if now_ns >= self._due_ns or any(isinstance(edit, Add | Remove) for edit in edits):
            self._show(now_ns)

    def wake(self, now_ns: int) -> None:
        """End leases that were not renewed; show what was committed last, if nothing came behind it."""
        if not self._leases:
            return
        self._end_leases(now_ns)
        if self._unseen and now_ns >= self._due_ns:
            self._show(now_ns)

    def _show(self, now_ns: int) -> None:
        self._core.actions.append(Publish(channels.VIEW, channels.SUPERVISOR, self._unseen))
        self._unseen = b""
        self._due_ns += self._period_ns
        if self._due_ns <= now_ns:  # nothing is made up for
            self._due_ns = now_ns + self._period_ns

    def _end_leases(self, now_ns: int) -> None:
        over = [name for name, (_, until_ns) in self._leases.items() if until_ns <= now_ns]
        for name in over:
            self._leases.pop(name)
        if over:
            self._set_rate()

    @property
    def _last_commit(self) -> bytes:
        """The last commit as it was published; empty before the first."""
        return self._core.commits.get(self._core.frame.tick, b"")

    def _set_rate(self) -> None:
        """Show frames as often as the most eager lease wants, and as their size allows."""
        hz = max((hz for hz, _ in self._leases.values()), default=0.0)
        self.is_shown = hz > 0.0
        if self.is_shown:
            self._period_ns = round(_NS_PER_S / min(hz, BYTES_PER_S_MAX / max(1, len(self._last_commit))))
        else:
            self._unseen = b""

    def _answer(self, request: Request, result: dict[str, Any]) -> Answer:
        return Answer(request.sender, request.id, True, self._core.frame.tick, "", encode_json(result))


def _rate(value: object) -> float:
    """Return frames per second as they are asked for; 0 is none."""
    if value is None:
        return 0.0
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value <= HZ_MAX:
        raise Refused(f"hz: a number from 0 to {HZ_MAX:g} is needed, not {show(value)}")
    return float(value)
