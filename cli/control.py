"""The verbs that control a live run, from this terminal or another machine: shells over `client.control`."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Annotated, Any

import typer

from foosim.client import control
from foosim.common.errors import BadValue, read_at
from foosim.common.units import parse_pace
from foosim.protocol.messages import Answer
from foosim.runtime.command import JsonOption, RunOption, new_app, print_json
from foosim.runtime.run_folder import find_run

app = new_app()


@app.command()
def status(run: RunOption = None, json: JsonOption = False) -> None:
    """Show the state of a run: time, lag, nodes, links, score, programs at gateways."""
    from foosim.launcher.display import render_text

    gateways = find_run(run).gateways()
    content = {**control.status(run), "gateways": gateways}
    if json:
        print_json(content)
        return
    print(render_text(content).rstrip())
    for name, gateway in gateways.items():
        programs = gateway["programs"]
        rate_hz = sum(one["hz"] for one in programs)
        print(f"gateway {name}: {gateway['at']}, {len(programs)} connections, {rate_hz:.0f} messages/s")


@app.command()
def pause(run: RunOption = None, json: JsonOption = False) -> None:
    """Pause simulated time, after the ticks that are released already."""
    show_answer(control.request("pause", run), json)


@app.command()
def resume(run: RunOption = None, json: JsonOption = False) -> None:
    """Continue after a pause."""
    show_answer(control.request("resume", run), json)


@app.command(context_settings={"ignore_unknown_options": True})  # so that a negative number is no option
def step(
    count: Annotated[int, typer.Argument(help="How many ticks.", min=1)] = 1,
    run: RunOption = None,
    json: JsonOption = False,
) -> None:
    """Simulate a number of ticks, then pause."""
    show_answer(control.request("step", run, count=count), json)


@app.command(context_settings={"ignore_unknown_options": True})  # so that a negative number is no option
def rate(
    pace: Annotated[str, typer.Argument(help="realtime, fast, or a factor such as 2x.")],
    run: RunOption = None,
    json: JsonOption = False,
) -> None:
    """Change how fast simulated time passes."""
    read_at("foosim rate PACE", parse_pace, pace)
    show_answer(control.request("rate", run, pace=pace), json)


Numbers = tuple[float, float, float]


@app.command()
def add(
    name: Annotated[str, typer.Argument(metavar="ENTITY", help="A spare, or a fleet: then its first spare.")],
    at: Annotated[str | None, typer.Option(metavar="X,Y[,Z]", help="Where, in m; else where it is declared.")] = None,
    yaw: Annotated[str | None, typer.Option(metavar="ANGLE", help="Its heading, such as `90 deg`.")] = None,
    node: Annotated[str | None, typer.Option(help="The node that owns it from now on; of robots.")] = None,
    run: RunOption = None,
    json: JsonOption = False,
) -> None:
    """Add a spare of the deployment to the world."""
    place = None if at is None else _read_value(at)
    if yaw is not None:
        from foosim.world.setting.settable import read_place

        place = {**(read_place(place) if isinstance(place, str) else place or {}), "yaw": yaw}
    show_answer(control.request("add", run, name=name, at=place, node=node), json)


@app.command()
def remove(
    name: Annotated[str, typer.Argument(help="Which entity.")],
    run: RunOption = None,
    json: JsonOption = False,
) -> None:
    """Remove an entity from the world; it can be added again."""
    show_answer(control.request("remove", run, name=name), json)


@app.command()
def move(
    robot: Annotated[str, typer.Argument(help="Which robot.")],
    node: Annotated[str, typer.Argument(help="To which node.")],
    run: RunOption = None,
    json: JsonOption = False,
) -> None:
    """Move a robot to another node; the world stays the same."""
    show_answer(control.request("move", run, robot=robot, node=node), json)


@app.command()
def balance(run: RunOption = None, json: JsonOption = False) -> None:
    """Move robots from busy nodes to idle ones, once; prints the robots and the loads."""
    show_answer(control.request("balance", run), json)


Node = Annotated[str, typer.Argument(help="Which node.")]


@app.command()
def stop(node: Node, run: RunOption = None, json: JsonOption = False) -> None:
    """Stop a node, after its robots have moved to the other nodes."""
    show_answer(control.request("stop", run, node=node), json)


@app.command()
def start(node: Node, run: RunOption = None, json: JsonOption = False) -> None:
    """Start a node that was stopped, or that its launcher has given up; its robots move back.

    `up` starts the process of a local node and counts its failures anew. A node with `launch: manual` is started by
    hand.
    """
    show_answer(control.request("start", run, node=node), json)


@app.command(context_settings={"ignore_unknown_options": True})  # so that a negative number is no option
def push(
    impulse: Annotated[list[str], typer.Argument(metavar="X Y Z", help="Impulse in N s along x, y and z.")],
    name: Annotated[str | None, typer.Option(help="Which free body; by default the first by name.")] = None,
    run: RunOption = None,
    json: JsonOption = False,
) -> None:
    """Apply an impulse to a free body.

    An impulse of 0.021 N s changes the velocity of a body of 21 g by 1 m/s.
    """
    show_answer(control.request("push", run, impulse=_three("impulse", "N s", impulse), name=name), json)


@app.command(name="set")
def set_field(
    name: Annotated[str, typer.Argument(metavar="ENTITY", help="Which entity.")],
    setting: Annotated[str, typer.Argument(metavar="FIELD=VALUE", help="What, and to which value.")],
    run: RunOption = None,
    json: JsonOption = False,
) -> None:
    """Set a field of an entity, e.g. `crate-1 at=3,1` or `scout down=true`.

    Fields: `at` is a pose, X,Y or X,Y,Z in m, or a mapping such as "{x: 3 m, yaw: 90 deg}"; what it does not say stays
    as it is. `down` is whether a robot is out of service. `RULE.FIELD` is what `foosim components` shows as "can
    be set".
    """
    field, is_set, text = setting.partition("=")
    if not is_set:
        raise BadValue("no FIELD=VALUE, such as down=true", setting)
    show_answer(control.request("set", run, name=name, field=field, value=_read_value(text)), json)


def _read_value(text: str) -> Any:
    """Return true, false and mappings as YAML has them, anything else as it is."""
    import yaml

    if text not in ("true", "false") and not text.startswith("{"):
        return text
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise BadValue(f"no mapping: {error}".partition("\n")[0], text) from None


def _three(what: str, unit: str, words: Sequence[str]) -> Numbers:
    """Return three numbers; raises BadValue with what the numbers are, which typer's message lacks."""
    needed = f"{what}: three numbers are needed, X Y Z in {unit}"
    if len(words) != 3:
        raise BadValue(f"{needed}; here are {len(words)}", " ".join(words))
    try:
        x, y, z = map(float, words)
        if not isfinite(x + y + z):
            raise ValueError
    except ValueError:
        raise BadValue(f"{needed}; not all are finite numbers", " ".join(words)) from None
    return x, y, z


@app.command()
def down(run: RunOption = None, json: JsonOption = False) -> None:
    """End a run in order."""
    show_answer(control.request("down", run), json)


def show_answer(answer: Answer, json: bool) -> None:
    """Print the supervisor's answer."""
    if json:
        print_json({"tick": answer.tick, "text": answer.text})
    else:
        print(answer.text)
