"""The command `foosim-supervisor`: runs a deployment, and controls a run from another terminal.

Each subcommand is a thin shell over a typed function: `launcher.begin`, `supervisor.main.serve`, `client.control`.
Each imports what it calls, so `--help` and the commands that need little start quickly.
"""

from __future__ import annotations

import sys
from collections.abc import Collection, Mapping, Sequence
from contextlib import redirect_stdout
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from foosim.cli.run_command import with_options
from foosim.common.errors import BadValue, Failed, Refused, read_at
from foosim.launcher.run_options import RunOptions
from foosim.runtime.command import DONE, FAILED, INTERRUPTED, VersionOption, new_app, run_app
from foosim.runtime.early_signals import interrupting_signals, raise_noted
from foosim.runtime.health import ProgressOption
from foosim.runtime.usage import BadUsage

if TYPE_CHECKING:
    from foosim.launcher.outcome import Outcome
    from foosim.launcher.up import Up
    from foosim.protocol.messages import Answer

app = new_app()

Run = Annotated[str | None, typer.Option("--run", help="Name of the run; by default the newest live one.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for scripts.")]
ConsoleOption = Annotated[bool, typer.Option("--console", help="Serve the console of the run; its address is printed.")]
Second = Annotated[
    Path | None,
    typer.Option(metavar="CAPTURE|CSV", help="A recording that the console shows beside the run."),
]
Offset = Annotated[str | None, typer.Option(help="Time in --second at time 0 of the run, e.g. 2.5s or -1s.")]
BESIDE_RESUME: Final = ("resumed", "console", "open_browser", "second", "offset", "pki", "json")
"""The options that `up --resume` accepts; it reads all others from the run."""
RunName = Annotated[str | None, typer.Option("--run", help="Name of the new run; by default WORLD-TIME.")]


@app.callback()
def foosim_supervisor(version: VersionOption = False) -> None:
    """Start simulation runs and control them.

    `up` starts all processes that a deployment file declares and shows the run. The other commands control a
    run from another terminal; each answer has the tick at which it takes effect.

    Exit codes: 0 done, 1 failed, 2 bad input, 3 refused, 130 second Ctrl-C.
    """


@app.command()
@with_options()
def up(  # noqa: PLR0913, PLR0917  # a command's options
    context: typer.Context,
    options: RunOptions | None = None,
    capture: Annotated[
        Path | None, typer.Option(help="The capture to write; by default captures/WORLD-TIME.mcap.")
    ] = None,
    no_capture: Annotated[bool, typer.Option("--no-capture", help="Write no capture.")] = False,
    run: RunName = None,
    detached: Annotated[bool, typer.Option("--detach", help="Run in the background; `down` ends it.")] = False,
    resumed: Annotated[str | None, typer.Option("--resume", help="Resume this run, whose launcher died.")] = None,
    console: ConsoleOption = False,
    open_browser: Annotated[bool, typer.Option("--open", help="As --console, and open the page in a browser.")] = False,
    second: Second = None,
    offset: Offset = None,
    json: Annotated[bool, typer.Option("--json", help="Print the result as JSON in the last line.")] = False,
) -> None:
    """Run a deployment, on this machine and its hosts, until Ctrl-C or --for.

    The supervisor, the vHub, each node and each player are processes, each with a log file, unless roles share one
    (--processes). They end with this command. Ctrl-C ends the run in order and finishes the capture; a second Ctrl-C
    kills all processes. Processes on other hosts are started through ssh. For a node with `launch: manual` the command
    line is printed, and the run waits for it.

    --from starts the world with the newest captured frame at or before that time; with @last, or without a time, with
    the last frame. Simulated time continues from that frame, and --for counts from it. The deployment may differ from
    the captured one, except in its robots, their sensors and the tick.

    --resume continues a run whose launcher died, from its last committed frame and with its options.
    """
    context.with_resource(interrupting_signals())
    begun: Up | Outcome | None = None
    try:
        raise_noted()
        from foosim.launcher.begin import begin, go_on
        from foosim.launcher.console_child import page_of
        from foosim.launcher.display import Display, unfailing_output
        from foosim.launcher.up import Killed, Up
        from foosim.runtime.run_folder import open_run

        context.with_resource(unfailing_output())
        display = Display(sys.stderr if json else sys.stdout)
        page = page_of(console, open_browser, second, offset, detached)
        if resumed is not None:
            if given := _given(context, but=BESIDE_RESUME):
                raise BadValue(f"--resume takes FILE and options from the run, it goes without {', '.join(given)}")
            begun = go_on(open_run(resumed), display, page)
        elif options is None:
            raise BadValue("a deployment FILE is needed, such as deploy/table.yaml, or --resume RUN")
        elif no_capture and capture is not None:
            raise BadValue("--capture and --no-capture exclude each other", str(capture))
        else:
            begun = begin(options, capture, not no_capture, run, detached, display, page)
        outcome = begun.run() if isinstance(begun, Up) else begun
    except (Refused, MemoryError, KeyboardInterrupt) as error:
        _print_unended(error, begun, resumed, run, json)
        raise
    except Killed as killed:
        print(killed, file=sys.stderr)
        _print_result(killed.result, json)
        raise typer.Exit(INTERRUPTED) from None
    for line in outcome.lines:
        display.say(line)
    _print_result(outcome.result, json)
    raise typer.Exit(FAILED if outcome.failed else DONE)


class BeforeRun(Failed):
    """A signal has ended `up` before its run began."""


def _print_unended(
    error: BaseException, begun: Up | Outcome | None, resumed: str | None, run: str | None, json: bool
) -> None:
    """Print the result of a run that an error has ended. Raises BeforeRun where that was a signal."""
    from foosim.launcher.outcome import Outcome, refused_result

    reason = "too little memory" if isinstance(error, MemoryError) else str(error)
    if begun is None or isinstance(begun, Outcome):
        result = refused_result(resumed, run, reason)
    else:
        result = begun.unended(reason)
    _print_result(result, json)
    if isinstance(error, KeyboardInterrupt):
        raise BeforeRun(reason) from None


def _given(context: typer.Context, but: Collection[str]) -> list[str]:
    """Return the parameters given on the command line, as they are typed, without those named in `but`."""
    return [
        parameter.opts[0] if parameter.param_type_name == "option" else str(parameter.metavar)
        for parameter in context.command.params
        if (source := context.get_parameter_source(parameter.name or "")) is not None and source.name == "COMMANDLINE"
        if parameter.name not in but
    ]


def _print_result(result: Mapping[str, Any], json: bool) -> None:
    if json:
        from foosim.common.json_text import encode_json

        print(encode_json(result).decode())


@app.command("run")
@with_options()
def run_supervisor(
    options: RunOptions,
    run: RunName = None,
    progress_file: ProgressOption = None,
) -> None:
    """Run a supervisor only.

    The vHub, nodes and players are started separately. The run's folder has the run file, logs and journals.
    """
    from foosim.launcher.journal_check import supervisor_records
    from foosim.launcher.plan import make_plan
    from foosim.runtime.process import has_launcher
    from foosim.runtime.run_folder import create_run, open_run, run_exists
    from foosim.supervisor.main import serve

    plan = make_plan(options)
    is_launched = has_launcher()
    if not is_launched:  # a launcher has checked, and watches the disks
        from foosim.launcher.begin import look_for_room
        from foosim.launcher.display import Display
        from foosim.runtime.run_folder import runs_folder

        look_for_room(plan, None, runs_folder(), Display(sys.stderr))
    folder = open_run(run) if run is not None and run_exists(run) else create_run(plan.deployment.world, run)
    settings, records = (
        plan.settings(folder.name, is_launched=is_launched),
        partial(supervisor_records, folder, plan.options),
    )
    raise typer.Exit(serve(settings, plan.address, plan.options.pki, folder, records, progress_file))


@app.command()
def status(run: Run = None, json: Json = False) -> None:
    """Show the state of a run: time, lag, nodes, links, score."""
    from foosim.common.json_text import encode_json
    from foosim.launcher.display import render_text

    content = _control().status(run)
    print(encode_json(content).decode() if json else render_text(content).rstrip())


@app.command()
def pause(run: Run = None, json: Json = False) -> None:
    """Pause simulated time, after the ticks that are released already."""
    _show(_control().pause(run), json)


@app.command()
def resume(run: Run = None, json: Json = False) -> None:
    """Continue after a pause."""
    _show(_control().resume(run), json)


@app.command(context_settings={"ignore_unknown_options": True})  # so that a negative number is no option
def step(
    count: Annotated[int, typer.Argument(help="How many ticks.", min=1)] = 1, run: Run = None, json: Json = False
) -> None:
    """Simulate a number of ticks, then pause."""
    _show(_control().step(count, run), json)


@app.command(context_settings={"ignore_unknown_options": True})  # so that a negative number is no option
def rate(
    pace: Annotated[str, typer.Argument(help="realtime, fast, or a factor such as 2x.", show_default=False)],
    run: Run = None,
    json: Json = False,
) -> None:
    """Change how fast simulated time passes."""
    from foosim.common.units import parse_pace

    read_at("foosim-supervisor rate PACE", parse_pace, pace)
    _show(_control().rate(pace, run), json)


Numbers = tuple[float, float, float]
Words = tuple[str, str, str]


@app.command()
def add(
    name: Annotated[str | None, typer.Argument(help="Its name; by default the next free one.")] = None,
    position: Annotated[Words | None, typer.Option(metavar="X Y Z", help="Where, in m.")] = None,
    velocity: Annotated[Words | None, typer.Option(metavar="X Y Z", help="How fast, in m/s.")] = None,
    model: Annotated[str | None, typer.Option(help="Of which model; by default the first that can be added.")] = None,
    run: Run = None,
    json: Json = False,
) -> None:
    """Add an entity to the world; by default it rests where the first one of its model starts."""
    place = None if position is None else _three("position", "m", position)
    speed = None if velocity is None else _three("velocity", "m/s", velocity)
    _show(_control().add(name, place, speed, run, model), json)


@app.command()
def remove(
    name: Annotated[str, typer.Argument(help="Which entity.", show_default=False)], run: Run = None, json: Json = False
) -> None:
    """Remove an entity that was added."""
    _show(_control().remove(name, run), json)


@app.command()
def move(
    robot: Annotated[str, typer.Argument(help="Which robot.", show_default=False)],
    node: Annotated[str, typer.Argument(help="To which node.", show_default=False)],
    run: Run = None,
    json: Json = False,
) -> None:
    """Move a robot to another node; the world stays the same."""
    _show(_control().move(robot, node, run), json)


@app.command()
def balance(run: Run = None, json: Json = False) -> None:
    """Move robots from busy nodes to idle ones, once; prints the robots and the loads."""
    _show(_control().balance(run), json)


Node = Annotated[str, typer.Argument(help="Which node.", show_default=False)]


@app.command()
def stop(node: Node, run: Run = None, json: Json = False) -> None:
    """Stop a node, after its robots have moved to the other nodes."""
    _show(_control().stop(node, run), json)


@app.command()
def start(node: Node, run: Run = None, json: Json = False) -> None:
    """Start a node that was stopped, or that its launcher has given up; its robots move back.

    `up` starts the process of a local node and counts its failures anew. A node with `launch: manual` is started by
    hand.
    """
    _show(_control().start(node, run), json)


@app.command(context_settings={"ignore_unknown_options": True})  # so that a negative number is no option
def push(
    impulse: Annotated[
        list[str], typer.Argument(metavar="X Y Z", help="Impulse in N s along x, y and z.", show_default=False)
    ],
    name: Annotated[str | None, typer.Option(help="Which free body; by default the first by name.")] = None,
    run: Run = None,
    json: Json = False,
) -> None:
    """Apply an impulse to a free body.

    An impulse of 0.021 N s changes the velocity of a body of 21 g by 1 m/s.
    """
    _show(_control().push(_three("impulse", "N s", impulse), name, run), json)


def _three(what: str, unit: str, words: Sequence[str]) -> Numbers:
    """Return three numbers; raises BadValue with what the numbers are, which typer's message lacks."""
    needed = f"{what}: three numbers are needed, X Y Z in {unit}"
    if len(words) != 3:
        raise BadValue(f"{needed}; here are {len(words)}", " ".join(words))
    try:
        x, y, z = map(float, words)
    except ValueError:
        raise BadValue(f"{needed}; not all of these are numbers", " ".join(words)) from None
    return x, y, z


@app.command()
def down(run: Run = None, json: Json = False) -> None:
    """End a run in order."""
    _show(_control().down(run), json)


def _control() -> ModuleType:
    """Return the functions that connect to a run."""
    from foosim.client import control

    return control


def _show(answer: Answer, json: bool) -> None:
    """Print the supervisor's answer."""
    from foosim.common.json_text import encode_json

    print(encode_json({"tick": answer.tick, "text": answer.text}).decode() if json else answer.text)


@app.command()
@with_options("file", "sets")
def validate(
    options: RunOptions,
    expanded: Annotated[
        bool, typer.Option("--expanded", help="Print the deployment with its templates, counts and selectors expanded.")
    ] = False,
    json: Json = False,
) -> None:
    """Check a deployment file, with settings if there are any.

    Prints all problems, one a line: file:line:column: problem, value, nearest valid name. When there are none, the
    classes of the players on this machine are imported.
    """
    from foosim.common.json_text import encode_json
    from foosim.deployment.loader import expanded_text
    from foosim.launcher.plan import check_players_here, make_plan
    from foosim.vhub.links.packet_sizes import warnings_of

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
    for warning in warnings_of(deployment):
        typer.echo(f"{options.file}: warning: {warning}", err=True)
    described = f"{len(deployment.robots)} robots on {len(deployment.nodes)} nodes, {len(deployment.players)} players"
    print(encode_json(content).decode() if json else f"{options.file}: valid, world {deployment.world}, {described}")


@app.command()
def check_component(
    name: Annotated[str, typer.Argument(metavar="NAME", help="A name, 'FORM NAME', or module:Class.")],
    file: Annotated[Path, typer.Option("--in", help="A deployment that uses it.")],
    sets: Annotated[list[str] | None, typer.Option("--set", help="Change the deployment; may be repeated.")] = None,
    ticks: Annotated[int, typer.Option(min=20, help="How many ticks each rehearsal has.")] = 500,
    seed: Annotated[int, typer.Option(min=0, help="Draws which robots move when.")] = 1,
) -> None:
    """Check that a form obeys the laws, in a deployment that uses it.

    Rehearses on one, two and three nodes with moved robots and objects made anew, in another process, with all named
    in another order, beside a robot that does nothing and beside a second one of each sensor; compares sensors alone
    with many at once. Prints what differs, with tick and slot. On a terminal, standard error has the rehearsal that it
    is in.

    Exit codes: 0 nothing differs, 1 something does, 2 bad input, 130 Ctrl-C.
    """
    from foosim.cli import rehearse
    from foosim.deployment.loader import apply_sets
    from foosim.deployment.text.files import read_source_file

    text = apply_sets(read_source_file(file), str(file), sets or [])
    raise typer.Exit(rehearse.check_component(text, file, name, ticks, seed))


@app.command()
def components(
    form: Annotated[
        str | None, typer.Argument(metavar="FORM", help="model, sensor, rule, kit or another form.")
    ] = None,
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="One of them, or module:Class.")] = None,
    json: Json = False,
) -> None:
    """Show the models, sensors, rules and other forms that a deployment can name on this machine.

    They are foosim's own and those of installed packages (entry points of the group `foosim.world`). With a name:
    settings with their units, limits and defaults, the fields of its readings or commands, what it remembers and
    writes, and what a model or kit brings.
    """
    from foosim.cli.components import as_json, chosen, line, lines
    from foosim.common.json_text import encode_json

    with redirect_stdout(sys.stderr):  # what modules print is no result
        found = chosen(form, name)
    if json:
        print(encode_json([as_json(component) for component in found]).decode())
        return
    for component in found:
        print(*([line(component)] if name is None else lines(component)), sep="\n")


@app.command()
def inspect(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A URDF file.")],
    assets: Annotated[
        Path | None, typer.Option(help="The asset folder, which has its meshes; by default that of FILE.")
    ] = None,
    json: Json = False,
) -> None:
    """Show the robot in a URDF file: its tree with joints, limits, masses and shapes, and what a deployment says of it.

    The file is read as by a run, which refuses the same: what is shown is what is simulated. What is passed over is
    noted.
    """
    from foosim.common.json_text import encode_json
    from foosim.deployment.assets import read_robot
    from foosim.world.bodies.urdf_text import as_json, lines

    robot = read_robot(file, assets)
    if json:
        print(encode_json(as_json(robot)).decode())
    else:
        print(*lines(robot), sep="\n")


@app.command()
def schema(
    own: Annotated[bool, typer.Option("--own", help="Leave out what other packages bring.")] = False,
) -> None:
    """Print the JSON Schema of deployment files, with the components of all installed packages.

    Editors that know JSON Schema complete and check a file whose first line names it:
    `# yaml-language-server: $schema=FILE`.
    """
    from foosim.deployment.json_schema import deployment_schema_text

    with redirect_stdout(sys.stderr):  # what modules print is no result
        text = deployment_schema_text(installed=not own)
    print(text, end="")


def _refuse_usage(words: Sequence[str], problem: BadUsage) -> None:
    """Print the JSON object of `up --json` when its options are invalid, too."""
    if words[:1] == ["up"]:
        from foosim.launcher.outcome import refused_result

        _print_result(refused_result(None, None, str(problem)), "--json" in words)


def main() -> None:
    """Entry of `foosim-supervisor`."""
    run_app(app, "foosim-supervisor", _refuse_usage)


if __name__ == "__main__":
    main()
