"""Preparation of a run's remote hosts, and the fetching of a capture from them.

A vHub on another machine writes the capture there; when it has ended the file is sent through ssh, compared with its
digest, and then removed there.
"""

from __future__ import annotations

import subprocess
from collections.abc import Mapping
from hashlib import blake2b
from pathlib import Path
from typing import IO, Final

from foosim.capture.parts import part_path
from foosim.common.addresses import Address, parse_address
from foosim.common.errors import Failed, Refused
from foosim.deployment.schema import Deployment
from foosim.launcher.hosts.ssh import CAPTURE, Remote

BLOCK_BYTES: Final = 1 << 20
SIZE_LINE_MAX: Final = 64
FORGET_S: Final = 15.0


class OutOfReach(Refused):
    """Processes are to run on other machines, and the supervisor does not listen where those reach it."""


class NoFolder(Refused):
    """A process on another machine needs certificates, and their folder there is not known."""


def check_hosts(deployment: Deployment, address: Address, remotes: Mapping[str, Remote]) -> None:
    """Raise OutOfReach when a process on another machine could not connect to where the supervisor listens.

    Raises NoFolder when it would have no certificate to do so.
    """
    for name, remote in remotes.items():
        there = f"{name} on host {remote.name} ({remote.host.address})"
        if address.is_loopback and not parse_address(remote.host.address).is_loopback:
            raise OutOfReach(
                f"{there} cannot connect to {address}; give --listen HOST[:PORT], or `listen:` in the deployment, "
                "with an address of this machine that it reaches"
            )
        if address.protocol == "tls" and remote.host.pki is None:
            raise NoFolder(
                f"{there} has no certificate: set hosts.{remote.name}.pki to their folder on it; "
                "`foosim pki init DIR FILE --send` brings them there"
            )
        node = deployment.nodes.get(name)
        if node is not None and node.launch == "systemd" and address.port == 0:
            raise OutOfReach(f"{there} is a unit of systemd and needs a fixed port; give --listen HOST:PORT")


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
        try:
            problem = _receive(process.stdout, path, came)
        except OSError as error:
            problem = f"{path}: {error.strerror}"
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
    while (line := stream.readline(SIZE_LINE_MAX)) != b"end\n":
        number, _, size = line.strip().partition(b" ")
        if not (number.isdigit() and size.isdigit()):
            return "it came damaged" if came else "nothing was sent"
        home = part_path(path, int(number))
        part = home.with_name(home.name + ".part")
        came[part] = home
        if not _receive_file(stream, part, int(size)):
            return "it came damaged"
    return "" if came else "nothing was sent"


def _receive_file(stream: IO[bytes], part: Path, left: int) -> bool:
    """Write so many bytes to `part`; return whether they have the digest that follows."""
    digest = blake2b(digest_size=32)
    with part.open("wb") as file:
        while left > 0 and (block := stream.read(min(left, BLOCK_BYTES))):
            left -= len(block)
            digest.update(block)
            file.write(block)
    return not left and stream.readline().strip() == digest.hexdigest().encode()
