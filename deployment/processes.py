"""The processes of a run: which roles share one. Roles are the supervisor, the vHub, nodes, players and gateways.

Nothing here changes the world. Roles of one process exchange messages in memory, and end together. A gateway has a
process of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal, get_args

from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.schema import SUPERVISOR, VHUB, Deployment, places

Shape = Literal["deployed", "one", "each"]
SHAPES: Final[tuple[Shape, ...]] = get_args(Shape)
ONE: Final = "one"
"""The process of `one` on the supervisor's machine; on a host `one-HOST`."""
ONE_PLAYERS: Final = "one-players"
"""That of the players beside the supervisor where the vHub is on a host: it starts when the vHub listens."""


@dataclass(frozen=True, slots=True)
class Process:
    """One process: its name, and its roles in the order of their turns."""

    name: str
    roles: tuple[str, ...]

    @property
    def is_shared(self) -> bool:
        """Whether it has several roles, or one under another name than its own."""
        return self.roles != (self.name,)


def parse_shape(text: str) -> Shape:
    """Return a shape: as the deployment declares, one process a host, or a process for each role. Raises BadValue."""
    for shape in SHAPES:
        if shape == text:
            return shape
    raise UnknownName("not a shape", text, SHAPES)


def processes_of(deployment: Deployment, shape: Shape = "deployed") -> dict[str, Process]:
    """Return the processes of a run by name: that of the supervisor first, then those of vHub, nodes and players.

    Roles that `up` does not start have processes of their own. Players that share a process without other roles do so
    in each shape.
    """
    hosts, roles = places(deployment), [VHUB, SUPERVISOR, *sorted(deployment.nodes), *sorted(deployment.players)]
    roles += sorted(deployment.gateways)
    declared = deployment.declared_processes()
    fleets = {*declared.values()} - {name for role, name in declared.items() if role not in deployment.players}
    groups: dict[str, list[str]] = {}
    for role in roles:
        is_ours = deployment.launch_of(role) == "local" and role not in deployment.gateways
        if shape == "one" and is_ours:
            name = f"{ONE}-{hosts[role]}" if role in hosts else ONE
            if role in deployment.players and role not in hosts and VHUB in hosts:
                name = ONE_PLAYERS
        elif shape == "each" and declared.get(role) not in fleets:
            name = role
        else:
            name = declared.get(role, role)
        if name == ONE and role == ONE and shape == "one":
            raise BadValue("a role with the name of the process of shape one; rename it", role)
        groups.setdefault(name, []).append(role)
    found = [Process(name, tuple(roles)) for name, roles in groups.items()]
    if shape == "one":
        found = [Process(its.roles[0], its.roles) if len(its.roles) == 1 else its for its in found]
    found.sort(key=lambda process: SUPERVISOR not in process.roles)
    return {process.name: process for process in found}


def joint_processes(deployment: Deployment, shapes: Sequence[Shape] = ("one", "deployed")) -> dict[str, Process]:
    """Return the processes, of these shapes, that connect to the supervisor with several roles, by name."""
    found = {name: process for shape in shapes for name, process in processes_of(deployment, shape).items()}
    return {name: process for name, process in sorted(found.items()) if is_joint(process, deployment)}


def is_joint(process: Process, deployment: Deployment) -> bool:
    """Whether a process connects to the supervisor with several roles. Players connect to the vHub one by one."""
    return SUPERVISOR not in process.roles and sum(role not in deployment.players for role in process.roles) > 1


def process_of(processes: Mapping[str, Process]) -> dict[str, str]:
    """Return the process of each role."""
    return {role: process.name for process in processes.values() for role in process.roles}
