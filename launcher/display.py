"""Display of a running system: a live table in a terminal, a plain line a second elsewhere.

Both are pure functions of a status (`supervisor.status`); only `Display` knows a terminal.
"""

from __future__ import annotations

import os
import sys
from contextlib import AbstractContextManager, ExitStack, redirect_stderr, redirect_stdout
from types import TracebackType
from typing import Any, Final, TextIO, cast

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from foosim.protocol.run_status import CLOSING
from foosim.runtime.disk import megabytes

LINKS_SHOWN_MAX: Final = 20
ENTITIES_SHOWN_MAX: Final = 6
SOLVERS_SHOWN_MAX: Final = 3
AWAY: Final = "(before the vHub was lost)"


def simulated_s(status: dict[str, Any]) -> float:
    """Return the simulated time of a status, in s."""
    return float(status["ticks"]) * float(status["tick_ns"]) / 1e9


def lag_text(status: dict[str, Any]) -> str:
    """`lag 0.3 ms (p50 0.1, p99 1.2, max 3.4), waited for red`: of the last tick, or of the last late one by number."""
    lag, late = status["lag_ms"], status["late"]
    if lag is None:
        return ""
    text = f"lag {late['lag_ms']:.1f} ms (p50 {lag['p50']:.1f}, p99 {lag['p99']:.1f}, max {lag['max']:.1f})"
    if not late["waited_for"]:
        return text
    which = "" if late["tick"] == status["ticks"] else f"tick {late['tick']} "
    return f"{text}, {which}waited for {late['waited_for']}"


def pace_text(status: dict[str, Any]) -> str:
    """`0.32x (wanted 2x)`, or its state when it does not run."""
    pace = str(status["pace"])
    if status["state"] != "running":
        return f"{pace}, {status['state']}"
    rate = status.get("speed", status["rtf"])
    return f"wanted {pace}" if rate is None else f"{rate:.2f}x (wanted {pace})"


def world_texts(status: dict[str, Any]) -> list[str]:
    """Return a summary of the world: the texts of its rules and kits, and the solvers of its free bodies."""
    solvers = [f"{name} solved by {node}" for name, node in status["solvers"].items()]
    return [*status["summary"], *solvers[:SOLVERS_SHOWN_MAX]]


def recovery_text(entry: dict[str, Any]) -> str:
    """`tick 812: lost node blue (its connection closed), continued after 3.1 ms, epoch 2`; or a return."""
    name = entry["name"]
    texts = {
        "node": f"lost node {name} ({entry['reason']})",
        "join": f"node {name} takes part",
        "supervisor": "the supervisor was started again",
        "vhub": f"lost the vHub ({entry['reason']})",
        "player": f"lost {name} ({entry['reason']})",
        "away": f"continues without {name} ({entry['reason']})",
        "return": f"{name} takes part again",
    }
    what = texts[entry["what"]]
    after = "" if entry["outage_ms"] is None else f", continued after {entry['outage_ms']:.1f} ms"
    return f"tick {entry['tick']}: {what}{after}, epoch {entry['epoch']}"


def recording_text(status: dict[str, Any]) -> str:
    """Return the error of the capture: `capture ended: ... (812 rows are not in it)`; empty when there is none."""
    recording = status["recording"]
    if not recording["problem"]:
        return ""
    refused = f" ({recording['refused']} rows are not in it)" if recording["refused"] else ""
    return f"capture {recording['state']}: {recording['problem']}{refused}"


def closing_text(status: dict[str, Any]) -> str:
    """`closing the capture: 81,200 rows are left, 12.4 MB are written`; empty when nothing is closed."""
    recording = status["recording"]
    if recording["state"] != CLOSING:
        return ""
    left = recording["offered"] - recording["written"] - recording["refused"]
    return f"closing the capture: {left:,} rows are left, {megabytes(recording['bytes'])} are written"


def packets_text(status: dict[str, Any]) -> str:
    """`packets 22510 offered, 22390 delivered, 113 dropped`; empty where there were none.

    While the vHub is away they are its last reported counts; a restarted supervisor may have none yet.
    """
    packets = status["packets"]
    if not packets["offered"]:
        return ""
    text = f"packets {packets['offered']} offered, {packets['delivered']} delivered, {packets['dropped']} dropped"
    if packets["refused"]:
        text = f"{text}, packets refused {packets['refused']}"
    return f"{text} {AWAY}" if status["vhub_away"] else text


def plain_line(status: dict[str, Any]) -> str:
    """Return one line for a log or a pipe."""
    if status["state"] == "starting":
        return f"starting, waiting for {status['waiting_for'] or 'the first tick'}"
    parts = [
        f"{simulated_s(status):.2f} s",
        pace_text(status),
        lag_text(status),
        *world_texts(status),
        packets_text(status),
        recording_text(status),
        "load " + " ".join(f"{name} {process['busy']:.0%}" for name, process in status["processes"].items()),
    ]
    return " | ".join(part for part in parts if part)


def render(status: dict[str, Any], links_max: int = LINKS_SHOWN_MAX) -> RenderableType:
    """Return the whole table, with at most `links_max` links."""
    return Group(_head(status), Text(), _processes(status), Text(), _links(status, links_max))


def fitted(status: dict[str, Any], console: Console) -> RenderableType:
    """Return the table with as many links as the window has lines for; the total row stays visible."""
    whole = render(status)
    excess = len(console.render_lines(whole, pad=False)) - console.height
    if excess <= 0:
        return whole
    return render(status, max(0, min(status["links_in_all"], LINKS_SHOWN_MAX) - excess))


def _head(status: dict[str, Any]) -> Text:
    lines = [
        f"{status['world']} · run {status['run']} · {simulated_s(status):.2f} s · tick {status['ticks']} "
        f"· {pace_text(status)}",
        " · ".join([*world_texts(status), f"{status['handovers']} hand-overs, {status['moves']} moves"]),
    ]
    lag = lag_text(status)
    waiting = f"waiting for {status['waiting_for']}" if status["state"] in ("starting", "paused") else ""
    third = " · ".join(part for part in (lag, waiting if status["waiting_for"] else "") if part)
    head = Text("\n".join([*lines, third] if third else lines))
    wrong = recording_text(status)
    return head.append(f"\n{wrong}", style="bold red") if wrong else head


def _processes(status: dict[str, Any]) -> Table:
    """Nodes with their hosts and shared processes, if any, their entities and their load; then the other roles.

    Beside them is each node's share of the ticks of free bodies, or without any the ticks in which it solved a body.
    """
    table = Table(title="processes", title_justify="left", box=None, pad_edge=False)
    processes, nodes, shared = status["processes"], status["nodes"], status["shared"]
    has_hosts = any(process["host"] for process in processes.values())
    free = sum(node["free_ticks"] for node in nodes.values())
    for column in ("name", *(["process"] if shared else []), *(["host"] if has_hosts else []), "owns"):
        table.add_column(column)
    for column in ("free bodies" if free else "solved ticks", "load"):
        table.add_column(column, justify="right")
    table.add_column("waits for", no_wrap=True)
    for name in [*nodes, *(other for other in processes if other not in nodes)]:
        node, process = nodes.get(name), processes.get(name)
        owned, solved = "", ""
        if node is not None:
            owned = _listed(node["owned"])
            solved = f"{node['free_ticks'] / free:.0%}" if free else str(node["solved_ticks"])
        table.add_row(
            *(name, *([shared.get(name, name)] if shared else [])),
            *([process["host"] if process else ""] if has_hosts else []),
            *(owned, solved, f"{process['busy']:.0%}" if process else "-", _doing(process)),
        )
    return table


def _doing(process: dict[str, Any] | None) -> str:
    """Return the name that a process waits for, or the reason why it does not take part."""
    if process is None:
        return "not here yet"
    return next((state for state in ("stopped", "lost") if process[state]), str(process["waiting_for"]))


def _listed(names: list[str]) -> str:
    """Join names, the many shortened."""
    shown = ", ".join(names[:ENTITIES_SHOWN_MAX])
    return shown if len(names) <= ENTITIES_SHOWN_MAX else f"{shown} and {len(names) - ENTITIES_SHOWN_MAX} more"


def _links(status: dict[str, Any], links_max: int) -> Table:
    """A row per directed link that was used, the busiest when there are too many, and a last one for all."""
    table = Table(title="links", title_justify="left", box=None, pad_edge=False)
    table.add_column("from")
    table.add_column("to")
    for column in ("offered", "delivered", "dropped", "mean delay", "age at use, p99"):
        table.add_column(column, justify="right")
    links = [link for link in status["links"] if link[2] > 0]
    shown = sorted(links, key=lambda link: (-link[2], link[:2]))[:links_max]
    for source, destination, offered, delivered, dropped, delay_ns, _, _, _, ages in sorted(shown):
        delay = f"{delay_ns / 1e6:.2f} ms"
        table.add_row(source, destination, str(offered), str(delivered), str(dropped), delay, _age_text(ages))
    packets = status["packets"]
    hidden = status["links_in_all"] - len(shown)
    more = f"and {hidden} more" if hidden > 0 else ""
    total = (str(packets["offered"]), str(packets["delivered"]), str(packets["dropped"]))
    table.add_row("all", more, *total, f"{packets['in_flight']} in flight", style="bold")
    if status["vhub_away"]:
        table.title = f"links {AWAY}"
    return table


def _age_text(ages: list[list[Any]]) -> str:
    """Return the age of a link's data when its receiver acts: of its one channel, or the oldest of several."""
    _, _, p50_ns, p99_ns = max(ages, key=lambda age: (age[3], age[2]), default=("", 0, -1, -1))
    return "" if p99_ns < 0 else f"{p50_ns / 1e6:.1f}, {p99_ns / 1e6:.1f} ms"


def render_text(status: dict[str, Any], width: int = 120) -> str:
    """Return the table as text without colours."""
    console = Console(width=width, color_system=None, force_terminal=False)
    with console.capture() as captured:
        console.print(render(status))
    return captured.get()


class Output:
    """A stream that drops its text once it cannot be written (a full disk, a closed pipe): the run continues."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        try:
            return self._stream.write(text)
        except OSError:
            self._drop()
            return len(text)

    def flush(self) -> None:
        try:
            self._stream.flush()
        except OSError:
            self._drop()

    def _drop(self) -> None:
        """Discard the rest of the stream and its buffer, which Python flushes at its end."""
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self._stream.fileno())
        os.close(nowhere)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def unfailing_output() -> AbstractContextManager[object]:
    """Wrap both output streams, so that errors in writing do not end the run."""
    with ExitStack() as stack:
        if sys.stdout is not None:  # it is None where it was closed before the start, which nothing minds
            stack.enter_context(redirect_stdout(cast(TextIO, Output(sys.stdout))))
        if sys.stderr is not None:
            stack.enter_context(redirect_stderr(cast(TextIO, Output(sys.stderr))))
        return stack.pop_all()


class Display:
    """Shows statuses, on a terminal as a live table, else as lines."""

    EVERY_S_LIVE: Final = 0.25
    EVERY_S_PLAIN: Final = 1.0

    def __init__(self, stream: TextIO | None = None) -> None:
        """`stream` is standard output by default."""
        self._console = Console(file=stream or sys.stdout)
        self._live: Live | None = None
        self._shown: tuple[float, float] | None = None
        """Wall and simulated time of the last status, in s."""
        self._held: list[str] | None = None
        """Lines that wait for the first one."""
        self.is_live = self._console.is_terminal
        self.every_s = self.EVERY_S_LIVE if self.is_live else self.EVERY_S_PLAIN

    def __enter__(self) -> Display:
        if self.is_live:
            self._live = Live(console=self._console, auto_refresh=False, transient=False)
            self._live.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.release()
        if self._live is not None:
            self._live.stop()
            self._live = None

    def show(self, status: dict[str, Any], now_s: float) -> None:
        """Show the state of the run; `now_s` is a wall time, for the rate since the last status."""
        now = (now_s, simulated_s(status))
        if self._shown is not None and now_s > self._shown[0]:
            status = {**status, "speed": (now[1] - self._shown[1]) / (now[0] - self._shown[0])}
        self._shown = None if status["state"] == "starting" else now  # earlier time does not count for the rate
        if self._live is not None:
            self._live.update(fitted(status, self._console), refresh=True)
        else:
            self.say(plain_line(status))

    def show_closing(self, status: dict[str, Any]) -> None:
        """Show the progress of an ended run's capture."""
        text = closing_text(status)
        if self._live is not None:
            self._live.update(Group(fitted(status, self._console), Text(text)), refresh=True)
        elif text:
            self.say(text)

    def say(self, line: str) -> None:
        """Show one line that stays."""
        if self._held is None:
            self._console.print(line, markup=False, highlight=False, soft_wrap=True)
        else:
            self._held.append(line)

    def hold(self) -> None:
        """Keep all lines until `release`, except in a terminal."""
        self._held = None if self.is_live else []

    def release(self, *first: str) -> None:
        """Show the lines that were kept, after the `first` ones."""
        held, self._held = self._held or [], None
        for line in (*first, *held):
            self.say(line)
