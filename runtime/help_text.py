"""The help of commands: usage as typed, and whole summaries."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, TypeVar

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption

METAVARS: Final = {
    "begin": "TIME",
    "connect": "ADDRESS",
    "duration": "TIME",
    "end": "TIME",
    "journals": "FOLDER",
    "lasts": "TIME",
    "listen": "HOST[:PORT]",
    "offset": "TIME",
    "path": "FOLDER",
    "pki": "FOLDER",
    "radio": "ADDRESS",
    "resumed": "RUN",
    "run_folder": "FOLDER",
    "sets": "KEY=VALUE",
    "until": "TIME",
    "vhub_listen": "HOST[:PORT]",
    "worse_for": "WHOM",
}
"""The placeholder of an option without a metavar, by the name of its parameter."""
OF_TYPES: Final = {"int": "N", "float": "NUMBER", "Path": "FILE"}
F = TypeVar("F", bound=Callable[..., Any])


class Command(TyperCommand):
    """Shows parameters as FILE, [RUN] and --for TIME, without the types of Python."""

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        for parameter in self.params:
            if parameter.metavar is None:
                name, kind = str(parameter.name), ""
                if isinstance(parameter, TyperOption):
                    kind = METAVARS.get(name) or OF_TYPES.get(
                        getattr(parameter.type_descriptor.annotation, "__name__", ""), ""
                    )
                parameter.metavar = kind or name.upper().replace("_", "-")

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return what follows the command's name."""
        arguments = [parameter for parameter in self.params if parameter.param_type_name == "argument"]
        return ["[OPTIONS]", *map(shown_argument, arguments)]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write arguments and options, each with its help."""
        rows: dict[str, list[tuple[str, str]]] = {"argument": [], "option": []}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None:
                is_argument = parameter.param_type_name == "argument"
                name = str(parameter.metavar) if is_argument else record[0]
                rows[parameter.param_type_name].append((name, record[1]))
        for title, found in (("Arguments", rows["argument"]), ("Options", rows["option"])):
            if found:
                with formatter.section(title):
                    formatter.write_dl(found)


class Group(TyperGroup):
    """Shows the whole first sentence of each command."""

    def sections(self, ctx: Any) -> dict[str, list[tuple[str, str]]]:
        """Return the commands with their summaries, by title."""
        commands = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        return {"Commands": [(name, summary_of(command)) for name, command in commands if command is not None]}

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands."""
        for title, rows in self.sections(ctx).items():
            with formatter.section(title):
                formatter.write_dl(rows)


class App(typer.Typer):
    """An app whose commands are of these classes."""

    def command(self, name: str | None = None, **more: Any) -> Callable[[F], F]:
        """Register a function as a command."""
        return super().command(name, cls=Command, **more)


def shown_argument(parameter: Any) -> str:
    """Return an argument as in a command's usage: FILE, or [RUN] where it may be left out."""
    return str(parameter.metavar) if parameter.required else f"[{parameter.metavar}]"


def summary_of(command: Any) -> str:
    """Return the first paragraph of a command's help, in one line."""
    return " ".join((command.help or "").strip().partition("\n\n")[0].split())
