"""The verb `morse`: builder scripts of the simulator MORSE, as deployments."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from foosim.capture.new_file import new_file
from foosim.cli.up import app as up_app
from foosim.common import limits
from foosim.common.errors import BadValue
from foosim.gateways.builder.script import export
from foosim.runtime.command import new_app, run_app
from foosim.runtime.run_folder import runs_folder

app = new_app()

Script = Annotated[Path, typer.Argument(metavar="SCRIPT", help="A builder script of MORSE.")]
Nodes = Annotated[
    int | None,
    typer.Option(
        min=1,
        max=limits.NODES_MAX,
        help="The number of nodes, over which the robots are split; by default as in the script.",
    ),
]


@app.callback()
def morse_group() -> None:
    """Run builder scripts of the simulator MORSE.

    A script runs in a process of its own, for at most 20 s, with a `morse.builder` that records. Everything unsupported
    is shown at once, each with its line, and nothing is written.

    Exit codes: 0 done, 1 failed, 2 unsupported or bad input, 3 refused, 130 second Ctrl-C.
    """


@app.command("run", context_settings={"allow_extra_args": True, "ignore_unknown_options": True})
def run_script(context: typer.Context, script: Script, nodes: Nodes = None) -> None:
    """Run the deployment of a script. Further options are those of `foosim up`."""
    file = runs_folder().parent / "morse" / f"{script.stem}.yaml"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(exported(script, nodes), encoding="utf-8")
    sys.argv[1:] = [str(file), *context.args]
    run_app(up_app, "foosim up")


@app.command("export")
def export_script(
    script: Script,
    output: Annotated[Path, typer.Option("-o", "--output", help="The deployment to write.")],
    nodes: Nodes = None,
) -> None:
    """Write the deployment of a script, with comments that name its lines. An existing file is not overwritten."""
    with new_file(output) as part:
        part.write_text(exported(script, nodes), encoding="utf-8")


def exported(script: Path, nodes: int | None) -> str:
    """Return the deployment of a script."""
    if not script.is_file():
        raise BadValue("there is no such script", str(script))
    return export(script, nodes)
