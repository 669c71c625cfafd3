"""The command `foosim-pki`: certificates for those who take part in a run, control it or connect to it."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from foosim.common import wall_clock
from foosim.common.errors import BadValue
from foosim.common.json_text import encode_json
from foosim.deployment.loader import load_deployment, read_deployment_text
from foosim.launcher.hosts.ssh import remote_of
from foosim.launcher.pki import certificates
from foosim.launcher.pki.certificates import LEAF_DAYS, LEAF_DAYS_MAX, Shown
from foosim.launcher.pki.hosts import files_for, send_files
from foosim.protocol.identity import FORMS, identities_of
from foosim.runtime.command import DONE, FAILED, VersionOption, new_app, run_app
from foosim.runtime.transport.certificate_folder import CA_KEY_FILE
from foosim.runtime.transport.certificates import identities_in

app = new_app()

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of certificates.", show_default=False)]
Identities = Annotated[list[str] | None, typer.Argument(metavar="[IDENTITY]...", help=f"{FORMS}.", show_default=False)]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for scripts.")]


@app.callback()
def foosim_pki(version: VersionOption = False) -> None:
    """Make the certificates that a run needs where other machines reach it.

    `init` makes a root, `issue` a certificate and key for each process, client and operator, `send` brings to a host
    of a deployment what belongs to its processes. To any other machine copy the root ca.pem and what belongs to its
    processes; keep ca.key where certificates are issued.

    Exit codes: 0 done, 1 a certificate would not be accepted (show), 2 bad input, 3 refused.
    """


@app.command()
def init(
    folder: Folder,
    name: Annotated[str, typer.Option(help="What the root calls itself.")] = "foosim",
) -> None:
    """Make a folder with a root of its own."""
    print(f"{certificates.init(folder, name)} is the root; keep {folder / CA_KEY_FILE} off the machines of a run")


@app.command()
def issue(
    folder: Folder,
    identities: Identities = None,
    deployment: Annotated[
        Path | None, typer.Option(help="Issue to everybody in this deployment file who has nothing yet.")
    ] = None,
    host: Annotated[
        list[str] | None, typer.Option(help="A name or address by which others reach it; may be repeated.")
    ] = None,
    days: Annotated[int, typer.Option(help="How long it lasts.")] = LEAF_DAYS,
    password: Annotated[
        bool, typer.Option("--password", help="Give a client a password instead; it is read from standard input.")
    ] = False,
) -> None:
    """Issue a certificate and a key to each identity.

    The holder may listen as this machine's names and as the hosts given. With --password and a terminal for input, or
    an empty line, the password is a random one, which is printed.
    """
    wanted = list(identities or [])
    if password:
        if deployment is not None or host or len(wanted) != 1:
            raise BadValue("--password is for one client, without --deployment and --host", " ".join(wanted))
        given = "" if sys.stdin.isatty() else sys.stdin.readline().strip()
        made = certificates.issue_password(folder, wanted[0], given)
        print("" if given else made, end="" if given else "\n")
        return
    if deployment is not None:
        found = load_deployment(read_deployment_text(deployment), str(deployment))
        there = identities_in(folder)
        everybody = identities_of(found)
        if found.access.radio == "password":
            clients = [who for who in everybody if who.startswith("client.")]
            everybody = [who for who in everybody if who not in clients]
            for path in certificates.issue_passwords(folder, clients):
                print(path)
        wanted += [identity for identity in everybody if identity not in [*there, *wanted]]
    elif not wanted:
        raise BadValue(f"nobody to issue to: name identities ({FORMS}) or a --deployment")
    for path in certificates.issue(folder, wanted, host or (), days):
        print(path)


@app.command()
def renew(
    folder: Folder,
    identities: Identities = None,
    within: Annotated[
        int | None, typer.Option(min=0, max=LEAF_DAYS_MAX, help="Only what ends within so many days.")
    ] = None,
    host: Annotated[
        list[str] | None, typer.Option(help="A further name or address by which others reach it; may be repeated.")
    ] = None,
) -> None:
    """Issue certificates anew, by default all in the folder.

    Key and length of time stay, and so do names and addresses, to which --host adds. A process takes the new one when
    it is started again.
    """
    for path in certificates.renew(folder, identities or (), within, host or ()):
        print(path)


@app.command()
def send(
    folder: Folder,
    host: Annotated[str, typer.Argument(help="A host of the deployment.", show_default=False)],
    deployment: Annotated[Path, typer.Argument(metavar="FILE", help="The deployment file.")] = Path(
        "deploy/cluster.yaml"
    ),
) -> None:
    """Bring to a host the root, and the certificates and keys of what the deployment places there, through ssh.

    They go into the folder that the deployment names as the host's `pki`, readable by who logs in there alone. No key
    of anybody else is sent. What is there already under these names is replaced: send again after `renew`.
    """
    found = load_deployment(read_deployment_text(deployment), str(deployment))
    for path in send_files(remote_of(found, host), folder, files_for(found, host)):
        print(path)


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
