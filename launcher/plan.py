"""The options of a run, checked before anything is started.

What only some runs need is imported where they do: the reader of captures, the trial of meshes, numpy.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from resource import RLIM_INFINITY, RLIMIT_NOFILE, getrlimit
from typing import TYPE_CHECKING, Final

from foosim.common import wall_clock
from foosim.common.addresses import Address, check_listen
from foosim.common.errors import BadValue, Refused, read_at
from foosim.common.finding import Finding
from foosim.common.units import Pace, parse_ns, parse_pace
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, check_engine, load_deployment, refuse_findings
from foosim.deployment.processes import Process, parse_shape, processes_of
from foosim.deployment.schema import VHUB, Capture, Deployment, places
from foosim.deployment.text.files import read_source_file
from foosim.launcher.run_options import RunOptions
from foosim.protocol import identity
from foosim.runtime.disk import Level, Room, room_on_disk
from foosim.runtime.transport.certificates import load_credentials, operator_credentials
from foosim.world.assembly.sections import findings_of
from foosim.world.layout import build_layout
from foosim.world.scenery import SceneryMesh

if TYPE_CHECKING:
    from foosim.capture.start_frame import Branch
    from foosim.supervisor.settings import RunSettings
    from foosim.world.start import Start

DESCRIPTORS: Final = 48
"""File descriptors of the process with the most: its files, Zenoh's own, operators; 24 were measured."""
DESCRIPTORS_PER_ROLE: Final = 2
"""Of each node, player and client: its link, and one that it replaces."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Checked options: the canonical text, the deployment, and the run's length (0 ticks: until requested to end).

    `branch` is the captured frame that it begins with, None for frame 0.
    """

    options: RunOptions
    text: str
    deployment: Deployment
    pace: Pace
    ticks: int
    address: Address
    branch: Branch | None = None
    files: Mapping[str, bytes] = field(default_factory=dict, repr=False)
    processes: Mapping[str, Process] = field(default_factory=dict)
    """By name, that of the supervisor first."""
    stamp: str = field(default="", compare=False)
    """The time in the names of the run and of its capture."""

    @property
    def start(self) -> Start | None:
        return None if self.branch is None else self.branch.start

    def settings(self, run: str, *, is_launched: bool = False) -> RunSettings:
        """Return the settings of the supervisor of the run with this name; `is_launched`: `up` starts its processes."""
        from foosim.supervisor.settings import RunSettings

        name, balance = str(self.options.file), self.options.balance
        again = replace(self.options, branch=None).arguments()
        shared = {role: its.name for its in self.processes.values() if len(its.roles) > 1 for role in its.roles}
        world = self.text, self.pace, self.ticks, self.start
        return RunSettings(run, name, *world, balance, again, self.files, shared if is_launched else {})


def check_certificates(plan: Plan) -> list[str]:
    """Return warnings of certificates that expire soon, of processes that `up` starts here and of its own operator.

    Raises CertificateError for one that would be refused. Processes on other machines have theirs there.
    """
    pki, deployment = plan.options.pki, plan.deployment
    elsewhere = places(deployment)
    started = [
        process
        for process in plan.processes.values()
        if not {*process.roles} & {*elsewhere} and all(deployment.launch_of(role) == "local" for role in process.roles)
    ]
    identities = [who for process in started for who in identity.of_process(process, deployment)]
    found = [*(load_credentials(pki, who) for who in identities), operator_credentials(pki)]
    warnings = [credentials.ends_soon(wall_clock.now_utc()) for credentials in found if credentials is not None]
    return [warning for warning in warnings if warning]


def check_models_here(plan: Plan) -> None:
    """Raise DeploymentError for a link model that cannot be loaded, unless the vHub runs (and checks) elsewhere."""
    from foosim.vhub.network.custom_models import check_link_models

    if VHUB not in places(plan.deployment):
        file, network = plan.options.file, plan.deployment.network
        check_link_models(network, read_source_file(file), str(file), plan.options.all_sets)


def check_descriptors(plan: Plan) -> None:
    """Raise Refused where a process may have fewer file descriptors than that with the most links needs."""
    deployment = plan.deployment
    needed = DESCRIPTORS + DESCRIPTORS_PER_ROLE * sum(
        len(names) for names in (deployment.nodes, deployment.players, deployment.clients)
    )
    may, _ = getrlimit(RLIMIT_NOFILE)
    if may != RLIM_INFINITY and may < needed:
        raise Refused(
            f"a process may have {may} file descriptors, {needed} are needed: ulimit -n {needed}; nothing was started"
        )


def check_players_here(plan: Plan) -> None:
    """Raise DeploymentError for players' classes that cannot be loaded, here or from the deployment's folder.

    Other machines have their own classes.
    """
    from foosim.client.loading import look_in, player_findings

    look_in(str(plan.options.file.parent.absolute()))
    deployment, elsewhere = plan.deployment, places(plan.deployment)
    _refuse(plan.options, player_findings(deployment, [name for name in deployment.players if name not in elsewhere]))


def _refuse(options: RunOptions, findings: Iterable[Finding]) -> None:
    """Raise DeploymentError for findings, if there are any."""
    if found := list(findings):
        refuse_findings(read_source_file(options.file), str(options.file), found, options.all_sets)


def make_plan(options: RunOptions) -> Plan:
    """Check all options before any process is started; raises Refused."""
    name = str(options.file)
    text = apply_sets(read_source_file(options.file), name, options.all_sets)
    text, files = pin_assets(text, name, options.file.parent)
    deployment = load_deployment(text, name).with_assets(files)
    if not places(deployment).keys() >= deployment.nodes.keys():
        check_engine(text, name, deployment)  # a node on another machine says itself what that lacks
    has_meshes = any(isinstance(thing, SceneryMesh) for thing in deployment.scenery.values())
    if has_meshes or build_layout(deployment).couples:
        from foosim.node.physics.mesh_trial import check_shapes

        check_shapes(deployment, name, text)
    _refuse(options, findings_of(deployment))  # meshes that bodies start in or pass through
    listen = deployment.listen if options.listen is None else options.listen
    address = check_listen(listen, options.insecure, ports=2, secured=options.pki is not None)
    pace = deployment.pace if options.pace is None else read_at("--pace", parse_pace, options.pace)
    ticks = 0
    if options.duration is not None:
        ticks = -(-read_at("--for", parse_ns, options.duration) // deployment.tick_ns)
        if ticks == 0:
            raise BadValue("--for: a run has at least one tick", options.duration)
    branch = None
    if options.branch is not None:
        from foosim.capture.start_frame import read_branch

        branch = read_branch(options.branch, deployment)
    shape = "deployed" if options.processes is None else read_at("--processes", parse_shape, options.processes)
    processes = processes_of(deployment, shape)
    stamp = wall_clock.now_stamp()
    return Plan(options, text, deployment, pace, ticks, address, branch, files, processes, stamp)


def default_capture(world: str, stamp: str) -> Path:
    """Return the default path of a run's capture; `stamp` is the time in its name."""
    from foosim.capture.parts import parts_at

    stem = f"{world}-{stamp}"
    names = (stem if number == 1 else f"{stem}-{number}" for number in range(1, 1000))
    return next(path for path in (Path("captures") / f"{name}.mcap" for name in names) if not parts_at(path))


def check_texts(*paths: Path | None) -> None:
    """Raise BadValue for a path outside UTF-8: files of the run, its messages and its capture have it as a text."""
    for path in paths:
        text = "" if path is None else str(path.absolute())
        try:
            text.encode()
        except UnicodeEncodeError:
            raise BadValue("path is not valid UTF-8", text) from None


def check_capture(path: Path) -> Path:
    """Return the path if no file exists there, or where the capture would continue, and its folder, created if missing,
    is writable; raises Refused.
    """
    from foosim.capture.parts import parts_at

    try:
        for found in parts_at(path).values():
            raise Refused(f"{found} exists, and a capture is never overwritten")
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path.parent):
            return path
    except OSError as error:
        raise Refused(f"{path}: cannot be created, {error.strerror}") from None


@dataclass(frozen=True, slots=True)
class Place:
    """Return the nearest existing parent of a folder of a run, and the free space of its disk."""

    there: Path
    room: Room
    ends_run: bool
    """Whether the run ends at the reserve; else it continues without its capture."""

    @property
    def then(self) -> str:
        return "the run ends" if self.ends_run else "the run continues without its capture"

    @property
    def is_refused(self) -> bool:
        """Whether a run would end at once."""
        return self.ends_run and self.room.level >= Level.FULL

    @property
    def is_low(self) -> bool:
        return self.room.level is not Level.FINE


def place_of(settings: Capture, folder: Path, *, is_capture: bool = False) -> Place:
    """Return the room for the files of a run in a folder, which may be missing yet; raises OSError.

    `is_capture`: it is the capture, without which a run may continue. Else it is a journal.
    """
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    ends_run = not is_capture or settings.on_full != "continue_unlogged"
    return Place(there, room_on_disk(there, settings.reserve_bytes), ends_run)


def check_rooms(settings: Capture, capture: Path | None, runs: Path | None) -> list[str]:
    """Return warnings where disks have less than twice the reserve; raises Refused where a run would end at once.

    `capture` is the file, None where none is written here; `runs` is the folder of runs, or of the run to be resumed,
    None where no journal is written.
    """
    warnings = []
    for folder in (None if capture is None else capture.parent, runs):
        if folder is None:
            continue
        try:
            place = place_of(settings, folder, is_capture=folder is not runs)
        except OSError:
            continue  # the writer reports the error
        text = f"{folder}: {place.room} (capture.reserve)"
        if place.is_refused:
            raise Refused(f"{text}: make room, or lower the reserve; nothing was started")
        if place.is_low:
            warnings.append(f"room gets little, at the reserve {place.then}: {text}")
    return warnings
