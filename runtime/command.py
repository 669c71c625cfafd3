"""Shared by the commands: exit codes, `--version`, and the display of refusals.

Exit codes: 0 done, 1 differs or failed, 2 bad input, 3 refused, 130 for a second Ctrl-C.
"""

from __future__ import annotations

import atexit
import contextlib
import gc
import os
import sys
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Annotated, Any, Final, NoReturn

import typer

from foosim.common.errors import Refused
from foosim.runtime.usage import BadUsage, bad_usage

DONE: Final = 0
FAILED: Final = 1
BAD_INPUT: Final = 2
REFUSED: Final = 3
INTERRUPTED: Final = 130
HELP_WIDTH_MAX: Final = 100
SESSION: Final = "foosim.runtime.transport.session"
"""Many commands end without it."""
PKI_VARIABLE: Final = "FOOSIM_PKI"
"""The folder with the certificates, without `--pki`."""


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


def new_app() -> typer.Typer:
    """Return a command with foosim's habits: help on no arguments, no shell completion to install, plain tracebacks."""
    return typer.Typer(
        context_settings={"max_content_width": HELP_WIDTH_MAX},
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
        no_args_is_help=True,
    )


def run_app(app: typer.Typer, name: str, refusing: Callable[[Sequence[str], BadUsage], None] | None = None) -> None:
    """Run the command `name` and exit with its code; refusals are shown without a traceback.

    `refusing` is called with invalid arguments, before they are shown.

    Garbage collections skip imported objects, which live as long as the process; at its end they would take a fifth of
    the time of a short command.
    """
    words = sys.argv[1:]
    others = _sessions()
    if gc.get_freeze_count() == 0:
        gc.freeze()
    try:
        code = _run(app, name, words)
    except BadUsage as problem:
        if refusing is not None:
            refusing(words, problem)
        print(str(problem), file=sys.stderr)
        code = problem.exit_code
    except Refused as refused:
        print(str(refused), file=sys.stderr)
        code = refused.exit_code
    except MemoryError:
        print(f"{name}: too little memory (MemoryError)", file=sys.stderr)
        code = FAILED
    except KeyboardInterrupt:
        code = INTERRUPTED
    _end(code, others)


def _sessions() -> Collection[Any]:
    """Return the open sessions of this process: where a command is called by a program, they are the program's."""
    session = sys.modules.get(SESSION)
    return () if session is None else session.sessions()


def _end(code: int, others: Collection[Any]) -> NoReturn:
    """End the process, also where a thread is inside Zenoh still, which would abort it at Python's own end."""
    session = sys.modules.get(SESSION)
    if session is not None and not session.end_all(others):
        atexit._run_exitfuncs()  # a terminal gets its settings back, among others
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):
                stream.flush()
        os._exit(code)
    sys.exit(code)


def _run(app: typer.Typer, name: str, words: Sequence[str]) -> int:
    """Return the exit code of a command. Raises BadUsage for invalid arguments."""
    try:
        code = app(words, prog_name=name, standalone_mode=False)
    except typer.TyperException as error:
        root = typer.main.get_command(app)
        if not words and hasattr(root, "commands"):  # then it is the help
            print(error.format_message(), file=sys.stderr)
            return BAD_INPUT
        raise bad_usage(error, root, name, words) from None
    return code if isinstance(code, int) else DONE
