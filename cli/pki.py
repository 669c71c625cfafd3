"""The command `foosim-pki`: certificates for those who take part in a run, control it or connect to it."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from foosim.common import wall_clock
from foosim.common.errors import BadValue, Refused
from foosim.common.json_text import encode_json
from foosim.deployment.loader import load_deployment, read_deployment_text
from foosim.deployment.schema import Deployment, places
from foosim.launcher.hosts.ssh import Remote
from foosim.launcher.pki import certificates
from foosim.launcher.pki.certificates import LEAF_DAYS, LEAF_DAYS_MAX, RENEW_DAYS, Shown
from foosim.launcher.pki.hosts import files_for, passwords_of, send_files
from foosim.protocol.identity import identities_of
from foosim.runtime.command import DONE, FAILED, VersionOption, new_app, run_app

app = new_app()

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of certificates.", show_default=False)]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for scripts.")]


@app.callback()
def foosim_pki(version: VersionOption = False) -> None:
    """Make the certificates that a run needs where other machines reach it.

    `init` makes what everybody in a deployment needs, and with --send brings to each host of the deployment what
    belongs to its processes. To any other machine copy the root ca.pem and what belongs to its processes; keep ca.key
    where certificates are issued.

    Exit codes: 0 done, 1 a certificate would not be accepted (show) or a host has not got
    its own (init --send), 2 bad input, 3 refused.
    """


@app.command()
def init(
    folder: Folder,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The deployment file.", show_default=False)],
    host: Annotated[
        list[str] | None,
        typer.Option(help="A name or address by which others reach supervisor and vHub; may be repeated."),
    ] = None,
    days: Annotated[int, typer.Option(help="How long a new certificate lasts.")] = LEAF_DAYS,
    within: Annotated[
        int, typer.Option(min=0, max=LEAF_DAYS_MAX, help="Issue anew what ends within so many days.")
    ] = RENEW_DAYS,
    send: Annotated[bool, typer.Option("--send", help="Bring to the hosts of the deployment what is theirs.")] = False,
) -> None:
    """Make what the folder lacks for a deployment: a root, and a certificate and key for each of its identities.

    What is there stays; so the same command serves after a change of the deployment. A certificate that ends soon, has
    another root or lacks a --host is issued anew, for the same key, length of time, names and addresses. A process
    takes the new one when it is started again. Supervisor and vHub may listen as this machine's names and as the hosts
    given. Where the deployment has `access: {radio: password}` each client gets a random password, in
    client.NAME.password, unless there is one.

    With --send the root, and certificates, keys and passwords of what the deployment places on a host, go through ssh
    into the folder that the deployment names as the host's `pki`, readable by who logs in there alone. Nobody else's
    key is sent. What is there already under these names is replaced.
    """
    deployment = load_deployment(read_deployment_text(file), str(file))
    if send and not places(deployment):
        raise BadValue("--send: the deployment places nothing on a host", deployment.world)
    everybody = identities_of(deployment)
    passwords = passwords_of(deployment, everybody)
    for path in certificates.provide(folder, everybody, passwords, host or (), days, within):
        print(path)
    if send and not _is_sent(deployment, folder):
        raise typer.Exit(FAILED)


def _is_sent(deployment: Deployment, folder: Path) -> bool:
    """Bring to each host what is its own; say what was brought, and which host has not got it."""
    failures = []
    for name in sorted(set(places(deployment).values())):
        try:
            print(*send_files(Remote(name, deployment.hosts[name]), folder, files_for(deployment, name)), sep="\n")
        except Refused as failure:
            failures.append(str(failure))
            print(failure, file=sys.stderr)
    return not failures


@app.command()
def show(folder: Folder, json: Json = False) -> None:
    """Show whose certificates a folder has, until when, and what is wrong with them."""
    shown = certificates.show_folder(folder)
    if json:
        print(encode_json([_as_json(its) for its in shown]).decode())
    else:
        for its in shown:
            print(_line(its))
    raise typer.Exit(FAILED if any(its.problem for its in shown) else DONE)


def _as_json(its: Shown) -> dict[str, object]:
    return {
        "identity": its.identity,
        "path": its.path,
        "begins": its.begins.isoformat(),
        "ends": its.ends.isoformat(),
        "hosts": list(its.hosts),
        "fingerprint": its.fingerprint,
        "problem": its.problem,
    }


def _line(its: Shown) -> str:
    if its.problem:
        return f"{its.identity:24} {its.problem}"
    days = its.days_left(wall_clock.now_utc())
    hosts = ", ".join(its.hosts) or "issues certificates"
    return f"{its.identity:24} until {its.ends:%Y-%m-%d} ({days:.0f} days), {hosts}"


def main() -> None:
    """Entry of `foosim-pki`."""
    run_app(app, "foosim-pki")


if __name__ == "__main__":
    main()
