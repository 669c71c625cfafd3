"""The verbs of `foosim role`: processes of a run, which `up` starts, on this machine and its hosts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from foosim.cli.verbs import Verbs
from foosim.runtime.command import new_app


class RoleVerbs(Verbs):
    """The processes of a run, other than `foosim run`, the supervisor alone."""

    table: ClassVar[Mapping[str, Mapping[str, str]]] = {
        "Commands": {
            "node": "node.main",
            "vhub": "vhub.main",
            "player": "client.main",
            "gateway": "gateways.main",
            "roles": "cli.roles",
        }
    }


app = new_app(RoleVerbs)


@app.callback()
def role_group() -> None:
    """Run a process of a run, as `up` does; for a node with `launch: manual`, and for other launchers."""
