"""The deployment: all settings of a run, as one frozen value.

This is the schema. Text becomes a `Deployment` in loader.py only, because what one field cannot know (every robot has
one owner, every selector matches an endpoint, every rate is a whole number of ticks) is checked there too, by
validate.py. Quantities are strings with units in the file and SI numbers here; times are integer nanoseconds whose
names end in `_ns` (see common/units.py). The settings of robots, components and kits
are with their component types (library/).
"""

from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, JsonValue, SerializeAsAny, StringConstraints, model_validator

from foosim.common import limits, names, units
from foosim.common.addresses import LOOPBACK
from foosim.common.errors import BadValue
from foosim.common.spec_base import Name, Offset, Rate, RobotName, SpecBase, default
from foosim.common.units import PaceField, Quantity, custom_error
from foosim.deployment.hosts import Host, Listen, Placed
from foosim.deployment.network.link_settings import Profiles
from foosim.deployment.network.rules import Network, Selector
from foosim.deployment.network.traces import check_files, network_files
from foosim.world.assembly.joint_selection import with_joint_names
from foosim.world.bodies.visual_meshes import undrawn_path
from foosim.world.component_types.settings import GatewaySettings
from foosim.world.scenery import mesh_files, read_contents
from foosim.world.spec import WorldSpec

OperatorName = Annotated[str, StringConstraints(pattern=names.NAME_PATTERN, max_length=limits.OPERATOR_LENGTH_MAX)]
ClassPath = Annotated[str, StringConstraints(pattern=names.CLASS_PATTERN, max_length=200)]

Size = Annotated[int, Quantity(units.SIZE, "64 KiB", "1000 TiB")]
Span = Annotated[int, Quantity(units.TIME, "10 ms", "10000 h")]
Deadline = Annotated[int, Quantity(units.TIME, "1 ms", "24 h")]


SUPERVISOR, VHUB = names.PROCESS_NAMES_RESERVED


class NodeSpec(Placed):
    """A node: its host, its launch, whether the run needs it, and the robots that it owns at the start.

    Roles that name the same `process` share one; else each has its own.
    """

    process: Name | None = None
    launch: Literal["local", "manual", "systemd"] = "local"
    required: bool = False
    robots: list[RobotName] = Field(max_length=limits.ENTITIES_MAX)


class Player(Placed):
    """A controller: a class with `act(tick, samples) -> commands`.

    It may command its `robots` and hears their channels, and those of others that `hears` selects. One that is `on` a
    robot is on board of it: its packets leave from and come to where the robot is. Players that name the same `process`
    share one; else each has its own. One that acts at `arrival` is called at each tick at which a packet arrives of
    what `arrivals` selects, and when it has not been called for the period of its rate.
    """

    class_: ClassPath = Field(alias="class")
    rate_hz: Rate = Field(alias="rate")
    offset_ns: Offset = default("0 s", "offset")
    lockstep: bool = True
    act: Literal["period", "arrival"] = "period"
    arrivals: dict[Selector, list[Name]] = Field(default={}, max_length=limits.ENTITIES_MAX)
    on: RobotName | None = None
    process: Name | None = None
    launch: Literal["local", "manual"] = "local"
    """Started by `up`, or by hand with the command that `up` prints, in a terminal of its own."""
    restart: bool = True
    """Whether its process is started again when a signal has ended it, or it was lost with its machine; before the
    first tick, when it has no memory to lose, it always is."""
    robots: dict[RobotName, list[Name]] = Field(default={}, max_length=limits.ENTITIES_MAX)
    hears: dict[Selector, list[Name]] = Field(default={}, max_length=limits.ENTITIES_MAX)
    parameters: dict[str, JsonValue] = Field(default={}, max_length=256)


class VHubSpec(Placed):
    """The vHub, which judges every packet and writes the capture: where it runs, and in which process."""

    process: Name | None = None


class SupervisorSpec(SpecBase):
    """The supervisor: in which process it runs."""

    process: Name | None = None


class ClientSpec(SpecBase):
    """An endpoint that is started by hand, on board of a robot or anywhere.

    One in lockstep is waited for before tick 0 and has a rate. One with `console` is the console's: its operators send
    robots with it, over links that are ideal where no link rule names it.
    """

    console: bool = False
    on: RobotName | None = None
    lockstep: bool = False
    rate_hz: Rate | None = Field(default=None, alias="rate")
    offset_ns: Offset = default("0 s", "offset")


class Capture(SpecBase):
    """How much of a run the capture keeps beside its packets, orders and digests."""

    frames_every: Annotated[int, Quantity(units.TICKS, "1 tick", "1000000 ticks")] = default("10 ticks")
    poses_hz: Rate = default("50 Hz", "poses")
    flush_ns: Annotated[int, Quantity(units.TIME, "1 ms", "100 ms")] = default("100 ms", "flush")
    on_full: Literal["stop_world", "continue_unlogged"] = "stop_world"
    """What follows when the disk has less than the reserve left, or the capture has reached `max_bytes`."""
    reserve_bytes: Size = default("64 MiB", "reserve")
    """Kept free on the disks of capture and journals, so that what has to be written in the end still fits."""
    bytes_max: Size | None = Field(default=None, alias="max_bytes")
    split_bytes: Size | None = Field(default=None, alias="split_size")
    split_ns: Span | None = Field(default=None, alias="split_time")
    """A file ends at this size or simulated time; the next one begins with the next captured frame."""
    last_ns: Span | None = Field(default=None, alias="last")
    """Files of a split capture are removed when all that they hold is older than this simulated time."""

    @property
    def is_split(self) -> bool:
        """Whether the capture continues in further files."""
        return self.split_bytes is not None or self.split_ns is not None


class AccessSpec(SpecBase):
    """The operators and viewers of a run with certificates."""

    operators: list[OperatorName] = Field(default=["admin"], max_length=limits.OPERATORS_MAX)
    viewers: list[OperatorName] = Field(default=[], max_length=limits.OPERATORS_MAX)


class Deadlines(SpecBase):
    """The times that the run waits for processes, in wall time."""

    heartbeat_ns: Deadline = default("1 s", "heartbeat")
    tick_named_ns: Deadline = default("500 ms", "tick_named")
    tick_lost_ns: Deadline = default("1 s", "tick_lost")
    lockstep_fast_ns: Deadline = default("10 s", "lockstep_fast")
    lockstep_realtime_ns: Deadline = default("2 s", "lockstep_realtime")
    start_ns: Deadline = default("60 s", "start")
    orphan_ns: Deadline = default("68 s", "orphan")
    """Nodes and vHub end when their supervisor has been gone for so long."""
    vhub_back_ns: Deadline = default("68 s", "vhub_back")
    client_back_ns: Deadline = default("2 s", "client_back")
    close_ns: Deadline = default("30 s", "close")

    @model_validator(mode="after")
    def _outlast_restart(self) -> Self:
        """Raise the waits for a lost supervisor and vHub, unless the file gives them, to the time of a restart."""
        restart_ns = self.start_ns + limits.RESTART_PAUSE_NS_MAX
        waits = {name for name in ("orphan_ns", "vhub_back_ns") if getattr(self, name) < restart_ns}
        raised = dict.fromkeys(waits - self.model_fields_set, restart_ns)
        return self.model_copy(update=raised) if raised else self


def _supported(value: object) -> object:
    """Literal[2] alone would take `2.0` for 2."""
    if type(value) is not int or value != 2:
        raise custom_error(BadValue("unsupported format (valid is 2)", value))
    return value


class Deployment(WorldSpec):
    """A whole run: the world, its nodes, its players, the network between them, and the recording.

    Sections of kits, which build a world from few numbers, are beside these keys, such as `table` and `hall`.
    """

    format: Annotated[Literal[2], BeforeValidator(_supported, json_schema_input_type=Literal[2])]
    pace: PaceField
    mixed_cpu: bool = False
    on_node_loss: Literal["adopt", "freeze", "stop"] = "adopt"
    listen: Listen = LOOPBACK
    hosts: dict[Name, Host] = Field(default={}, max_length=limits.NODES_MAX)
    nodes: dict[Name, NodeSpec] = Field(min_length=1, max_length=limits.NODES_MAX)
    supervisor: SupervisorSpec = Field(default_factory=SupervisorSpec)
    vhub: VHubSpec = Field(default_factory=VHubSpec)
    players: dict[Name, Player] = Field(default={}, max_length=limits.CLIENTS_MAX)
    clients: dict[Name, ClientSpec] = Field(default={}, max_length=limits.CLIENTS_MAX)
    gateways: dict[Name, SerializeAsAny[GatewaySettings]] = Field(default={}, max_length=limits.NODES_MAX)
    network: Network = Field(default_factory=Network)
    capture: Capture = Field(default_factory=Capture)
    access: AccessSpec = Field(default_factory=AccessSpec)
    deadlines: Deadlines = Field(default_factory=Deadlines)

    def with_assets(self, files: Mapping[str, bytes], *, drawn: bool = True) -> Self:
        """The same with the contents of the files that scenery, robots and network name, and with the names of joints
        in the settings that select some. What is only `drawn` may be left out. Raises AssetError."""
        others = [*network_files(self.network), *self.robot_files(files)]
        deployment = self.with_contents(read_contents(self.scenery, files, others))
        check_files(self.network, files)
        self.check_robot_files(files, () if drawn else [path for path in self.digests if undrawn_path(path)])
        return deployment.with_joint_names()

    def with_joint_names(self) -> Self:
        """The same with the names of joints in the settings that select some; the files of robots must be there."""
        return with_joint_names(self)

    def files(self, *, drawn: bool = True) -> dict[str, str | None]:
        """The files that it names, by path, each with the digest that is written beside it: with what is only drawn, or
        without."""
        named: dict[str, str | None] = dict.fromkeys(self.robot_files({}))
        digests = {path: digest for path, digest in self.digests.items() if drawn or not undrawn_path(path)}
        return named | digests | mesh_files(self.scenery) | network_files(self.network)

    def world_files(self) -> dict[str, str]:
        """The files that its world is drawn with, digests by path."""
        named = self.digests | mesh_files(self.scenery)
        return {path: digest for path, digest in named.items() if digest is not None}

    def wanted(self, files: Mapping[str, bytes]) -> list[str]:
        """Return the needed files that `files` lacks, as far as known: one may name further ones."""
        needed = [*mesh_files(self.scenery), *network_files(self.network), *self.robot_files(files)]
        return [path for path in dict.fromkeys(needed) if path not in files]

    def endpoints(self) -> list[str]:
        """The names that packets go from and to, sorted: robots, players and clients."""
        return sorted([*self.robots, *self.players, *self.clients])

    def senders_to(self, robot: str) -> tuple[str, ...]:
        """The endpoints that may command a robot, in name order: players that name it, and all clients."""
        players = [name for name, player in self.players.items() if robot in player.robots]
        return tuple(sorted([*players, *self.clients]))

    @property
    def console(self) -> str:
        """The endpoint of the console; empty without a declared one."""
        return next((name for name, client in self.clients.items() if client.console), "")

    def carriers(self) -> dict[str, str]:
        """The robot on whose board each player and client is that is on one."""
        on_board = [(name, player.on) for name, player in self.players.items()]
        on_board += [(name, client.on) for name, client in self.clients.items()]
        return {name: robot for name, robot in on_board if robot is not None}

    def profiles(self, network: Network | None = None) -> Profiles:
        """The settings of all links, of this network or of another one in its place."""
        gateways = {client for name, its in self.gateways.items() for client in its.clients(name).values()}
        return Profiles(self.network if network is None else network, self.carriers(), self.console, gateways)

    def launch_of(self, role: str) -> Literal["local", "manual", "systemd"]:
        """The launch of the process of a role."""
        if role in self.nodes:
            return self.nodes[role].launch
        if role in self.gateways:
            return self.gateways[role].launch
        return self.players[role].launch if role in self.players else "local"

    def declared_processes(self) -> dict[str, str]:
        """The process of each role that names one, by role."""
        named = {SUPERVISOR: self.supervisor.process, VHUB: self.vhub.process}
        named |= {name: node.process for name, node in self.nodes.items()}
        named |= {name: player.process for name, player in self.players.items()}
        return {role: process for role, process in named.items() if process is not None}

    def heard_by(self, name: str) -> list[tuple[str, str]]:
        """The (endpoint, channel) that a player subscribes to, sorted: its robots' and what `hears` selects."""
        player = self.players[name]
        heard = {(robot, channel) for robot, channels in player.robots.items() for channel in channels}
        for glob, channels in player.hears.items():
            for other in self.endpoints():
                if other != name and fnmatchcase(other, glob):
                    heard.update((other, channel) for channel in channels if self._has(other, channel))
        return sorted(heard)

    def arrivals_of(self, name: str) -> list[tuple[str, str]]:
        """The (endpoint, channel) at the arrival of whose packets a player acts, sorted; none for one by period."""
        player = self.players.get(name)
        if player is None or player.act != "arrival":
            return []
        chosen = player.arrivals.items()
        return [
            (source, channel)
            for source, channel in self.heard_by(name)
            if any(channel in channels and fnmatchcase(source, glob) for glob, channels in chosen)
        ]

    def _has(self, endpoint: str, channel: str) -> bool:
        """Whether an endpoint may send on a channel: players and clients on any, robots on their own."""
        robot = self.robots.get(endpoint)
        return robot is None or channel in (*robot.sensors, names.CHANNEL_ECHO)

    def owners(self) -> dict[str, str]:
        """The node of each robot at the start, in the robots' name order."""
        owner = {robot: node for node, spec in self.nodes.items() for robot in spec.robots}
        return dict(sorted(owner.items()))


def places(deployment: Deployment) -> dict[str, str]:
    """Return the host of each role that has one, by name, and of each process that roles name.

    Of the hosts with a label, each process in name order gets the host with the fewest by then, ties by name.
    """
    declared = deployment.declared_processes()
    roles: dict[str, Placed] = {**deployment.nodes, **deployment.players, VHUB: deployment.vhub}
    processes = {declared.get(role, role): placed for role, placed in roles.items()}
    found = {name: placed.host for name, placed in sorted(processes.items()) if placed.host is not None}
    for name, placed in sorted(processes.items()):
        if placed.label is not None:
            fitting = [host for host, about in sorted(deployment.hosts.items()) if placed.label in about.labels]
            found[name] = min(fitting, key=lambda host: sum(taken == host for taken in found.values()))
    found |= {role: found[process] for role, process in declared.items() if process in found}
    return dict(sorted(found.items()))
