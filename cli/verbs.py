"""The command `foosim`: the table of its verbs.

The module of a verb is imported when the verb is called, so that help and completion start quickly; each summary is
the first paragraph of the verb's help, which tests/cli/test_verbs.py compares.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from importlib import import_module
from typing import Any, ClassVar, Final, NamedTuple

import typer
from typer.core import CompletionItem  # type: ignore[attr-defined]  # typer makes no name of it public

from foosim.runtime.command import VersionOption, new_app, run_app
from foosim.runtime.help_text import Group

WELCOME: Final = """\
foosim simulates robots, the network between them, and the programs that control them.

  foosim up deploy/table.yaml --open           play football, and watch it in the browser
  foosim rehearse deploy/table.yaml --for 20s  compute the same world in one process, as fast as possible
  foosim capture verify captures/RUN.mcap      compute a recorded run again, and compare every tick
  foosim components                            list the robots, sensors, actuators and rules that a file can name

`foosim --help` lists all commands, `foosim COMMAND --help` explains one.
"""

COMPLETING: Final = "_FOOSIM_COMPLETE"
"""Set by a shell that wants to know how a word may end."""


class Verb(NamedTuple):
    """Where a verb is: the module with its app, its summary, and its name in the app where that is another one."""

    module: str
    summary: str = ""
    name: str = ""


class Verbs(Group):
    """A group whose commands are imported when they are called."""

    table: ClassVar[Mapping[str, Mapping[str, Verb]]]
    """By title, and by verb."""
    plumbing: ClassVar[Mapping[str, Verb]] = {}
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
        command: Any = typer.main.get_command(import_module(f"foosim.{verb.module}").app)
        return getattr(command, "commands", {}).get(verb.name or cmd_name, command)

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """Return the verb that the words begin with, which may be two words, its command, and the other words."""
        two = " ".join(args[:2])
        if two in self.list_commands(ctx):
            return two, self.get_command(ctx, two), args[2:]
        return super().resolve_command(ctx, args)

    def sections(self, ctx: Any) -> dict[str, list[tuple[str, str]]]:
        """Return the verbs with their summaries, by title."""
        return {title: [(name, verb.summary) for name, verb in verbs.items()] for title, verbs in self.table.items()}

    def shell_complete(self, ctx: Any, incomplete: str) -> list[CompletionItem]:
        """Return the verbs that a word may become."""
        rows = [row for rows in self.sections(ctx).values() for row in rows]
        return [CompletionItem(name, help=summary) for name, summary in rows if name.startswith(incomplete)]


class Foosim(Verbs):
    """All verbs."""

    table: ClassVar[Mapping[str, Mapping[str, Verb]]] = {
        "A run": {
            "up": Verb("cli.up", "Run a deployment, on this machine and its hosts, until Ctrl-C or --for."),
            "down": Verb("cli.control", "End a run in order."),
            "status": Verb("cli.control", "Show the state of a run: time, lag, nodes, links, score."),
            "view": Verb(
                "cli.view", "Serve the console: a page that shows and controls a live run, or plays a capture."
            ),
            "pause": Verb("cli.control", "Pause simulated time, after the ticks that are released already."),
            "resume": Verb("cli.control", "Continue after a pause."),
            "step": Verb("cli.control", "Simulate a number of ticks, then pause."),
            "rate": Verb("cli.control", "Change how fast simulated time passes."),
            "add": Verb("cli.control", "Add a spare of the deployment to the world."),
            "remove": Verb("cli.control", "Remove an entity from the world; it can be added again."),
            "push": Verb("cli.control", "Apply an impulse to a free body."),
            "set": Verb("cli.control", "Set a field of an entity, e.g. `crate-1 at=3,1` or `scout down=true`."),
            "move": Verb("cli.control", "Move a robot to another node; the world stays the same."),
            "stop": Verb("cli.control", "Stop a node, after its robots have moved to the other nodes."),
            "start": Verb(
                "cli.control",
                "Start a node that was stopped, or that its launcher has given up; its robots move back.",
            ),
            "balance": Verb(
                "cli.control", "Move robots from busy nodes to idle ones, once; prints the robots and the loads."
            ),
        },
        "Before a run": {
            "check": Verb("cli.check", "Check a deployment file, with settings if there are any."),
            "components": Verb(
                "cli.check",
                "Show the models, sensors, rules and other forms that a deployment can name on this machine.",
            ),
            "components check": Verb("cli.check", "Check that a form obeys the laws, in a deployment that uses it."),
            "urdf": Verb(
                "cli.check",
                "Show the robot in a URDF file: its tree with joints, limits, masses and shapes, and what a deployment "
                "says of it.",
            ),
            "schema": Verb(
                "cli.check",
                "Print the JSON Schema of deployment files, with the components of all installed packages.",
            ),
        },
        "In one process": {
            "rehearse": Verb(
                "cli.rehearse", "Simulate a deployment in one process on virtual time, as fast as possible."
            ),
            "match": Verb("cli.match.command", "Let two players play many games, and show who is better."),
        },
        "Captures and networks": {
            "capture": Verb(
                "cli.capture.command",
                "Look into a capture, play it, compare it, take parts of it, and simulate it again.",
            ),
            "net": Verb("cli.net", "Analyse a network, and disturb the network of a live run."),
        },
        "Machines and measurements": {
            "pki": Verb("cli.pki", "Create and check the certificates of a run on several machines."),
            "doctor": Verb("cli.doctor", "Check whether a deployment can run on this machine and its hosts."),
            "fit": Verb(
                "fitting.main",
                "Fit rolling friction, friction and restitution of a table to measured tracks.",
            ),
        },
    }
    plumbing: ClassVar[Mapping[str, Verb]] = {
        "run": Verb("cli.run"),
        "role": Verb("cli.role"),
        "guard": Verb("cli.guard"),
        "probe": Verb("runtime.health"),
        "validate": Verb("cli.check", name="check"),
        "inspect": Verb("cli.check", name="urdf"),
        "check-component": Verb("cli.check", name="components check"),
    }


app = new_app(Foosim, completes=True)


@app.callback()
def foosim(version: VersionOption = False) -> None:
    """Simulate robots on one machine or many, and the network between them and their controllers.

    `up` starts all processes that a deployment file declares, and shows the run. The other commands of a run control it
    from another terminal; each answer has the tick at which it takes effect.

    Exit codes: 0 done, 1 failed or differs, 2 bad input, 3 refused, 130 second Ctrl-C.
    """


def main() -> None:
    """Run what was typed; without a word, print what a newcomer can do."""
    if len(sys.argv) == 1 and COMPLETING not in os.environ:
        print(WELCOME, end="")
    else:
        run_app(app, "foosim")
