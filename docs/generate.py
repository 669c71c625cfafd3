"""Writes the generated parts of the docs, and the schema of deployments: `python docs/generate.py`.

A generated part is between the comments `<!-- generated: NAME -->` and `<!-- end -->` of a page in this folder. Its
sources are the deployment's schema, the commands' options, the table of channels, and the rows of a capture.
tests/test_readme.py fails when a page and the code differ.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import partial
from importlib import import_module
from itertools import takewhile
from pathlib import Path
from typing import Any, Final

from typer.core import TyperGroup

from foosim.capture.rows import ROW_TYPES, json_schema
from foosim.cli.verbs import Foosim
from foosim.common import limits, units
from foosim.deployment.json_schema import deployment_schema, deployment_schema_text
from foosim.gateways.table import ROWS
from foosim.protocol.channels import CHANNELS
from foosim.runtime.command import shown_argument

DOCS: Final = Path(__file__).parent
DEADLINES: Final[Mapping[str, tuple[str, str]]] = {
    "heartbeat": ("supervisor", "a message of a node or the vHub; a process that is silent for longer is lost"),
    "tick_named": ("supervisor", "the parts or deliveries of a tick; then the log names the missing process"),
    "tick_lost": ("supervisor", "the same; then the missing process is lost"),
    "lockstep_fast": ("vHub", "a lockstep client's answer, in `fast`; then the client is lost"),
    "lockstep_realtime": (
        "vHub",
        "the same at any other pace; it is longer than a cut connection takes to close",
    ),
    "start": (
        "supervisor, `up`",
        "the processes and players of a started or resumed run; until its first commit no other deadline counts. "
        "Before that, the import of players' modules",
    ),
    "orphan": (
        "nodes, vHub",
        "the return of a lost supervisor; then they end, and the run can be resumed. Where it is not given, it is at "
        "least `start` and the longest pause before a restart",
    ),
    "vhub_back": (
        "supervisor, clients",
        "the return of a lost vHub; then the run, or the client, ends. Where it is not given, as `orphan`",
    ),
    "client_back": (
        "vHub",
        "the return of a client after its connection has closed; then it is lost, unless its time to answer ends later",
    ),
    "close": (
        "supervisor",
        "progress of the vHub in closing its capture; then the capture is cut off. During the run, a vHub that waits "
        "for the disk of its capture; then it is lost",
    ),
}
"""The deadlines of a deployment: the waiting process, and the event that it waits for."""
CONSTANTS: Final[Mapping[tuple[str, str], tuple[str, str]]] = {
    ("runtime.transport.settings", "LEASE_MS"): ("every process", "a message on a connection; then it is closed"),
    ("runtime.transport.settings", "BLOCK_US"): (
        "every process",
        "a stuck reader; then its connection is closed",
    ),
    ("runtime.transport.inbox", "ALARM_S"): (
        "every process",
        "the end of its own alarm thread; then it ends without it",
    ),
    ("runtime.roles.standstill", "STOOD_NS"): ("every process", "its own loop; a longer pause is a standstill"),
    ("runtime.roles.standstill", "REPORTED_NS"): (
        "supervisor, vHub",
        "their own loop; a longer standstill is logged, and a closed connection after it is no loss",
    ),
    ("runtime.supervisor_timeout", "UNKNOWN_NS"): (
        "nodes, vHub",
        "the return of a supervisor that was lost before it sent the deployment",
    ),
    ("supervisor.progress", "DOUBT_NS"): (
        "supervisor",
        "connections that close after a standstill of its own: their processes have `heartbeat` for their next message",
    ),
    ("supervisor.progress", "CUT_SEEN_NS"): (
        "supervisor",
        "the end of the vHub's connection, before nodes are lost whose samples were sent and did not reach it",
    ),
    ("supervisor.roster", "IN_FLIGHT_NS"): ("supervisor", "the last messages of a process whose connection has closed"),
    ("supervisor.roster", "SILENT_NS"): (
        "supervisor",
        "a message; until then the hello of a successor is refused, afterwards it waits for the connection's end",
    ),
    ("supervisor.failover", "REJOIN_NS"): (
        "supervisor",
        "the nodes, after its restart, in addition to `heartbeat`; then it continues without them",
    ),
    ("launcher.liveness", "QUESTION_S"): (
        "`up`",
        "an answer of the supervisor; after five missing ones in a row, by the clock of its process, it is killed and "
        "started again",
    ),
    ("launcher.liveness", "STALLED_S"): (
        "`up`",
        "the recovery of a lost process that lives; then it is killed",
    ),
    ("launcher.liveness", "CUT_OFF_S"): ("`up`", "the same on another machine"),
    ("runtime.roles.shell", "LOOK_S"): ("node, player, vHub", "the run file, between two looks at it"),
    ("launcher.liveness", "LOOK_S_MAX"): ("`up`", "its own loop; a longer pause is a standstill"),
    ("launcher.liveness", "WAITS_S"): ("`up`", "before a process that ended is started again, in this order"),
    ("launcher.liveness", "AWAY_S"): ("`up`", "the same if the machine could not be reached"),
    ("launcher.liveness", "WINDOW_S"): ("`up`", "in which one end more than these waits gives a process up"),
    ("launcher.up", "HELD_S"): ("`up`", "the run to come up; lines that wait for the console are shown then"),
    ("launcher.up", "LOST_S"): ("`up`", "the supervisor to detect the end of a process; then the run is ended"),
    ("launcher.up", "END_S"): ("`up`", "the answer of a supervisor to a request to end; then all processes are ended"),
    ("launcher.up", "LEAVE_S"): ("`up`", "the end of the other processes after the supervisor's; then they are ended"),
    ("launcher.up", "AWAY_S"): ("`up`", "the same on other machines"),
    ("launcher.console_child", "LEAVE_S"): ("`up`", "the console to report the end of the run to its pages"),
    ("runtime.process", "GRACE_S"): ("`up`, `foosim guard`", "a process after SIGTERM; then it is killed"),
    ("cli.guard", "TAKE_OVER_S"): ("`foosim guard`", "the end of the previous guard"),
    ("client.control", "CONNECT_S"): ("commands", "a connection to the supervisor; then they fail"),
    ("client.control", "ANSWER_S"): ("commands", "an answer of the supervisor; then they fail"),
    ("runtime.roles.shell", "CONNECT_S"): (
        "vHub, nodes, players",
        "a supervisor or vHub to connect to; then they fail",
    ),
    ("client.client", "CONNECT_S"): ("`connect` in a program", "the same, by default"),
    ("runtime.transport.admission", "ADMISSION_NS"): (
        "every process",
        "with certificates, its admission; then it ends",
    ),
}
"""The same for constants, whose names end with their units."""
_PART = re.compile(r"<!-- generated: (?P<name>[\w ]+) -->\n(?P<text>.*?)<!-- end -->\n", re.DOTALL)


def commands() -> Iterator[tuple[str, Any]]:
    """Yield every command, such as `foosim capture verify`, as typer knows it; second names are left out."""
    foosim = Foosim(name="foosim")
    names = [*foosim.list_commands(None), *(name for name, verb in foosim.plumbing.items() if ":" not in verb)]
    for name in names:
        yield from _commands_in(f"foosim {name}", foosim.get_command(None, name))


def _commands_in(name: str, command: Any) -> Iterator[tuple[str, Any]]:
    """Yield a command, or those of a group."""
    if not isinstance(command, TyperGroup):
        yield name, command
        return
    for verb in command.list_commands(None):  # type: ignore[arg-type]  # which needs no context
        yield from _commands_in(f"{name} {verb}", command.get_command(None, verb))  # type: ignore[arg-type]


def write_commands() -> Iterator[str]:
    """Yield a section for each command: description, arguments and options."""
    for name, command in commands():
        words = [shown_argument(parameter) for parameter in command.params if parameter.param_type_name == "argument"]
        yield f"### `{' '.join([name, *words])}`\n\n"
        yield re.sub(r"(?m)^ +", "", command.help.strip()) + "\n\n"
        options = [p for p in command.params if p.param_type_name == "option" and not p.hidden]
        if options:
            yield "| option | |\n|---|---|\n"
        for option in options:
            required = " Required." if option.required else ""
            value = "" if option.is_flag else f" {option.metavar}"
            yield f"| `{' '.join(option.opts)}{value}` | {_cell(option.help or '')}{required} |\n"
        yield "\n" if options else ""


SECTIONS: Final[Mapping[str, Sequence[str]]] = {
    "network": ("network",),
    "kits": ("table", "hall"),
    "components": ("sensors", "actuators"),
    "entities": ("robots", "objects", "scenery", "scene", "rules", "surfaces", "physics", "origin", "events"),
    "file": (),
}
"""Pages of the deployment's reference, by the keys whose values they describe; the last one has the rest."""


def write_deployment(section: str) -> Iterator[str]:
    """Yield a table for each kind of mapping of a section, in the order in which a deployment leads to it."""
    definitions = deployment_schema()["$defs"]
    described = set[str]()
    for name in takewhile(lambda name: name != section, SECTIONS):
        described.update(_reached(name, described))
    for name in _reached(section, described):
        part = deployment_schema() if name == "the file" else definitions[name]
        if "properties" not in part:
            continue
        yield f"### {name[0].upper() + name[1:]}\n\n{part['description']}\n\n| key | value | default |\n|---|---|---|\n"
        for key, value in part["properties"].items():
            default = "required" if key in part.get("required", ()) else _default(value)
            yield f"| `{key}` | {_cell(_value(value))} | {default} |\n"
        yield "\n"


def _reached(section: str, described: Collection[str]) -> list[str]:
    """Return the definitions to which the keys of a section lead, without those of the sections before it."""
    schema = deployment_schema()
    definitions = schema["$defs"]
    keys = SECTIONS[section]
    parts = [schema, *definitions.values()]
    starts = [part["properties"][key] for part in parts for key in keys if key in part.get("properties", {})]
    reached = list(dict.fromkeys(_references(starts))) if keys else ["the file"]
    reached = [name for name in reached if name not in described]
    for name in reached:
        found = _references(schema["properties"] if name == "the file" else definitions[name])
        reached += [one for one in dict.fromkeys(found) if one not in reached and one not in described]
    return reached


def _references(part: object) -> list[str]:
    return re.findall(r"#/\$defs/(\w+)", str(part))


def _default(value: Mapping[str, Any]) -> str:
    default = value.get("default", "")
    return "" if default in ("", None, {}, []) else f"`{str(default).lower() if default in (True, False) else default}`"


def _value(value: Mapping[str, Any]) -> str:  # noqa: PLR0911  # a line for each kind of schema
    """Return the values that a schema accepts, in words."""
    if "$ref" in value:
        name = value["$ref"].rpartition("/")[2]
        return "anything" if name == "JsonValue" else f"see {name}"
    for choice in ("anyOf", "oneOf"):
        if choice in value and "description" not in value:
            return " or ".join(_value(one) for one in value[choice] if one.get("type") != "null")
    if "patternProperties" in value:
        return f"names, each with: {_value(next(iter(value['patternProperties'].values())))}"
    if "additionalProperties" in value:
        names = value.get("propertyNames", {}).get("enum", ())
        inner = value["additionalProperties"]
        return f"{', '.join(f'`{name}`' for name in names) or 'keys'}, each with: {_value(inner)}"
    if "description" in value:
        return str(value["description"]).partition(":")[0]
    if "const" in value:
        return f"`{value['const']}`"
    if "enum" in value:
        return ", ".join(f"`{one}`" for one in value["enum"])
    if value.get("type") == "array":
        return f"a list of: {_value(value['items'])}"
    if "minimum" in value or "maximum" in value:
        whole = "a whole number" if value["type"] == "integer" else "a number"
        return f"{whole}, {value['minimum']} to {value['maximum']}"
    return _TEXTS.get(value.get("title", ""), {"string": "text", "boolean": "`true` or `false`"}[value["type"]])


_TEXTS: Final = {
    "World": "a name",
    "Id": "a name",
    "Pace": "`realtime`, `fast`, or a factor such as `2x`",
    "Class": "`module:Class`",
}


def write_units() -> Iterator[str]:
    """Yield the units of every dimension."""
    yield "| a | is written with |\n|---|---|\n"
    for dimension in vars(units).values():
        if isinstance(dimension, units.Dimension):
            yield f"| {dimension.name} | {', '.join(f'`{unit}`' for unit in dimension.units)} |\n"


def write_channels() -> Iterator[str]:
    """Yield the table of channels."""
    yield "| plane | channel | written by | read by | how often |\n|---|---|---|---|---|\n"
    for channel in CHANNELS:
        plane = channel.plane.name.lower()
        yield f"| {plane} | `{channel.name}` | {channel.writers} | {channel.readers} | {channel.rate} |\n"


def write_rows() -> Iterator[str]:
    """Yield the fields of every kind of row."""
    for topic, kind in ROW_TYPES.items():
        schema = json_schema(kind)
        yield f"### `{topic}`\n\n{_cell(schema['description'])}\n\n| field | type |\n|---|---|\n"
        for name, value in schema["properties"].items():
            yield f"| `{name}` | {_row_type(value)} |\n"
        yield "\n"


def _row_type(value: Mapping[str, Any]) -> str:
    if value["type"] == "array":
        inner = value["items"]
        return f"list of {_row_type(inner)}"
    if value["type"] == "object":
        return "{" + ", ".join(value["properties"]) + "}"
    if "enum" in value:
        return ", ".join(f"`{one}`" for one in value["enum"])
    return "bytes, in base64" if value.get("contentEncoding") == "base64" else str(value["type"])


def write_morse() -> Iterator[str]:
    """The rows of gateways: component types, classes of MORSE, fields, services."""
    yield "| kind | class | fields, in the order of a bottle | services |\n|---|---|---|---|\n"
    for row in ROWS:
        fields = "a field for each joint in the settings" if row.joints else " ".join(row.fields) or "none"
        yield f"| `{row.kind}` | {row.morse} | {fields} | {' '.join(row.services)} |\n"


def write_limits() -> Iterator[str]:
    """Yield the limits by name."""
    yield "| limit | value |\n|---|---|\n"
    for name, value in vars(limits).items():
        if name.isupper():
            yield f"| `{name}` | {'2^63 - 1' if value == limits.COUNTER_MAX else f'{value:,}'} |\n"


def write_deadlines() -> Iterator[str]:
    """Yield the deployment's deadlines, then the constant ones."""
    keys = deployment_schema()["$defs"]["Deadlines"]["properties"]
    assert keys.keys() == DEADLINES.keys(), f"deadlines without a description: {sorted(keys.keys() ^ DEADLINES.keys())}"
    yield "| deadline | time | process | waits for, and consequence |\n|---|---|---|---|\n"
    for key, (who, what) in DEADLINES.items():
        yield f"| `{key}` | `{keys[key]['default']}` | {who} | {what} |\n"
    for (module, name), (who, what) in CONSTANTS.items():
        yield f"| `{module.replace('.', '/')}.py:{name}` | {_time(module, name)} | {who} | {what} |\n"


def _time(module: str, name: str) -> str:
    """Return the value of a constant whose name ends with its unit."""
    value = getattr(import_module(f"foosim.{module}"), name)
    unit = name.removesuffix("_MAX").rpartition("_")[2]
    seconds = [
        each / {"S": 1, "MS": 1e3, "US": 1e6, "NS": 1e9}[unit] for each in (value if type(value) is tuple else [value])
    ]
    return ", ".join(f"{each:g}" for each in seconds) + " s"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


WRITERS: Final[Mapping[str, Callable[[], Iterator[str]]]] = {
    "commands": write_commands,
    **{f"deployment {section}": partial(write_deployment, section) for section in SECTIONS},
    "units": write_units,
    "channels": write_channels,
    "rows": write_rows,
    "morse": write_morse,
    "limits": write_limits,
    "deadlines": write_deadlines,
}


def regenerated(page: str) -> str:
    """Return a page with its generated parts written anew."""

    def write(match: re.Match[str]) -> str:
        name = match["name"]
        return f"<!-- generated: {name} -->\n{''.join(WRITERS[name]()).rstrip()}\n<!-- end -->\n"

    return _PART.sub(write, page)


if __name__ == "__main__":
    for path in sorted(DOCS.rglob("*.md")):
        path.write_text(regenerated(path.read_text()))
    (DOCS.parent / "deploy" / "deployment.schema.json").write_text(deployment_schema_text())
