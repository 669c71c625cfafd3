"""The hosts section of a deployment, and the placement of processes on hosts.

A process without a place runs on the supervisor's machine. Nothing here changes the world: where something is computed
is not part of the experiment.
"""

from __future__ import annotations

from typing import Annotated, Final

from pydantic import AfterValidator, Field, StringConstraints

from foosim.common.addresses import parse_address
from foosim.common.errors import BadValue
from foosim.common.spec_base import Name, SpecBase
from foosim.common.units import custom_error

# None of these can begin with a dash: ssh would take it for an option.
ADDRESS_PATTERN: Final = r"^([A-Za-z0-9]([A-Za-z0-9.-]*[A-Za-z0-9])?|\[[0-9a-fA-F:.]+\])$"
SSH_PATTERN: Final = r"^[A-Za-z0-9_][A-Za-z0-9_.@:/%\[\]-]*$"
FOLDER_PATTERN: Final = r"^/[^\x00-\x1f\x7f]*$"
OPTION_PATTERN: Final = r"^[^\x00-\x1f\x7f]+$"
SSH_OPTIONS_MAX: Final = 32

Folder = Annotated[str, StringConstraints(pattern=FOLDER_PATTERN, max_length=400)]
SshOption = Annotated[str, StringConstraints(pattern=OPTION_PATTERN, max_length=400)]


def _check_listen(value: str) -> str:
    try:
        parse_address(value)
    except BadValue as bad:
        raise custom_error(bad) from None
    return value


Listen = Annotated[str, StringConstraints(max_length=300), AfterValidator(_check_listen)]
"""Where the supervisor listens: HOST[:PORT]."""


class Host(SpecBase):
    """A machine: where others reach it, how ssh does (by default at that address), its labels, where foosim is on it.

    `commands` is the folder that has foosim's commands; by default they are found on the PATH of a login by ssh. `pki`
    is the folder with the certificates of what runs there, for runs that have certificates.
    """

    address: Annotated[str, StringConstraints(pattern=ADDRESS_PATTERN, max_length=253)]
    ssh: Annotated[str, StringConstraints(pattern=SSH_PATTERN, max_length=300)] | None = None
    ssh_options: list[SshOption] = Field(default=[], max_length=SSH_OPTIONS_MAX)
    labels: list[Name] = Field(default=[], max_length=16)
    commands: Folder | None = None
    pki: Folder | None = None

    @property
    def destination(self) -> str:
        """The destination for ssh."""
        return self.ssh or self.address.strip("[]")


class Placed(SpecBase):
    """The host of a process: by name or by label; by default the supervisor's machine."""

    host: Name | None = None
    label: Name | None = None
