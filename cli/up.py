"""The verb `up`: a shell over `launcher.begin`.

It imports what it calls once signals are noted, so that it leaves a result whatever ends it.
"""

from __future__ import annotations

import sys
from collections.abc import Collection
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from foosim.cli.run_command import with_options
from foosim.common.errors import BadValue, Failed, Refused
from foosim.launcher.run_options import RunOptions
from foosim.runtime.command import DONE, FAILED, INTERRUPTED, JsonOption, NewRunOption, new_app, print_json
from foosim.runtime.early_signals import interrupting_signals, raise_noted

if TYPE_CHECKING:
    from foosim.launcher.outcome import Outcome
    from foosim.launcher.up import Up

app = new_app()

ConsoleOption = Annotated[bool, typer.Option("--console", help="Serve the console of the run; its address is printed.")]
Second = Annotated[
    Path | None,
    typer.Option(metavar="CAPTURE|CSV", help="A recording that the console shows beside the run."),
]
Offset = Annotated[str | None, typer.Option(help="Time in --second at time 0 of the run, e.g. 2.5s or -1s.")]
BESIDE_RESUME: Final = ("resumed", "console", "open_browser", "second", "offset", "pki", "json")
"""The options that `up --resume` accepts; it reads all others from the run."""


@app.command()
@with_options()
def up(  # noqa: PLR0913, PLR0917  # a command's options
    context: typer.Context,
    options: RunOptions | None = None,
    capture: Annotated[
        Path | None, typer.Option(help="The capture to write; by default captures/WORLD-TIME.mcap.")
    ] = None,
    no_capture: Annotated[bool, typer.Option("--no-capture", help="Write no capture.")] = False,
    run: NewRunOption = None,
    detached: Annotated[bool, typer.Option("--detach", help="Run in the background; `down` ends it.")] = False,
    resumed: Annotated[str | None, typer.Option("--resume", help="Resume this run, whose launcher died.")] = None,
    console: ConsoleOption = False,
    open_browser: Annotated[bool, typer.Option("--open", help="As --console, and open the page in a browser.")] = False,
    second: Second = None,
    offset: Offset = None,
    json: JsonOption = False,
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
        from foosim.launcher.begin import begin, resume_run
        from foosim.launcher.console_child import page_of
        from foosim.launcher.display import Display, unfailing_output
        from foosim.launcher.outcome import Outcome
        from foosim.runtime.run_folder import open_run

        context.with_resource(unfailing_output())
        display = Display(sys.stderr if json else sys.stdout)
        page = page_of(console, open_browser, second, offset, detached)
        if resumed is not None:
            if given := _given(context, but=BESIDE_RESUME):
                raise BadValue(f"--resume takes FILE and options from the run, it goes without {', '.join(given)}")
            begun = resume_run(open_run(resumed), display, page)
        elif options is None:
            raise BadValue("a deployment FILE is needed, such as deploy/table.yaml, or --resume RUN")
        elif no_capture and capture is not None:
            raise BadValue("--capture and --no-capture exclude each other", str(capture))
        else:
            begun = begin(options, capture, not no_capture, run, detached, display, page)
        outcome = begun if isinstance(begun, Outcome) else begun.run()
    except (Refused, MemoryError, KeyboardInterrupt) as error:
        from foosim.launcher.outcome import Outcome, refused_result

        reason = "too little memory" if isinstance(error, MemoryError) else str(error)
        if begun is None or isinstance(begun, Outcome):
            _print_result(refused_result(resumed, run, reason), json)
        else:
            _print_result(begun.unended(reason), json)
        if isinstance(error, KeyboardInterrupt):
            raise Failed(reason) from None  # a signal before the run began
        raise
    say = partial(print, file=sys.stderr) if outcome.is_killed else display.say
    for line in outcome.lines:
        say(line)
    _print_result(outcome.result, json)
    raise typer.Exit(INTERRUPTED if outcome.is_killed else FAILED if outcome.failed else DONE)


def _given(context: typer.Context, but: Collection[str]) -> list[str]:
    """Return the parameters given on the command line, as they are typed, without those named in `but`."""
    return [
        parameter.opts[0] if parameter.param_type_name == "option" else str(parameter.metavar)
        for parameter in context.command.params
        if (source := context.get_parameter_source(parameter.name or "")) is not None and source.name == "COMMANDLINE"
        if parameter.name not in but
    ]


def _print_result(result: dict[str, Any], json: bool) -> None:
    if json:
        print_json(result)
