"""The files in deploy/: they parse, say how to use them, and fit together with each other and with the commands.

tests/wire/test_deploy_files.py starts the processes that they declare.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import pytest
import typer.main
from typer.core import TyperGroup

from foosim.cli.verbs import app
from foosim.deployment.loader import load_deployment
from tests.deploy.processes import (
    DEPLOY,
    INSTANCES,
    UNITS,
    Declared,
    compose,
    environment,
    from_compose,
    from_kubernetes,
    from_units,
    objects,
    unit,
)

ROOT: Final = DEPLOY.parent
USED_BY: Final = {
    "Dockerfile": "docker build",
    "compose.yaml": "docker compose --file deploy/compose.yaml up",
    "kubernetes.yaml": "kubectl --namespace foosim apply --filename deploy/kubernetes.yaml",
    "systemd/foosim-supervisor.service": "systemctl start --no-block foosim-supervisor",
    "systemd/foosim-vhub.service": "see foosim-supervisor.service",
    "systemd/foosim-node@.service": "systemctl start foosim-node@red",
    "systemd/foosim-player@.service": "systemctl start foosim-player@player-red",
    "systemd/foosim.env": "copy it to /etc/foosim/foosim.env",
}


@pytest.mark.parametrize("file", USED_BY)
def test_each_file_says_how_to_use_it(file: str) -> None:
    lines = (DEPLOY / file).read_text().splitlines()
    header = lines[: next(index for index, line in enumerate(lines) if not line.startswith("#"))]
    text = " ".join(line.lstrip("# ") for line in header)
    assert USED_BY[file] in text
    for path in re.findall(r"(?<![\w/])deploy/[\w./*-]+\w", text):
        assert list(ROOT.glob(path)), path


def test_nothing_in_the_folder_is_unchecked() -> None:
    files = {path.relative_to(DEPLOY).as_posix() for path in DEPLOY.rglob("*") if path.is_file()}
    generated_or_deployment = {file for file in files if file.endswith(".schema.json") or is_deployment(DEPLOY / file)}
    of_robots = {file for file in files if file.startswith("models/")}  # tests/whole_worlds.py has them
    assert files - generated_or_deployment - of_robots == {*USED_BY, "Dockerfile.dockerignore"}


def is_deployment(path: Path) -> bool:
    """Whether this is a deployment file, which has tests of its own."""
    return path.suffix == ".yaml" and "\nformat: 2\n" in path.read_text()


# --- commands --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("declared", [from_compose, from_kubernetes, from_units])
def test_commands_and_options_exist(declared: Callable[[], list[Declared]]) -> None:
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]
    for process in declared():
        for words in filter(None, (process.command, process.probe)):
            assert words[0] in scripts
            command: Any = typer.main.get_command(app)
            arguments = list(words[1:])
            while isinstance(command, TyperGroup):
                _, command, arguments = command.resolve_command(typer.Context(command), arguments)
            assert not command.make_context(words[0], arguments).args, words


@pytest.mark.parametrize("declared", [from_compose, from_kubernetes])
def test_probes_ask_the_file_that_the_process_writes(declared: Callable[[], list[Declared]]) -> None:
    for process in declared():
        written = process.command[process.command.index("--progress-file") + 1]
        assert process.probe[:3] == ("foosim", "probe", written)


def test_there_is_a_process_for_everything_that_the_table_declares() -> None:
    table = load_deployment((DEPLOY / "table.yaml").read_text(), "table.yaml")
    wanted = {"supervisor", "vhub", *table.nodes, *table.players}
    assert {process.name for process in from_compose()} == {process.name for process in from_units()} == wanted
    assert len(from_kubernetes()) == len(wanted)


# --- compose ---------------------------------------------------------------------------------------------------------


def test_only_the_vhub_is_in_both_networks() -> None:
    content = compose()
    plane = {name: set(service["networks"]) for name, service in content["services"].items()}
    assert plane.pop("vhub") == {"simulation", "radio"}
    for process in from_compose():
        if process.name != "vhub":
            assert plane[process.name] == {"radio" if process.command[2] == "player" else "simulation"}
    assert all(network["internal"] for network in content["networks"].values())
    assert not any("ports" in service for service in content["services"].values())


def test_volumes_are_declared() -> None:
    content = compose()
    used = {volume.split(":")[0] for service in content["services"].values() for volume in service.get("volumes", ())}
    assert used == set(content["volumes"])


# --- the image -------------------------------------------------------------------------------------------------------


def test_the_image_is_made_of_what_there_is_and_of_all_packages() -> None:
    lines = (DEPLOY / "Dockerfile").read_text().replace("\\\n", " ").splitlines()
    copied = [line.split()[1:-1] for line in lines if line.startswith("COPY ") and "--from" not in line]
    sources = {source for words in copied for source in words}
    assert not [source for source in sources if not (ROOT / source).exists()]
    packages = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-dir"].values()
    assert sources >= {*packages, "pyproject.toml", "setup.py", "README.md", "LICENSE"}
    let_in = {line[1:] for line in (DEPLOY / "Dockerfile.dockerignore").read_text().splitlines() if line[:1] == "!"}
    assert let_in == sources
    instructions = {line.split()[0] for line in lines if line and not line.startswith(("#", " "))}
    assert instructions == {"FROM", "WORKDIR", "COPY", "RUN", "ENV", "USER"}
    assert [line for line in lines if line.startswith("USER")] == ["USER foosim"]


def test_containers_write_only_where_the_image_lets_them() -> None:
    (made,) = re.findall(r"--uid (\d+)", (DEPLOY / "Dockerfile").read_text())
    assert all(f"uid={made}" in service["tmpfs"][0] for service in compose()["services"].values())
    pods = [it["spec"]["template"]["spec"] for it in objects() if it["kind"] in ("Job", "StatefulSet")]
    assert {pod["securityContext"]["runAsUser"] for pod in pods} == {int(made)}


# --- Kubernetes ------------------------------------------------------------------------------------------------------


def test_pods_are_found_by_services_and_policies_and_have_their_volumes() -> None:
    found = {(it["kind"], it["metadata"]["name"]): it["spec"] for it in objects()}
    assert len(found) == len(objects())
    pods = {name: spec["template"] for (kind, name), spec in found.items() if kind in ("Job", "StatefulSet")}
    for (kind, name), spec in found.items():
        if kind == "Service":
            assert matched(pods, spec["selector"]) == [name]
            ports = [port["port"] for port in spec.get("ports", ())]
            container = pods[name]["spec"]["containers"][0]
            assert ports == [port["containerPort"] for port in container.get("ports", ())]
            assert all(any(word.endswith(f":{port}") for word in container["command"]) for port in ports)
        elif kind == "StatefulSet":
            assert ("Service", spec["serviceName"]) in found
            assert spec["selector"]["matchLabels"].items() <= spec["template"]["metadata"]["labels"].items()
    for template in pods.values():
        volumes = {volume["name"]: volume for volume in template["spec"]["volumes"]}
        assert {mount["name"] for mount in template["spec"]["containers"][0]["volumeMounts"]} == set(volumes)
        for volume in volumes.values():
            if "persistentVolumeClaim" in volume:
                assert ("PersistentVolumeClaim", volume["persistentVolumeClaim"]["claimName"]) in found


def test_the_policies_let_each_plane_in_and_nobody_else() -> None:
    found = {it["metadata"]["name"]: it["spec"] for it in objects() if it["kind"] == "NetworkPolicy"}
    pods = {it["metadata"]["name"]: it["spec"]["template"] for it in objects() if it["kind"] in ("Job", "StatefulSet")}
    for policy, guarded, let_in in (
        ("simulation-plane", ["supervisor"], ["node", "supervisor", "vhub"]),
        ("radio-plane", ["vhub"], ["player-blue", "player-red"]),
    ):
        assert matched(pods, found[policy]["podSelector"]["matchLabels"]) == guarded
        (rule,) = found[policy]["ingress"]
        assert matched(pods, rule["from"][0]["podSelector"]["matchLabels"]) == let_in


def matched(pods: dict[str, Any], labels: dict[str, str]) -> list[str]:
    """The pods that have these labels, in name order."""
    return sorted(name for name, pod in pods.items() if labels.items() <= pod["metadata"]["labels"].items())


# --- systemd ---------------------------------------------------------------------------------------------------------


def test_units_use_every_variable_and_start_again_what_failed() -> None:
    text = "".join(path.read_text() for path in UNITS.glob("*.service"))
    ours = {name for name in environment() if name.startswith("FOOSIM_")}
    assert set(re.findall(r"\$\{?(\w+)", text)) == ours
    for path in UNITS.glob("*.service"):
        service = unit(path)["Service"]
        assert (service["Restart"], service["EnvironmentFile"]) == ("on-failure", "/etc/foosim/foosim.env")
        assert service["WorkingDirectory"] == environment()["XDG_STATE_HOME"]


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd-analyze here")
def test_systemd_accepts_the_units(tmp_path: Path) -> None:
    """The only change is where the programs are: systemd looks for them."""
    for path in UNITS.glob("*.service"):
        text = re.sub(r"/opt/foosim/bin/\S+", shutil.which("true") or "/bin/true", path.read_text())
        (tmp_path / path.name).write_text(text)
    names = [path.name for path in tmp_path.iterdir() if path.stem not in INSTANCES]
    names += [f"{stem}{one}.service" for stem, instances in INSTANCES.items() for one in instances]
    done = subprocess.run(
        ["systemd-analyze", "verify", *sorted(names)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
    )
    ours = [line for line in done.stderr.splitlines() if "foosim" in line]
    assert (done.returncode, ours) == (0, []), done.stderr
