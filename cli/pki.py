"""The command `foosim pki`: certificates of the processes and clients of a run."""

from __future__ import annotations

import sys
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from foosim.common import wall_clock
from foosim.common.errors import BadValue, Refused
from foosim.common.names import is_name
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment, places
from foosim.deployment.text.files import read_source_file
from foosim.launcher import pki
from foosim.launcher.hosts import Remote, send_files
from foosim.launcher.pki import LEAF_DAYS, LEAF_DAYS_MAX, RENEW_DAYS, Shown
from foosim.protocol.identity import identities_of
from foosim.runtime.command import DONE, FAILED, JsonOption, new_app, print_json

app = new_app()

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of certificates.")]
Days = Annotated[int, typer.Option(help="Validity of a new certificate, in days.")]


@app.callback()
def pki_group() -> None:
    """Create and check the certificates of a run on several machines.

    `init` creates the certificates of a deployment's processes; with --send it copies them to the deployment's hosts.
    `client` creates that of one client.
    Any other machine needs ca.pem, and the certificates and keys of its own processes. ca.key stays where
    certificates are issued.

    Exit codes: 0 done, 1 a certificate would be rejected (show) or a copy failed (init --send), 2 bad input, 3
    refused.
    """


@app.command()
def init(
    folder: Folder,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The deployment file.")],
    host: Annotated[
        list[str] | None,
        typer.Option(help="A name or address of this machine, for supervisor and vHub; may be repeated."),
    ] = None,
    days: Days = LEAF_DAYS,
    within: Annotated[
        int, typer.Option(min=0, max=LEAF_DAYS_MAX, help="Renew certificates that expire within this many days.")
    ] = RENEW_DAYS,
    send: Annotated[bool, typer.Option("--send", help="Copy each host's files to it through ssh.")] = False,
) -> None:
    """Create a root certificate, and a certificate and key for each identity of a deployment.

    Existing files are kept, so the command can be repeated after a change of the deployment. A certificate that
    expires soon, has another root or lacks a --host is renewed, with the same key, validity, names and addresses; a
    process reads it at its next start. The certificates of supervisor and vHub have this machine's names and every
    --host.

    --send copies ca.pem, and the certificates and keys of the processes on a host, through ssh into the folder in the
    host's `pki` setting. Files there are replaced; only the ssh user can read them.
    """
    deployment = load_deployment(read_source_file(file), str(file))
    if send and not places(deployment):
        raise BadValue("--send: the deployment places nothing on a host", deployment.world)
    for path in pki.provide(folder, identities_of(deployment), host or (), days, within):
        print(path)
    if send and not _is_sent(deployment, folder):
        raise typer.Exit(FAILED)


def _is_sent(deployment: Deployment, folder: Path) -> bool:
    """Copy each host's files to it; print the copies, and the hosts where that failed."""
    failures = []
    for name in sorted(set(places(deployment).values())):
        try:
            contents = pki.files_for(deployment, name, folder)
            print(*send_files(Remote(name, deployment.hosts[name]), contents), sep="\n")
        except Refused as failure:
            failures.append(str(failure))
            print(failure, file=sys.stderr)
    return not failures


@app.command()
def client(
    folder: Folder,
    name: Annotated[list[str], typer.Argument(metavar="NAME...", help="Names of clients, as in the deployment.")],
    days: Days = LEAF_DAYS,
) -> None:
    """Create a certificate and key for a client, client.NAME.pem and client.NAME.key.

    The client needs these two and ca.pem. A run lets it in if its deployment declares the client or player NAME.
    Nothing is overwritten, and DIR needs the ca.key of the run's root.
    """
    for one in name:
        if not is_name(one):
            raise BadValue("not a name for a client", one)
    for path in pki.issue(folder, [f"client.{one}" for one in name], days=days):
        print(path)


@app.command()
def show(folder: Folder, json: JsonOption = False) -> None:
    """Show the certificates of a folder: their holders, ends and problems."""
    shown = pki.show_folder(folder)
    if json:
        print_json(
            {
                "certificates": [
                    {**asdict(its), "begins": its.begins.isoformat(), "ends": its.ends.isoformat()} for its in shown
                ]
            }
        )
    else:
        now = wall_clock.now_utc()
        for its in shown:
            print(_line(its, now))
    raise typer.Exit(FAILED if any(its.problem for its in shown) else DONE)


def _line(its: Shown, now: datetime) -> str:
    if its.problem:
        return f"{its.identity:24} {its.problem}"
    days = (its.ends - now).total_seconds() / 86_400
    hosts = ", ".join(its.hosts) or "issues certificates"
    return f"{its.identity:24} until {its.ends:%Y-%m-%d} ({days:.0f} days), {hosts}"
