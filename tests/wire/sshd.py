"""A real sshd of a test's own: on an address and port of its own, with keys of its own, as the user who runs the test.

Needs Debian's openssh-server or the like; `missing` says what is not there, for the reason of a skipped test.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

PROGRAM: Final = "/usr/sbin/sshd"
LIMIT_S: Final = 900.0


def missing(*further: str) -> str:
    """Return what is not installed, or an empty text."""
    absent = [tool for tool in ("ssh", "ssh-keygen", PROGRAM, *further) if shutil.which(tool) is None]
    return f"not installed: {', '.join(absent)} (sh tools/system_packages.sh)" if absent else ""


def run(*command: str | Path) -> str:
    """Output of a command that must succeed."""
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
    return done.stdout


class Sshd:
    """One server. Several may share a folder, and then a key and a configuration of ssh that reaches them all."""

    def __init__(
        self, folder: Path, address: str, port: int, prefix: Sequence[str] = (), /, **environment: str
    ) -> None:
        """Start it and wait until it listens; `prefix` runs it elsewhere, `environment` is what logins have."""
        self.folder = folder
        self.config = folder / "ssh_config"
        self.key = folder / "key"
        own = folder / f"sshd-{address}-{port}"
        own.mkdir()
        for key in (own / "host_key", self.key):
            if not key.exists():
                run("ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", key)
        if os.geteuid() == 0:
            Path("/run/sshd").mkdir(exist_ok=True)  # where it locks itself in, which only a service makes
        lines = [
            f"ListenAddress {address}",
            f"Port {port}",
            f"HostKey {own / 'host_key'}",
            f"AuthorizedKeysFile {self.key}.pub",
            *("PidFile none", "UsePAM no", "StrictModes no", "PasswordAuthentication no"),
            "PermitRootLogin prohibit-password",
            *([f"SetEnv {' '.join(f'{key}={value}' for key, value in environment.items())}"] if environment else []),
        ]
        (own / "sshd_config").write_text("\n".join(lines) + "\n")
        self.log = own / "log"
        with self.log.open("wb") as log:
            command = [*prefix, PROGRAM, "-D", "-e", "-f", str(own / "sshd_config")]
            self._process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        self._await()
        self._introduce(f"[{address}]:{port}" if port != 22 else address, own / "host_key.pub")

    def _await(self) -> None:
        deadline_s = time.monotonic() + LIMIT_S
        while b"Server listening" not in self.log.read_bytes():
            assert self._process.poll() is None and time.monotonic() < deadline_s, self.log.read_text()
            time.sleep(0.02)

    def _introduce(self, name: str, public_key: Path) -> None:
        """Make this server known, as a user's first login does."""
        known = self.folder / "known_hosts"
        kind, text, *_ = public_key.read_text().split()
        with known.open("a") as file:
            file.write(f"{name} {kind} {text}\n")
        self.config.write_text(
            f"Host *\n  IdentityFile {self.key}\n  IdentitiesOnly yes\n  UserKnownHostsFile {known}\n"
            "  GlobalKnownHostsFile /dev/null\n"
        )

    def stop(self) -> None:
        """End it; connections that are open go on."""
        self._process.kill()
        self._process.wait()
