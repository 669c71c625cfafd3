"""The machines of a run: the command line of ssh and its exit codes, hosts and ports, captures from hosts.

`ssh` is the user's own: keys, agents, jump hosts and ~/.ssh/config are as they are; it never prompts. On the other side
`foosim guard` starts a process and ends it when the connection does. A host gets the certificates of its processes. A
vHub on another machine writes the capture there; when it has ended the file is sent through ssh, as a tar file with
checksums, and then removed there.
"""

from __future__ import annotations

import errno
import gzip
import os
import shlex
import shutil
import socket
import subprocess
import tarfile
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import IO, Final

from foosim.capture.parts import part_path
from foosim.common.addresses import Address, parse_address
from foosim.common.errors import Failed, Refused
from foosim.deployment.hosts import Host
from foosim.deployment.schema import Deployment, places
from foosim.runtime.process import BY_SIGNAL, FOOSIM, GUARD, OTHER_VERSION

SSH_FAILED: Final = 255
NOT_FOUND: Final = 127
NOT_RUNNABLE: Final = 126
OWN_BUS: Final = "export XDG_RUNTIME_DIR=${XDG_RUNTIME_DIR:-/run/user/$(id -u)}"
"""Finds the user's own systemd; a login by ssh does not always set it."""
CAPTURE: Final = "capture.mcap"
"""Name of the capture of a vHub on another machine, in the run's folder there."""

# A user's option of the same name precedes these and is used; BatchMode always applies.
_ALWAYS: Final = ("-T", "-o", "BatchMode=yes")
_DEFAULTS: Final = ("ConnectTimeout=10", "ServerAliveInterval=5", "ServerAliveCountMax=3")

# Messages of OpenSSH: of a connection that is refused, and of a machine that cannot be reached.
_REFUSED: Final = (
    "Permission denied", "Host key verification failed", "REMOTE HOST IDENTIFICATION HAS CHANGED",
    "Could not resolve hostname", "Bad configuration option", "unknown option",
)  # fmt: skip
_AWAY: Final = (
    "Connection refused", "No route to host", "Network is unreachable", "timed out", "Connection closed",
    "closed by remote host", "Connection reset", "Broken pipe", "not responding", "Invalid argument",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Remote:
    """A machine by its name in the deployment, with its settings there."""

    name: str
    host: Host

    def ssh(self, words: Sequence[str]) -> list[str]:
        """Return the command line that has the machine's login shell run these words."""
        defaults = [part for option in _DEFAULTS for part in ("-o", option)]
        return ["ssh", *_ALWAYS, *self.host.ssh_options, *defaults, self.host.destination, shlex.join(words)]

    @property
    def typed(self) -> str:
        """How a person connects to the machine."""
        return shlex.join(["ssh", *self.host.ssh_options, self.host.destination])

    @property
    def foosim(self) -> str:
        """The name of the command there."""
        return FOOSIM if self.host.commands is None else f"{self.host.commands.rstrip('/')}/{FOOSIM}"

    def pki_arguments(self) -> list[str]:
        """Return the folder of the certificates there, as an argument for a process of a run with certificates."""
        return [] if self.host.pki is None else ["--pki", self.host.pki]

    def guarded(self, run: str, name: str, command: Sequence[str]) -> list[str]:
        """Return the command line that starts a process of a run there, and ends it when the connection ends."""
        guard = [self.foosim, "guard", "run", "--version-of-launcher", version("foosim"), run, name, *command]
        return self.ssh(guard)

    def unit_started(self, name: str) -> list[str]:
        """Return the command line that starts a node's unit (deploy/systemd): root's is the system's."""
        script = f'if [ "$(id -u)" = 0 ]; then user=; else user=--user; {OWN_BUS}; fi'
        return self.ssh(["sh", "-c", f"{script}; exec systemctl $user --no-block start foosim-node@{name}.service"])

    def why(self, code: int, lines: Sequence[str]) -> str:
        """Return why ssh, or its command, ended with this code; `lines` are the last ones of its log."""
        if code == NOT_FOUND:
            text = f"there is no {self.foosim} on host {self.name}"
            return f"{text}: install foosim there, and set hosts.{self.name}.commands to its folder"
        if code == NOT_RUNNABLE:
            return f"{self.foosim} cannot be run on host {self.name}"
        if code == OTHER_VERSION:
            found = next((line for line in reversed(lines) if line.startswith(GUARD)), "another version of foosim")
            return f"host {self.name}: {found.removeprefix(GUARD + ': ')}; install {version('foosim')} there"
        if code > BY_SIGNAL and code != SSH_FAILED:
            return f"was killed by signal {code - BY_SIGNAL} on host {self.name}"
        if code != SSH_FAILED:
            return f"ended with exit code {code} on host {self.name}"
        where = f"host {self.name} ({self.host.destination})"
        for messages, what in ((_REFUSED, ""), (_AWAY, " cannot be reached")):
            last = [line.strip() for line in lines if any(text in line for text in messages)][-1:]
            if last:
                return f"{where}{what}: {last[0]}"
        return f"{where}: the connection ended, or the guard there was killed"

    @staticmethod
    def is_away(code: int, lines: Sequence[str]) -> bool:
        """Whether the network has failed: the machine may come back by itself."""
        return code == SSH_FAILED and any(text in line for line in lines for text in _AWAY)


def remotes(deployment: Deployment) -> dict[str, Remote]:
    """Return the machine of each process that runs on one of the deployment's hosts, by the process's name."""
    return {name: Remote(host, deployment.hosts[host]) for name, host in places(deployment).items()}


FORGET_S: Final = 15.0
SEND_S: Final = 60.0
REACH_S: Final = 3.0
BACKLOG: Final = 64
REMEDIES: Final = {
    errno.EADDRINUSE: "end what listens there, or take another port",
    errno.EADDRNOTAVAIL: "give an address of this machine, see `ip address`",
    errno.EACCES: "take a port above 1023",
}


def check_hosts(deployment: Deployment, address: Address, remotes: Mapping[str, Remote]) -> None:
    """Raise Refused when a process on another machine could not connect to where the supervisor listens.

    Also when it would have no certificate to do so.
    """
    for name, remote in remotes.items():
        there = f"{name} on host {remote.name} ({remote.host.address})"
        if address.is_loopback and not parse_address(remote.host.address).is_loopback:
            raise Refused(
                f"{there} cannot connect to {address}; give --listen HOST[:PORT], or `listen:` in the deployment, "
                "with an address of this machine that it reaches"
            )
        if address.protocol == "tls" and remote.host.pki is None:
            raise Refused(
                f"{there} has no certificate: set hosts.{remote.name}.pki to their folder on it; "
                "`foosim pki init DIR FILE --send` brings them there"
            )
        node = deployment.nodes.get(name)
        if node is not None and node.launch == "systemd" and address.port == 0:
            raise Refused(f"{there} is a unit of systemd and needs a fixed port; give --listen HOST:PORT")


def send_files(remote: Remote, contents: Mapping[str, bytes]) -> list[str]:
    """Write files of a folder of certificates, by name, into that of a host, and return their paths there.

    Raises Failed when the host names no folder or cannot be reached.
    """
    if remote.host.pki is None:
        raise Failed(f"host {remote.name} names no folder for certificates: set it in hosts.{remote.name}.pki")
    paths = {f"{remote.host.pki.rstrip('/')}/{name}": content for name, content in contents.items()}
    there = shlex.quote(remote.host.pki)
    for path, content in paths.items():
        target = shlex.quote(path)
        script = f"umask 077; mkdir -p {there} && cat >{target}.new && mv {target}.new {target}"
        command = remote.ssh(["sh", "-c", script])
        try:
            done = subprocess.run(command, input=content, capture_output=True, timeout=SEND_S, check=False)
        except subprocess.TimeoutExpired:
            raise Failed(f"host {remote.name}: no answer within {SEND_S:g} s") from None
        except OSError as error:
            raise Failed(f"host {remote.name}: {error}") from None
        lines = done.stderr.decode("utf-8", "replace").splitlines()
        if done.returncode == SSH_FAILED:
            raise Failed(remote.why(done.returncode, lines))
        if done.returncode:
            raise Failed(f"host {remote.name}: {'; '.join(lines[-1:])}")
    return [*paths]


def fetch_capture(remote: Remote, run: str, path: Path) -> None:
    """Fetch the capture of a run to `path`, with its further files; remove the run's folder there.

    Raises Failed; it stays there then.
    """
    command = remote.ssh([remote.foosim, "guard", "send", run, CAPTURE])
    came: dict[Path, Path] = {}
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, process_group=0
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        problem = _receive(process.stdout, path, came)
        # If the output is not read to the end, the closed pipe kills the process: its exit code then means nothing.
        is_cut_here = bool(problem) and process.stdout.read(1) != b""
        process.stdout.close()
        lines = process.stderr.read().decode("utf-8", "replace").splitlines()
    if process.returncode or problem:
        for part in came:
            part.unlink(missing_ok=True)
        code = 0 if is_cut_here else process.returncode
        why = "; ".join(lines[-1:]) if code == 1 else remote.why(code, lines) if code else problem
        where = f"host {remote.name}, in foosim's state folder as hosts/{run}/{CAPTURE}"
        raise Failed(f"the capture stays on {where}: {why or problem}")
    for part, home in came.items():
        part.replace(home)
    forget = remote.ssh([remote.foosim, "guard", "forget", run])
    try:
        subprocess.run(forget, stdin=subprocess.DEVNULL, capture_output=True, timeout=FORGET_S, check=False)
    except subprocess.TimeoutExpired:
        return  # it was fetched; the files left there do no harm


def _receive(stream: IO[bytes], path: Path, came: dict[Path, Path]) -> str:
    """Write the files that a guard sends, under temporary names; return the error, or an empty text.

    `came` gets the temporary names, with the final ones.
    """
    try:
        with gzip.GzipFile(fileobj=stream) as packed:
            with tarfile.open(fileobj=packed, mode="r|") as sent:
                for member in sent:
                    home = part_path(path, int(member.name))
                    part = home.with_name(home.name + ".part")
                    came[part] = home
                    content = sent.extractfile(member)
                    assert content is not None, "a guard sends files"
                    with part.open("wb") as file:
                        shutil.copyfileobj(content, file)
            packed.read()  # the checksum is at the end
    except (tarfile.TarError, zlib.error, EOFError, ValueError, gzip.BadGzipFile):
        return "it came damaged"
    except OSError as error:
        return f"{path}: {error.strerror}"
    return "" if came else "nothing was sent"


# --- ports -----------------------------------------------------------------------------------------------------------


def listen(address: Address) -> socket.socket:
    """Return a socket that listens at an address. Raises OSError."""
    family, _, _, _, place = socket.getaddrinfo(address.host.strip("[]"), address.port, type=socket.SOCK_STREAM)[0]
    is_dual = family == socket.AF_INET6
    # The system accepts connections; no process does.
    return socket.create_server(place, family=family, backlog=BACKLOG, dualstack_ipv6=is_dual)


def why_not_free(address: Address) -> tuple[str, str]:
    """Return why an address cannot be listened on, and the remedy; empty texts when it can."""
    try:
        listen(address).close()
    except socket.gaierror as error:
        return f"no such host, {error.strerror}", "give a name or address of this machine"
    except OSError as error:
        why = os.strerror(error.errno) if error.errno else str(error)
        return why, REMEDIES.get(error.errno or 0, "take another address")
    return "", ""


def check_free(addresses: Iterable[Address]) -> None:
    """Raise Failed for the first address that cannot be listened on, with the remedy."""
    for address in addresses:
        why, remedy = why_not_free(address)
        if why:
            how = f"{remedy} (--listen HOST:PORT, or `listen:` in the deployment)"
            raise Failed(f"cannot listen on {address}: {why}; {how}")


@contextmanager
def listening(address: Address) -> Iterator[None]:
    """Ensure that an address has a listener: our own if there is none and the address is free."""
    try:
        listener = listen(address)
    except OSError:
        yield
        return
    with listener:
        yield


def why_not_reached(address: Address, timeout_s: float = REACH_S) -> str:
    """Return why nothing can be connected to at an address, an empty text when it can."""
    try:
        with socket.create_connection((address.host.strip("[]"), address.port), timeout_s):
            return ""
    except TimeoutError:
        return f"no answer within {timeout_s:g} s"
    except OSError as error:
        return error.strerror or str(error)
