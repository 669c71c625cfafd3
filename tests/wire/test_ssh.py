"""Processes on another machine, through a real ssh to a real sshd on this one: they live as long as the connection.

Each way in which a start can fail is tried, and said so that a person knows what to do.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest

from foosim.client.control import Control
from foosim.common.errors import Failed
from foosim.deployment.hosts import Host
from foosim.launcher import hosts as remote_module
from foosim.launcher.hosts import CAPTURE, Remote, fetch_capture
from foosim.launcher.processes import Child, Launcher
from foosim.runtime.transport.certificates import operator_credentials
from tests.wire import sshd
from tests.wire.conftest import LONG, TABLE, command_path, processes_with, wait_for
from tests.wire.sshd import Sshd, run
from tests.wire.test_run import free_port, last_json
from tests.wire.test_secured_run import certificates

if TYPE_CHECKING:
    from tests.wire.conftest import House

pytestmark = pytest.mark.skipif(bool(sshd.missing()), reason=sshd.missing())

RUN: Final = "run-of-a-test"
GUARD_KILLED: Final = "ended: host there (127.0.0.1): the connection ended, or the guard there was killed"
COMMANDS: Final = str(Path(sys.executable).parent)
SLEEPER: Final = """#!{python}
import signal, sys, time
from foosim.runtime.process import die_with_parent
die_with_parent()
if {stubborn}:
    signal.signal(signal.SIGTERM, lambda number, frame: print("no", flush=True))
print("here", flush=True)
while True:
    time.sleep(60)
"""


class There:
    """The other machine: this one, by way of an sshd on a port of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.state = folder / "there"
        self.bin = folder / "bin"
        self.bin.mkdir()
        self.port = free_port()
        self.home = folder / "home"
        environment = {"XDG_STATE_HOME": str(self.state), "PATH": f"{self.bin}:/usr/bin:/bin", "HOME": str(self.home)}
        self.sshd = Sshd(folder, "127.0.0.1", self.port, **environment)
        self.launchers: list[Launcher] = []

    def host(self, *options: str, port: int | None = None, **changes: Any) -> dict[str, Any]:
        """What a deployment says of this machine."""
        ssh = ["-F", str(self.sshd.config), "-p", str(port or self.port), *options]
        return {"address": "127.0.0.1", "ssh_options": ssh, "commands": COMMANDS, **changes}

    def remote(self, *options: str, port: int | None = None, **changes: Any) -> Remote:
        return Remote("there", Host(**self.host(*options, port=port, **changes)))

    def start(self, remote: Remote, *command: str) -> Child:
        """Start a command over there, as the process `red`."""
        launcher = Launcher(RUN, {"red": remote})
        self.launchers.append(launcher)
        return launcher.start("red", command, self.folder / "red.log")

    def program(self, name: str, stubborn: bool = False) -> str:
        """A program that says `here` and stays; a stubborn one also stays when it is told to end."""
        path = self.bin / name
        path.write_text(SLEEPER.format(python=sys.executable, stubborn=stubborn))
        path.chmod(0o755)
        return str(path)

    def ended(self, child: Child) -> str:
        """How a child ended, once it has."""
        assert wait_for(f"the end of {child.name}", lambda: child.exit_code is not None)
        return child.ending

    def close(self) -> None:
        for launcher in self.launchers:
            launcher.kill()
            launcher.close()
        self.sshd.stop()


@pytest.fixture
def there(tmp_path: Path) -> Iterator[There]:
    made = There(tmp_path)
    yield made
    made.close()


def begin(there: There, name: str, stubborn: bool = False) -> tuple[Child, str]:
    """Start a program over there and wait for its first word; return it with its path, which its processes have."""
    program = there.program(name, stubborn)
    child = there.start(there.remote(), program)
    wait_for("its first word", lambda: "here" in child.log.read_text()[child.begin :])
    return child, program


def test_what_runs_there_ends_with_its_connection(there: There) -> None:
    """However it ends: ssh killed, its standard input closed, as when the launcher is gone, the guard killed."""
    child, program = begin(there, "first")
    child.process.kill()
    wait_for("its end", lambda: not processes_with(program))
    child, program = begin(there, "second")
    child.let_go()
    assert there.ended(child) == "ended: was killed by signal 15 on host there"
    assert not processes_with(program) and not list(there.state.glob("foosim/hosts/*")), "nothing is left behind"
    child, program = begin(there, "third")
    guards = [pid for pid, line in processes_with(program).items() if "run --version-of-launcher" in line]
    os.kill(max(guards), signal.SIGKILL)
    assert there.ended(child) == GUARD_KILLED
    wait_for("its end", lambda: not processes_with(program))


@pytest.mark.campaign
def test_what_does_not_want_to_end_is_killed(there: There) -> None:
    child, program = begin(there, "stubborn", stubborn=True)
    child.let_go()
    assert there.ended(child) == "ended: was killed by signal 9 on host there"
    assert "no" in child.log.read_text().splitlines() and not processes_with(program)


def test_a_process_that_is_started_again_takes_the_place_of_the_earlier_one(there: There) -> None:
    """Its connection may be gone here and not yet there."""
    first, program = begin(there, "first")
    second, _ = begin(there, "second")
    assert there.ended(first) == GUARD_KILLED
    assert not processes_with(program) and second.exit_code is None


def test_why_a_process_could_not_be_started_is_said(there: There, monkeypatch: pytest.MonkeyPatch) -> None:
    other = there.folder / "other"
    run("ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", other)
    (there.folder / "other_config").write_text(there.sshd.config.read_text().replace(str(there.sshd.key), str(other)))
    empty = there.folder / "known"
    empty.write_text("")
    refused = there.host()
    refused["ssh_options"][1] = str(there.folder / "other_config")
    cases = {
        "Permission denied (publickey": Remote("there", Host(**refused)),
        "there is no /nowhere/foosim on host there: install foosim": there.remote(commands="/nowhere"),
        "cannot be reached: ssh: connect to host 127.0.0.1": there.remote(port=free_port()),
        "Host key verification failed.": there.remote("-o", f"UserKnownHostsFile={empty}"),
        "Could not resolve hostname no-such-host.invalid": there.remote(ssh="no-such-host.invalid"),
        "Bad configuration option: nonsense": there.remote("-o", "Nonsense=1"),
    }
    for text, remote in cases.items():
        child = there.start(remote, "foosim", "role", "node", "--help")
        ending = there.ended(child)
        assert text in ending and "host there" in ending, ending
        assert child.is_away == ("cannot be reached" in text)
    monkeypatch.setattr(remote_module, "version", lambda name: "99.0")
    ending = there.ended(there.start(there.remote(), "foosim", "role", "node", "--help"))
    assert "is installed there, the run has 99.0; install 99.0 there" in ending, ending


def test_a_capture_comes_home_whole_or_stays(there: There, tmp_path: Path) -> None:
    folder = there.state / "foosim" / "hosts" / RUN
    home = tmp_path / "home.mcap"
    with pytest.raises(Failed, match=rf"stays on host there, in .* as hosts/{RUN}/{CAPTURE}: .*No such file"):
        fetch_capture(there.remote(), RUN, home)
    folder.mkdir(parents=True)
    content = os.urandom(3_000_001)
    (folder / CAPTURE).write_bytes(content)
    (folder / "capture_0001.mcap").write_bytes(content[:2_000_000])
    damaging = there.bin / "foosim"
    for damage in ("head -c 2999999", "head -c 4050000", "tr a b", "head -c -1"):
        damaging.write_text(f'#!/bin/sh\n{command_path("foosim")} "$@" | {damage}\n')
        damaging.chmod(0o755)
        with pytest.raises(Failed, match="it came damaged"):
            fetch_capture(there.remote(commands=None), RUN, home)
        assert not list(tmp_path.glob("home*")) and (folder / CAPTURE).exists()
    fetch_capture(there.remote(), RUN, home)
    assert home.read_bytes() == content and not folder.exists()
    assert (tmp_path / "home_0001.mcap").read_bytes() == content[:2_000_000]
    assert sorted(file.name for file in tmp_path.glob("home*")) == ["home.mcap", "home_0001.mcap"]


@pytest.mark.campaign
def test_a_run_whose_host_does_not_have_foosim_says_so_and_ends(there: There, house: House) -> None:
    hosts = {"there": there.host(commands="/nowhere")}
    code, out, err = house.end(house.up("--json", "--set", f"hosts={hosts}", "--set", "nodes.blue.host=there"))
    assert code == 1 and "there is no /nowhere/foosim on host there" in last_json(out)["reason"], err
    assert processes_with(str(house.folder / "state")) == {}


SYSTEMCTL: Final = """#!{python}
# Stands in for systemd: starts an instance of a template with a notify socket, keeps the notifications.
import os, pathlib, shlex, socket, subprocess, sys
template, name = sys.argv[-1].removesuffix(".service").split("@")
text = pathlib.Path("{deploy}/systemd", template + "@.service").read_text()
(line,) = [line for line in text.splitlines() if line.startswith("ExecStart=")]
line = line.replace("/opt/foosim/bin", "{commands}").replace("%i", name).replace("${{FOOSIM_SUPERVISOR}}", "{address}")
if os.fork() == 0:
    os.setsid()
    null = os.open(os.devnull, os.O_RDWR)
    for number in range(3):
        os.dup2(null, number)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as told, open("{folder}/told", "ab", 0) as log:
        told.bind("{folder}/notify")
        environment = {{**os.environ, "NOTIFY_SOCKET": "{folder}/notify", "WATCHDOG_USEC": "400000"}}
        environment["FOOSIM_PKI"] = "{pki}"
        node = subprocess.Popen(shlex.split(line.removeprefix("ExecStart=")), env=environment)
        told.settimeout(0.1)
        while node.poll() is None:
            try:
                log.write(told.recv(4096) + b"\\n")
            except TimeoutError:
                continue
        log.write(b"ended %d\\n" % node.returncode)
"""


def test_a_node_that_systemd_runs_takes_part(there: There, house: House) -> None:
    """The unit is an instance of the template in deploy/systemd; the launcher starts it, and it notifies systemd."""
    units, folder = there.folder / "units", certificates(there.folder / "certs")
    units.mkdir()
    address = f"127.0.0.1:{free_port()}"
    hosts = {"there": there.host(pki=str(folder))}
    sets = [f"hosts={json.dumps(hosts)}", "nodes.blue.host=there", "nodes.blue.launch=systemd", LONG]
    place = ["--listen", address, "--pki", str(folder), *(word for setting in sets for word in ("--set", setting))]
    where = {"deploy": TABLE.parent, "commands": COMMANDS, "folder": units, "pki": folder, "address": f"tls/{address}"}
    (there.bin / "systemctl").write_text(SYSTEMCTL.format(python=sys.executable, **where))
    (there.bin / "systemctl").chmod(0o755)

    run = house.start("foosim", "run", TABLE, *place)
    wait_for("the run's address", lambda: house.live().info())
    launcher = Launcher(RUN, {"blue": there.remote()}, units=["blue"])
    there.launchers.append(launcher)
    child = launcher.start("blue", (), there.folder / "blue.log")
    assert there.ended(child) == "ended with exit code 0", child.log.read_text()

    def told() -> list[str]:
        return (units / "told").read_text().splitlines() if (units / "told").exists() else []

    with Control(f"tls/{address}", operator_credentials(folder)) as control:
        wait_for("blue to be here", lambda: "blue" in control.status()["processes"])
        assert control.status()["processes"]["blue"]["host"] == "there"
        wait_for("two rounds of the watchdog", lambda: told().count("WATCHDOG=1") >= 2)
        assert told()[0] == "READY=1"
        control.request("down")
    wait_for("the unit's end", lambda: told()[-1] == "ended 0")
    assert told()[-3:-1] == ["STOPPING=1", "WATCHDOG_USEC=300000000"]
    assert house.end(run)[0] == 0
