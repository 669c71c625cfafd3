"""The console of a run: a process that `up` starts and ends, and whose death does not affect the run.

No process of the run waits for it, and it is not restarted. It writes the addresses of its page into
the run's folder, where only the owner can read them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import msgspec

from foosim.common.errors import BadValue, Failed, read_at
from foosim.common.units import parse_offset_ns
from foosim.launcher.display import Display
from foosim.launcher.processes import Launcher
from foosim.runtime.process import FOOSIM
from foosim.runtime.run_folder import UNREADABLE, RunFolder

CONSOLE: Final = "console"
ADDRESSES: Final = "console.json"
"""In the run's folder: the addresses of the page, and the line that reports them."""
LEAVE_S: Final = 3.0
"""Time for a console to report the end of the run to its pages."""


def page_of(console: bool, opens: bool, second: Path | None, offset: str | None, detached: bool) -> list[str] | None:
    """Return the options of `foosim view` for a page that `up` serves, None without one.

    `second` is the recording that follows the run, `offset` its time at which the run has time 0. Raises BadValue where
    the options of `up` do not fit.
    """
    if not (console or opens):
        for option, value in (("--second", second), ("--offset", offset)):
            if value is not None:
                raise BadValue(f"{option} is valid with --console only", str(value))
        return None
    if detached:
        raise BadValue("--console and --detach exclude each other; foosim view shows a run in the background")
    if offset is not None:
        if second is None:
            raise BadValue("--offset needs --second", offset)
        read_at("--offset", parse_offset_ns, offset)
    if second is not None and not second.is_file():
        raise BadValue("--second: no such file", str(second))
    options = ["--open"] if opens else []
    if second is not None:
        options += ["--second", str(second.absolute())]
    return options if offset is None else [*options, f"--offset={offset}"]


class ConsoleChild:
    """The console of one run."""

    def __init__(self, folder: RunFolder, display: Display, page: Sequence[str] | None) -> None:
        self._folder, self._display, self._page = folder, display, page
        self._launcher = Launcher(folder.name)
        self._has_addresses = self._has_ended = False
        """The addresses and the ending that were reported."""

    def start(self) -> None:
        """Start it, if requested. The run must be discoverable."""
        if self._page is None:
            return
        path = self._folder.path / ADDRESSES
        path.unlink(missing_ok=True)
        command = [FOOSIM, "view", self._folder.name, "--announce", str(path), *self._page]
        try:
            self._launcher.start(CONSOLE, command, self._folder.log(CONSOLE))
        except Failed as failed:
            self._display.release(f"{failed}; the run continues without it")

    def look(self) -> None:
        """Report its addresses once they are known, and its ending."""
        child = self._launcher.children.get(CONSOLE)
        if child is None or self._has_ended:
            return
        text = "" if self._has_addresses else self._addresses()
        if text:
            self._has_addresses = True
            self._display.release(text)
        if child.exit_code is not None:
            self._has_ended = True
            self._display.release(
                f"console {child.ending}, the run continues; foosim view {self._folder.name} starts another one; "
                f"its log is {child.log}"
            )

    def __enter__(self) -> ConsoleChild:
        """Have its addresses be the first lines of the run."""
        if self._page is not None:
            self._display.hold()
        return self

    def __exit__(self, *error: object) -> None:
        """End it after it has reported the end of the run to its pages."""
        self._launcher.stop(LEAVE_S)
        self._launcher.close()
        (self._folder.path / ADDRESSES).unlink(missing_ok=True)

    def _addresses(self) -> str:
        try:
            return str(msgspec.json.decode((self._folder.path / ADDRESSES).read_bytes())["text"])
        except UNREADABLE:
            return ""
