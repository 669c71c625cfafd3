"""The command `foosim doctor`: whether a deployment could run here, and what to do where it could not."""

from __future__ import annotations

from dataclasses import asdict
from itertools import groupby
from pathlib import Path
from typing import Annotated

import typer

from foosim.client.loading import look_in
from foosim.common.addresses import check_listen
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.text.files import read_source_file
from foosim.launcher.doctor import HERE, Case, Finding, examine_all, is_well
from foosim.runtime.command import DONE, FAILED, JsonOption, PkiOption, new_app, print_json

app = new_app()

MARKS = {"fine": "ok", "warning": "!", "problem": "NO"}


@app.command()
def doctor(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The deployment file.")],
    listen: Annotated[
        str | None, typer.Option(help="HOST[:PORT] of the supervisor; by default the deployment's.")
    ] = None,
    insecure: Annotated[
        bool, typer.Option("--insecure", help="Check for a run that listens without certificates, as `up --insecure`.")
    ] = False,
    pki: PkiOption = None,
    json: JsonOption = False,
) -> None:
    """Check whether a deployment can run on this machine and its hosts.

    Checks versions, the players' classes, certificates (names, dates, keys, hosts), ports, the clock and disks, on
    this machine and through ssh on each host of the deployment. Of a host it also checks that it answers, that the
    ports of supervisor and vHub are reached, and the offset of its clock. The check imports the
    modules of players and listens at the ports for a moment. Each line has a result and, where needed, what to do.

    Exit codes: 0 the deployment can run, 1 it cannot, 2 bad input.
    """
    text = apply_sets(read_source_file(file), str(file), ())
    deployment = load_deployment(text, str(file))
    address = deployment.listen if listen is None else listen
    check_listen(address, insecure, 2, pki is not None)
    look_in(str(file.parent.absolute()))  # as `up` does
    findings = examine_all(Case(deployment, address, insecure, pki), str(file), text)
    if json:
        content = {"well": is_well(findings), "findings": [asdict(finding) for finding in findings]}
        print_json(content)
    else:
        for host, lines in groupby(findings, lambda finding: finding.host):
            if host != HERE:
                print(f"\non host {host}:")
            print(*map(_line, lines), sep="\n")
    raise typer.Exit(DONE if is_well(findings) else FAILED)


def _line(finding: Finding) -> str:
    remedy = f"\n{'':18}-> {finding.remedy}" if finding.remedy else ""
    text = f": {finding.text}" if finding.text else ""
    return f"{MARKS[finding.state]:3} {finding.check:13} {finding.subject}{text}{remedy}"
