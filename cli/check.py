"""The verbs before a run: `check`, `components`, `components check`, `urdf`, `schema`.

Each imports what it calls: they need little of each other.
"""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from pathlib import Path
from typing import Annotated

import typer

from foosim.cli.run_command import with_options
from foosim.launcher.run_options import RunOptions
from foosim.runtime.command import JsonOption, new_app, print_json

app = new_app()


@app.command("check")
@with_options("file", "sets")
def check(
    options: RunOptions,
    expanded: Annotated[
        bool, typer.Option("--expanded", help="Print the deployment with its templates, counts and selectors expanded.")
    ] = False,
    json: JsonOption = False,
) -> None:
    """Check a deployment file, with settings if there are any.

    Prints all problems, one a line: file:line:column: problem, value, nearest valid name. Problems between
    fields are reported once each field is valid by itself. Without problems, the classes of the players on this machine
    are imported.
    """
    from foosim.deployment.loader import expanded_text
    from foosim.launcher.plan import check_players_here, make_plan
    from foosim.vhub.links.offered_load import warnings_of
    from foosim.world.bodies.visual_meshes import undrawn_meshes

    plan = make_plan(options)
    check_players_here(plan)
    if expanded:
        print(expanded_text(plan.text, str(options.file)), end="")
        return
    deployment = plan.deployment
    content = {
        "world": deployment.world,
        "robots": len(deployment.robots),
        "nodes": sorted(deployment.nodes),
        "players": sorted(deployment.players),
    }
    for warning in (*warnings_of(deployment), *undrawn_meshes(deployment.asset_files)):
        typer.echo(f"{options.file}: warning: {warning}", err=True)
    described = f"{len(deployment.robots)} robots on {len(deployment.nodes)} nodes, {len(deployment.players)} players"
    if json:
        print_json(content)
    else:
        print(f"{options.file}: valid, world {deployment.world}, {described}")


@app.command("components check")
def check_component(
    name: Annotated[str, typer.Argument(metavar="NAME", help="A name, 'TYPE NAME', or module:Class.")],
    file: Annotated[Path, typer.Option("--in", help="A deployment that uses it.")],
    sets: Annotated[list[str] | None, typer.Option("--set", help="Change the deployment; may be repeated.")] = None,
    ticks: Annotated[int, typer.Option(min=20, help="How many ticks each rehearsal has.")] = 500,
    seed: Annotated[int, typer.Option(min=0, help="Draws which robots move when.")] = 1,
) -> None:
    """Check that a component obeys the laws, in a deployment that uses it.

    Rehearses on one, two and three nodes with moved robots and objects made anew, with everything leaving and coming
    back, in another process, with all named in another order, beside a robot that does nothing and beside a second one
    of each sensor; compares sensors alone with many at once. Prints what differs, with tick and slot. On a terminal,
    standard error has the rehearsal that it is in.

    Exit codes: 0 nothing differs, 1 something does, 2 bad input, 130 Ctrl-C.
    """
    from foosim.cli import rehearse
    from foosim.deployment.loader import apply_sets
    from foosim.deployment.text.files import read_source_file

    text = apply_sets(read_source_file(file), str(file), sets or [])
    raise typer.Exit(rehearse.check_component(text, file, name, ticks, seed))


@app.command()
def components(
    type_name: Annotated[
        str | None, typer.Argument(metavar="TYPE", help="model, sensor, rule, kit or another type.")
    ] = None,
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="One of them, or module:Class.")] = None,
    json: JsonOption = False,
) -> None:
    """Show the models, sensors, rules and other components that a deployment can name on this machine.

    They are foosim's own and those of installed packages (entry points of the group `foosim.world`). With a name:
    settings with their units, limits and defaults, the fields of its readings or commands, what it remembers and
    writes, and what a model or kit brings.
    """
    from foosim.cli.components import as_json, chosen, line, lines

    with redirect_stdout(sys.stderr):  # what modules print is no result
        found = chosen(type_name, name)
    if json:
        print_json({"components": [as_json(component) for component in found]})
        return
    for component in found:
        print(*([line(component)] if name is None else lines(component)), sep="\n")


@app.command()
def urdf(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A URDF or MJCF file.")],
    assets: Annotated[
        Path | None,
        typer.Option(help="The asset folder; by default the nearest around FILE that has all meshes."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Show the robot in a URDF or MJCF file: its tree with joints, limits, masses and shapes, and its entry of a
    deployment.

    The file is read as by a run, which refuses the same: what is shown is what is simulated. What is passed over,
    mended or without effect is noted. Of a file with errors all errors are shown, then the notes.
    """
    from foosim.deployment.assets import asset_folder, read_robot
    from foosim.world.bodies.findings import BadRobot
    from foosim.world.bodies.urdf_text import as_json, lines
    from foosim.world.matter.mesh import AssetError

    if file.is_dir():
        raise AssetError(f"{file}: a folder, where a URDF file is needed")
    folder = asset_folder(file) if assets is None else assets
    try:
        robot = read_robot(file, folder)
    except BadRobot as bad:
        raise AssetError("\n".join((bad.what, *bad.notes))) from None
    if json:
        print_json({**as_json(robot), "assets": str(folder)})
        return
    print(*lines(robot), sep="\n")
    if folder.resolve() != file.parent.resolve():
        print(f"\nin the folder {folder}, or with `assets` of that folder")


@app.command()
def schema(
    own: Annotated[bool, typer.Option("--own", help="Leave out what other packages bring.")] = False,
) -> None:
    """Print the JSON Schema of deployment files, with the components of all installed packages.

    Editors with support of JSON Schema complete and check a file whose first line names it:
    `# yaml-language-server: $schema=FILE`.
    """
    from foosim.deployment.json_schema import deployment_schema_text

    with redirect_stdout(sys.stderr):  # what modules print is no result
        text = deployment_schema_text(installed=not own)
    print(text, end="")
