"""The processes that the files in deploy/ start, read from them as the programs read them that those files are for."""

from __future__ import annotations

import configparser
import re
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import yaml

DEPLOY: Final = Path(__file__).parents[2] / "deploy"
UNITS: Final = DEPLOY / "systemd"
INSTANCES: Final = {"foosim-node@": ("red", "blue"), "foosim-player@": ("player-red", "player-blue")}
"""Of a template of a unit: the instances that the table needs, as the header of the supervisor's unit starts them."""


@dataclass(frozen=True, slots=True)
class Declared:
    """One process: its name in the run, its command line, and the command of its probe, if it has one."""

    name: str
    command: tuple[str, ...]
    probe: tuple[str, ...] = ()


def compose() -> dict[str, Any]:
    """Return the compose file."""
    content = yaml.safe_load((DEPLOY / "compose.yaml").read_text())
    assert isinstance(content, dict)
    return content


def from_compose() -> list[Declared]:
    """Return one process for each service, variables by their defaults."""
    found = []
    for name, it in compose()["services"].items():
        words = [re.sub(r"\$\{\w+:-([^}]*)\}", r"\1", word) for word in it["command"]]
        found.append(Declared(name, tuple(words), tuple(it["healthcheck"]["test"][1:])))
    return found


def objects() -> list[dict[str, Any]]:
    """Return the objects of the Kubernetes example."""
    return list(yaml.safe_load_all((DEPLOY / "kubernetes.yaml").read_text()))


def from_kubernetes() -> list[Declared]:
    """Return one process for each pod, as Kubernetes names pods and expands $(VARIABLE)."""
    found = []
    for it in objects():
        if it["kind"] not in ("Job", "StatefulSet"):
            continue
        name, replicas = it["metadata"]["name"], it["spec"].get("replicas", 1)
        (container,) = it["spec"]["template"]["spec"]["containers"]
        fields = {
            entry["name"]: entry["valueFrom"]["fieldRef"]["fieldPath"]
            for entry in container.get("env", ())
            if "valueFrom" in entry
        }
        for number in range(replicas):
            pod = name if it["kind"] == "Job" else f"{name}-{number}"
            values = {variable: {"metadata.name": pod}[path] for variable, path in fields.items()}
            command = [expanded(word, r"\$\((\w+)\)", values) for word in container["command"]]
            probes = {tuple(container[probe]["exec"]["command"]) for probe in ("startupProbe", "livenessProbe")}
            (probe,) = probes
            found.append(Declared(pod, tuple(command), probe))
    return found


def expanded(word: str, variable: str, values: dict[str, str]) -> str:
    """Return a word with its variables, which a pattern finds, replaced."""
    return re.sub(variable, lambda found: values[found[1]], word)


def unit(path: Path) -> configparser.ConfigParser:
    """Return a unit file."""
    parser = configparser.ConfigParser(interpolation=None, strict=True)
    parser.optionxform = str  # type: ignore[assignment,method-assign]  # names of a unit's settings have capitals
    parser.read_string(path.read_text())
    return parser


def environment() -> dict[str, str]:
    """Return what the units' environment file sets."""
    lines = [line for line in (UNITS / "foosim.env").read_text().splitlines() if line and not line.startswith("#")]
    return dict(line.split("=", 1) for line in lines)


def from_units() -> list[Declared]:
    """Return one process for each unit, as systemd expands %i, ${VARIABLE} (one word) and $VARIABLE (its words)."""
    found, variables = [], environment()
    for path in sorted(UNITS.glob("*.service")):
        for instance in INSTANCES.get(path.stem, ("",)):
            line = unit(path)["Service"]["ExecStart"].replace("%i", instance)
            words: list[str] = []
            for word in shlex.split(line):
                if re.fullmatch(r"\$\w+", word):
                    words += variables[word[1:]].split()
                else:
                    words.append(expanded(word, r"\$\{(\w+)\}", variables))
            name = instance or path.stem.removeprefix("foosim-")
            found.append(Declared(name, (Path(words[0]).name, *words[1:])))
    return found
