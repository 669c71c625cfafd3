"""The files of a certificates' folder that the processes of a host need, and their transfer through ssh.

The root, and for each process that the deployment places there its own certificate and key. Nothing else is
ever sent.
"""

from __future__ import annotations

import shlex
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from foosim.common import wall_clock
from foosim.common.errors import Failed
from foosim.deployment.processes import joint_processes
from foosim.deployment.schema import Deployment, places
from foosim.launcher.hosts.ssh import SSH_FAILED, Remote
from foosim.protocol import identity
from foosim.protocol.channels import VHUB
from foosim.runtime.transport.certificate_folder import CA_FILE, CertificateError
from foosim.runtime.transport.certificates import certificate_path, key_path, load_credentials

SEND_S: Final = 60.0


def identities_on(deployment: Deployment, host: str | None) -> list[str]:
    """Return a run's identities on a host, in the order of `identities_of`; None: those on no host."""
    where = places(deployment)
    known = {VHUB: where.get(VHUB)}
    known |= {identity.node(name): where.get(name) for name in deployment.nodes}
    known |= {identity.client(name): where.get(name) for name in deployment.players}
    known |= {identity.process(name): where.get(its.roles[0]) for name, its in joint_processes(deployment).items()}
    return [who for who in identity.identities_of(deployment) if known.get(who) == host]


def files_for(deployment: Deployment, host: str) -> list[str]:
    """Return the names of the files that a host needs, keys before their certificates. Raises Failed for none."""
    identities = identities_on(deployment, host)
    if not identities:
        raise Failed(f"nothing is placed on host {host}")
    names = [CA_FILE]
    for who in identities:
        names += [key_path(Path(), who).name, certificate_path(Path(), who).name]
    return names


def send_files(remote: Remote, folder: Path, names: Sequence[str]) -> list[str]:
    """Bring files of a folder of certificates into that of a host, and return their paths there.

    All are checked before the first is sent: raises CertificateError for one that would be refused, Failed
    when the host names no folder or cannot be reached.
    """
    if remote.host.pki is None:
        raise Failed(f"host {remote.name} names no folder for certificates: set it in hosts.{remote.name}.pki")
    contents = {name: _checked(folder, name) for name in names}
    paths = []
    for name, content in contents.items():
        path = f"{remote.host.pki.rstrip('/')}/{name}"
        there, target = shlex.quote(remote.host.pki), shlex.quote(path)
        script = f"umask 077; mkdir -p {there} && cat >{target}.new && mv {target}.new {target}"
        _run_there(remote, script, content)
        paths.append(path)
    return paths


def _checked(folder: Path, name: str) -> str:
    """Return the contents of a file in a folder of certificates. Raises CertificateError."""
    path = folder / name
    if name == CA_FILE:
        from foosim.runtime.transport.certificate_files import read_ca

        read_ca(folder, wall_clock.now_utc())
    else:
        load_credentials(folder, path.stem)
    try:
        return path.read_text("ascii")
    except (OSError, UnicodeDecodeError) as error:
        raise CertificateError(f"{path}: cannot be read, {error}") from None


def _run_there(remote: Remote, script: str, text: str) -> str:
    """Return the output of a shell script on a host, with `text` as its input. Raises Failed."""
    command = remote.ssh(["sh", "-c", script])
    try:
        done = subprocess.run(command, input=text, capture_output=True, text=True, timeout=SEND_S, check=False)
    except FileNotFoundError:
        raise Failed("there is no ssh here") from None
    except subprocess.TimeoutExpired:
        raise Failed(f"host {remote.name}: no answer within {SEND_S:g} s") from None
    if done.returncode != 0:
        lines = done.stderr.splitlines()
        if done.returncode == SSH_FAILED:
            raise Failed(remote.why(done.returncode, lines))
        raise Failed(f"host {remote.name}: {'; '.join(lines[-1:])}")
    return done.stdout
