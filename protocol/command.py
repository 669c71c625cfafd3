"""What the commands have in common: exit codes, `--version`, and how a refusal is shown.

Exit codes: 0 done, 1 differs or failed, 2 bad input, 3 refused, 130 for a second Ctrl-C. Neighbours: `errors` (each
error knows its code), every command.
"""

from __future__ import annotations

import gc
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Final

import typer

from foosim.protocol.errors import Refused

DONE: Final = 0
FAILED: Final = 1
BAD_INPUT: Final = 2
REFUSED: Final = 3
INTERRUPTED: Final = 130
HELP_WIDTH_MAX: Final = 100
PKI_VARIABLE: Final = "FOOSIM_PKI"
"""Says, where `--pki` does not, which folder has the certificates."""


def _show_version(wanted: bool) -> None:
    if wanted:
        print(f"foosim {version('foosim')}")
        raise typer.Exit(DONE)


VersionOption = Annotated[
    bool,
    typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit."),
]


PkiOption = Annotated[
    Path | None,
    typer.Option("--pki", envvar=PKI_VARIABLE, help="The folder with ca.pem and its own certificate and key."),
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


def run_app(app: typer.Typer, name: str) -> None:
    """Run the command `name` and exit with its code; what is refused is shown without a traceback.

    What was imported lives as long as the process: garbage collections leave it out, also those at the process's end,
    which are else a fifth of what a short command costs.
    """
    if gc.get_freeze_count() == 0:
        gc.freeze()
    try:
        app(prog_name=name)
    except Refused as refused:
        print(str(refused), file=sys.stderr)
        sys.exit(refused.exit_code)
    except MemoryError:
        print(f"{name}: too little memory (MemoryError)", file=sys.stderr)
        sys.exit(FAILED)
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
