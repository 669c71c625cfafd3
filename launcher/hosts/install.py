"""Installs the units of a host's nodes: through ssh onto the host, or as files into a folder.

Root on the host gets units of the system, in /etc/systemd/system; any other user gets units of that user's own systemd.
"""

from __future__ import annotations

import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from foosim.common.errors import Failed, Refused
from foosim.launcher.hosts.ssh import OWN_BUS, SSH_FAILED, Remote

INSTALL_S: Final = 60.0
SYSTEM_FOLDER: Final = "/etc/systemd/system"
USER_FOLDER: Final = "$HOME/.config/systemd/user"


def is_root_there(remote: Remote) -> bool:
    """Whether ssh logs in as root. Raises Failed when it does not log in."""
    return run_there(remote, "id -u", "").strip() == "0"


def install(remote: Remote, units: Mapping[str, str], is_users: bool) -> list[str]:
    """Write units onto a host and have its systemd read them; return the paths there. Raises Failed."""
    folder, systemctl = (USER_FOLDER, f"{OWN_BUS}; systemctl --user") if is_users else (SYSTEM_FOLDER, "systemctl")
    paths = []
    for name, text in sorted(units.items()):
        path = f'"{folder}/{name}"'
        script = f'mkdir -p "{folder}" && cat >{path}.new && mv {path}.new {path} && echo {path}'
        paths.append(run_there(remote, script, text))
    run_there(remote, f"{systemctl} daemon-reload", "")
    return [path.strip() for path in paths]


def write_units(folder: Path, units: Mapping[str, str]) -> list[Path]:
    """Write units into a folder of this machine; return their paths. Raises Refused."""
    paths = [folder / name for name in sorted(units)]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path in paths:
            path.write_text(units[path.name])
    except OSError as error:
        raise Refused(f"{error.filename}: cannot be written, {error.strerror}") from None
    return paths


def run_there(remote: Remote, script: str, text: str) -> str:
    """Return the output of a shell script on a host, with `text` as its input. Raises Failed."""
    command = remote.ssh(["sh", "-c", script])
    try:
        done = subprocess.run(command, input=text, capture_output=True, text=True, timeout=INSTALL_S, check=False)
    except FileNotFoundError:
        raise Failed("there is no ssh here") from None
    except subprocess.TimeoutExpired:
        raise Failed(f"host {remote.name}: no answer within {INSTALL_S:g} s") from None
    if done.returncode != 0:
        lines = done.stderr.splitlines()
        if done.returncode == SSH_FAILED:
            raise Failed(remote.why(done.returncode, lines))
        raise Failed(f"host {remote.name}: {'; '.join(lines[-1:])}")
    return done.stdout
