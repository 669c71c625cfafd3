"""Shared by the commands: exit codes, options, help, results as JSON, and the display of refusals.

Exit codes: 0 done, 1 differs or failed, 2 bad input, 3 refused, 130 for a second Ctrl-C.
"""

from __future__ import annotations

import atexit
import contextlib
import gc
import os
import re
import sys
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Annotated, Any, Final, NoReturn, TextIO, TypeVar

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption

from foosim.common.errors import BadValue, Refused
from foosim.common.names import nearest_name

DONE: Final = 0
FAILED: Final = 1
REFUSED: Final = 3
INTERRUPTED: Final = 130
HELP_WIDTH_MAX: Final = 100
SESSION: Final = "foosim.runtime.transport.session"
"""Many commands end without it."""
PKI_VARIABLE: Final = "FOOSIM_PKI"
"""The folder with the certificates, without `--pki`."""


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


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version  # brings the parser of e-mail, which is slow

        print(f"foosim {version('foosim')}")
        raise typer.Exit(DONE)


VersionOption = Annotated[
    bool,
    typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit."),
]


PkiOption = Annotated[
    Path | None,
    typer.Option("--pki", envvar=PKI_VARIABLE, help="Folder with ca.pem, the certificate and its key."),
]


PathOption = Annotated[
    Path | None,
    typer.Option("--path", help="Folder in which players' modules are found, too, after Python's own path."),
]


RunOption = Annotated[str | None, typer.Option("--run", help="Name of the run; by default the newest live one.")]
NewRunOption = Annotated[str | None, typer.Option("--run", help="Name of the new run; by default WORLD-TIME.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object, for scripts.")]


def new_app(group: type[Group] = Group, *, completes: bool = False) -> typer.Typer:
    """Return a command with foosim's habits: help without arguments, plain tracebacks; `completes`: in shells, too."""
    return App(
        cls=group,
        context_settings={"max_content_width": HELP_WIDTH_MAX, "help_option_names": ["-h", "--help"]},
        add_completion=completes,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
        no_args_is_help=True,
    )


def print_json(content: dict[str, Any], file: TextIO | None = None) -> None:
    """Print a result of `--json` on standard output, or to a file, in one line."""
    from foosim.common.json_text import encode_json

    _printed.append(True)
    print(encode_json(content).decode(), file=file, flush=True)


def run_app(app: typer.Typer, name: str) -> NoReturn:
    """Run the command `name` and end with its exit code; refusals are shown without a traceback.

    With `--json` a command that is refused before its result prints an object, too: `failed`, `reason`.
    """
    words = sys.argv[1:]
    others = _sessions()
    _printed.clear()
    reason = ""
    try:
        code = _run(app, name, words)
    except Refused as refused:
        reason, code = str(refused), refused.exit_code
    except MemoryError:
        reason, code = f"{name}: too little memory (MemoryError)", FAILED
    except KeyboardInterrupt:
        code = INTERRUPTED
    if reason:
        print(reason, file=sys.stderr)
    if code != DONE and "--json" in words and not _printed:
        print_json({"failed": True, "reason": reason or "interrupted"})
    _end(code, others)


_printed: Final[list[bool]] = []
"""One for each object that this command has printed."""


def _sessions() -> Collection[Any]:
    """Return the open sessions of this process: where a command is called by a program, they are the program's."""
    session = sys.modules.get(SESSION)
    return () if session is None else session.sessions()


def _end(code: int, others: Collection[Any]) -> NoReturn:
    """End the process, also where a thread is inside Zenoh still, which would abort it at Python's own end.

    Garbage collections at that end skip all that there is: they would take a tenth of the time of a short command.
    """
    if gc.get_freeze_count() == 0:
        gc.freeze()
    session = sys.modules.get(SESSION)
    if session is not None and not session.end_all(others):
        atexit._run_exitfuncs()  # a terminal gets its settings back, among others
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):
                stream.flush()
        os._exit(code)
    sys.exit(code)


def _run(app: typer.Typer, name: str, words: Sequence[str]) -> int:
    """Return the exit code of a command. Raises BadValue for invalid arguments."""
    try:
        code = app(words, prog_name=name, standalone_mode=False)
    except typer.TyperException as error:
        raise BadValue(_usage_text(error, name)) from None
    return code if isinstance(code, int) else DONE


def _usage_text(error: typer.TyperException, name: str) -> str:
    """Return the error of the arguments, on one line: the command, typer's message, the nearest command."""
    context: Any = getattr(error, "ctx", None)
    text = error.format_message()
    if text.startswith("Usage: "):
        return text
    unknown = re.fullmatch(r"No such command '(.*)'\.", text)
    near = None if unknown is None else nearest_name(unknown[1], context.command.list_commands(context))
    place = name if context is None else context.command_path
    return f"{place}: {text.removesuffix('.')}{'' if near is None else f', nearest is {near}'}"
