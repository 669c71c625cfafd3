"""The command `foosim`: the table of its verbs.

The module of a verb is imported when the verb is called, so that help and completion start quickly.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Mapping
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, ClassVar, Final

import typer
from typer.core import CompletionItem  # type: ignore[attr-defined]  # typer makes no name of it public

from foosim.runtime.command import Group, VersionOption, new_app, run_app

WELCOME: Final = """\
foosim simulates robots, the network between them, and the programs that control them.

  foosim up deploy/table.yaml --open           play football, and watch it in the browser
  foosim rehearse deploy/table.yaml --for 20s  compute the same world in one process, as fast as possible
  foosim capture verify captures/RUN.mcap      compute a recorded run again, and compare every tick
  foosim components                            list the robots, sensors, actuators and rules that a file can name

`foosim --help` lists all commands, `foosim COMMAND --help` explains one.
"""

COMMAND: Final = re.compile(
    r'^@app\.c\w+\((?:(?:name=)?"([^"]*)")?.*?^def (\w+)\(.*?^    """(.*?)(?:\n\n|""")', re.M | re.S
)
"""A command in the source of a module: its name, that of its function, the first paragraph of its help."""
COMPLETING: Final = "_FOOSIM_COMPLETE"
"""Set by a shell to complete a word."""


class Verbs(Group):
    """A group whose commands are imported when they are called."""

    table: ClassVar[Mapping[str, Mapping[str, str]]]
    """By title and by verb: the module with its app, after a colon its name in the app where that is another one."""
    plumbing: ClassVar[Mapping[str, str]] = {}
    """Not shown in the help."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the verbs that the help shows."""
        return [name for verbs in self.table.values() for name in verbs]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a verb's command, None for an unknown verb."""
        known = {name: verb for verbs in (*self.table.values(), self.plumbing) for name, verb in verbs.items()}
        verb = known.get(cmd_name)
        if verb is None:
            return None
        module, _, name = verb.partition(":")
        command: Any = typer.main.get_command(import_module(f"foosim.{module}").app)
        return getattr(command, "commands", {}).get(name or cmd_name, command)

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """Return the verb that the words begin with, which may be two words, its command, and the other words."""
        two = " ".join(args[:2])
        if two in self.list_commands(ctx):
            return two, self.get_command(ctx, two), args[2:]
        return super().resolve_command(ctx, args)

    def sections(self, ctx: Any) -> dict[str, list[tuple[str, str]]]:
        """Return the verbs with their summaries, by title."""
        return {
            title: [(name, summary(name, verb)) for name, verb in verbs.items()] for title, verbs in self.table.items()
        }

    def shell_complete(self, ctx: Any, incomplete: str) -> list[CompletionItem]:
        """Return the verbs that a word may become."""
        rows = [row for rows in self.sections(ctx).values() for row in rows]
        return [CompletionItem(name, help=summary) for name, summary in rows if name.startswith(incomplete)]


def summary(name: str, where: str) -> str:
    """Return the first paragraph of a verb's help, from the source of its module, without importing it."""
    spec = find_spec(f"foosim.{where.partition(':')[0]}")
    assert spec is not None and spec.origin is not None, where
    found = {title or own: text for title, own, text in COMMAND.findall(Path(spec.origin).read_text(encoding="utf-8"))}
    return " ".join((found.get(name) or next(iter(found.values()))).split())


class Foosim(Verbs):
    """All verbs."""

    table: ClassVar[Mapping[str, Mapping[str, str]]] = {
        "A run": {
            "up": "cli.up",
            "down": "cli.control",
            "status": "cli.control",
            "view": "cli.view",
            "gateway": "cli.gateway",
            **dict.fromkeys(("pause", "resume", "step", "rate", "add", "remove", "push", "set", "move"), "cli.control"),
            **dict.fromkeys(("stop", "start", "balance"), "cli.control"),
        },
        "Before a run": dict.fromkeys(("check", "components", "components check", "urdf", "schema"), "cli.check"),
        "In one process": {
            "rehearse": "cli.rehearse",
            "match": "cli.match.command",
            "sweep": "cli.sweep",
            **dict.fromkeys(("sweep table", "sweep plot"), "cli.sweep_results"),
        },
        "Captures and networks": {"capture": "cli.capture.command", "net": "cli.net"},
        "Other simulators": {"morse": "cli.morse"},
        "Machines and measurements": {"pki": "cli.pki", "doctor": "cli.doctor", "fit": "fitting.main"},
    }
    plumbing: ClassVar[Mapping[str, str]] = {
        "run": "cli.run",
        "role": "cli.role",
        "guard": "cli.guard",
        "probe": "runtime.health",
        "validate": "cli.check:check",
        "inspect": "cli.check:urdf",
        "check-component": "cli.check:components check",
    }


app = new_app(Foosim, completes=True)


@app.callback()
def foosim(version: VersionOption = False) -> None:
    """Simulate robots on one machine or many, and the network between them and their controllers.

    `up` starts all processes that a deployment file declares, and shows the run. The other commands of a run control it
    from another terminal; each answer has the tick at which it takes effect.

    Exit codes: 0 done, 1 failed or differs, 2 bad input, 3 refused, 4 equal up to the end of an incomplete capture, 130
    second Ctrl-C.
    """


def main() -> None:
    """Run the command line; without a word, print the first steps."""
    if len(sys.argv) == 1 and COMPLETING not in os.environ:
        print(WELCOME, end="")
    else:
        run_app(app, "foosim")
