"""Machines in miniature: network namespaces on one switch, each with an address, a link of its own, and a real sshd.

They need root, `ip`, `tc` and `sshd`; tests say with `needed` what is missing, and are skipped then. Names have the
process id in them, so that several test processes do not meet; whatever is left of one that was killed is removed by
the next. Links are cut as on a real network: a link down loses what is on the way, and a *wrong neighbour* (packets
leave for a station that does not exist) loses one direction without telling anybody.
"""

from __future__ import annotations

import os
import signal
import subprocess
from contextlib import suppress
from pathlib import Path
from typing import Final, Self

from tests.wire import sshd
from tests.wire.sshd import Sshd, run

TOOLS: Final = ("ip", "tc")
PREFIX: Final = "fs"
NOBODY: Final = "02:00:00:00:ff:ff"
"""The address of no station."""


def missing() -> str:
    """Return what is missing for machines in miniature, or an empty text."""
    if os.geteuid() != 0:
        return "network namespaces need root"
    if sshd.missing(*TOOLS):
        return sshd.missing(*TOOLS)
    made = subprocess.run(["ip", "netns", "add", f"{PREFIX}{os.getpid()}-try"], capture_output=True, check=False)
    if made.returncode != 0:
        return "network namespaces cannot be made here"
    run("ip", "netns", "del", f"{PREFIX}{os.getpid()}-try")
    return ""


class Machine:
    """One machine: a namespace, its address, its end of the link to the switch."""

    def __init__(self, name: str, namespace: str, switch: str, address: str) -> None:
        self.name = name
        self.namespace = namespace
        self.address = address
        self._switch = switch
        self._port = f"p-{name}"

    def inside(self, *command: str | Path) -> list[str]:
        """Return a command line that runs in this machine's network."""
        return ["ip", "netns", "exec", self.namespace, *map(str, command)]

    def connect(self) -> None:
        """Put the machine's link into the switch."""
        link = ("ip", "-n", self._switch, "link")
        run(*link, "add", self._port, "type", "veth", "peer", "name", "eth0", "netns", self.namespace)
        run(*link, "set", self._port, "master", "switch", "up")
        run("ip", "-n", self.namespace, "link", "set", "lo", "up")
        run("ip", "-n", self.namespace, "addr", "add", f"{self.address}/24", "dev", "eth0")
        run("ip", "-n", self.namespace, "link", "set", "eth0", "up")

    def processes(self) -> dict[int, str]:
        """Return the processes on this machine, with their command lines."""
        found = {}
        for pid in run("ip", "netns", "pids", self.namespace).split():
            with suppress(OSError):
                found[int(pid)] = Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
        return found

    def link(self, state: str) -> None:
        """Pull the cable out at the switch (`down`), or put it in again (`up`)."""
        run("ip", "-n", self._switch, "link", "set", self._port, state)

    def deafen(self, other: Machine) -> None:
        """Lose all that this machine sends to another one, silently."""
        neighbour = ("ip", "-n", self.namespace, "neigh", "replace", other.address)
        run(*neighbour, "lladdr", NOBODY, "dev", "eth0", "nud", "permanent")

    def heal(self, other: Machine) -> None:
        """Undo `deafen`."""
        run("ip", "-n", self.namespace, "neigh", "del", other.address, "dev", "eth0")

    def limit(self, rate: str) -> None:
        """Let what this machine sends, and what is sent to it, have this rate (`2mbit`)."""
        bucket = ("root", "tbf", "rate", rate, "burst", "16kb", "latency", "200ms")
        run("ip", "netns", "exec", self.namespace, "tc", "qdisc", "replace", "dev", "eth0", *bucket)
        run("ip", "netns", "exec", self._switch, "tc", "qdisc", "replace", "dev", self._port, *bucket)

    def unlimit(self) -> None:
        """Undo `limit`."""
        run("ip", "netns", "exec", self.namespace, "tc", "qdisc", "del", "dev", "eth0", "root")
        run("ip", "netns", "exec", self._switch, "tc", "qdisc", "del", "dev", self._port, "root")


class Machines:
    """Several machines on one switch. Use it in `with`; nothing of it stays."""

    def __init__(self, folder: Path, *names: str) -> None:
        self.folder = folder
        self.sshs: dict[str, Sshd] = {}
        self._prefix = f"{PREFIX}{os.getpid()}-"
        self.by_name = {
            name: Machine(name, self._prefix + name, self._prefix + "switch", f"10.77.0.{number}")
            for number, name in enumerate(names, 1)
        }

    def __getitem__(self, name: str) -> Machine:
        return self.by_name[name]

    def __enter__(self) -> Self:
        remove_leftovers()
        switch = self._prefix + "switch"
        try:
            for namespace in (switch, *(machine.namespace for machine in self.by_name.values())):
                run("ip", "netns", "add", namespace)
            run("ip", "-n", switch, "link", "add", "switch", "type", "bridge", "forward_delay", "0")
            run("ip", "-n", switch, "link", "set", "switch", "up")
            for machine in self.by_name.values():
                machine.connect()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *about: object) -> None:
        self.close()

    def close(self) -> None:
        """End every process in the namespaces, and remove them."""
        for machine in self.by_name.values():
            remove(machine.namespace)
        for server in self.sshs.values():
            server.stop()
        remove(self._prefix + "switch")

    def serve_ssh(self, name: str, ahead_s: int = 0, **environment: str) -> None:
        """Start a real sshd on a machine; `environment` is what those who log in there have.

        The monotonic clock of who logs in is ahead of ours; where the kernel has no namespaces of time, it is not.
        """
        machine = self.by_name[name]
        elsewhen = unshare_time(ahead_s)
        possible = subprocess.run([*elsewhen, "true"], capture_output=True, check=False).returncode == 0
        prefix = machine.inside(*elsewhen) if possible else machine.inside()
        self.sshs[name] = Sshd(self.folder, machine.address, 22, prefix, **environment)

    @property
    def ssh_config(self) -> Path:
        """A configuration of ssh that reaches every machine."""
        return self.folder / "ssh_config"


def unshare_time(ahead_s: int) -> list[str]:
    """Return what runs a command with its monotonic clocks ahead of ours."""
    ahead = [f"--{clock}={ahead_s}" for clock in ("monotonic", "boottime")]
    return ["unshare", "--time", *ahead, "--fork", "--kill-child"]


def remove(namespace: str) -> None:
    """Kill what runs in a namespace, and remove it."""
    with suppress(AssertionError):
        for pid in run("ip", "netns", "pids", namespace).split():
            with suppress(ProcessLookupError):
                os.kill(int(pid), signal.SIGKILL)
        run("ip", "netns", "del", namespace)


def remove_leftovers() -> None:
    """Remove the namespaces of test processes that are no more."""
    for line in run("ip", "netns", "list").splitlines():
        namespace = line.split()[0] if line.strip() else ""
        owner = namespace.removeprefix(PREFIX).partition("-")[0]
        if namespace.startswith(PREFIX) and owner.isdigit() and not Path(f"/proc/{owner}").exists():
            remove(namespace)
