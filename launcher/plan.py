"""What a run is asked for, and the same checked, before anything is started.

What only some runs need is imported where they do: the reader of captures, the trial of meshes, numpy.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from resource import RLIM_INFINITY, RLIMIT_NOFILE, getrlimit
from typing import TYPE_CHECKING, Final

from foosim.common import wall_clock
from foosim.common.addresses import Address, check_listen
from foosim.common.errors import BadValue, Refused, read_at
from foosim.common.finding import Finding
from foosim.common.units import Pace, parse_ns, parse_pace
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, load_deployment, refuse_findings
from foosim.deployment.processes import Process, parse_shape, processes_of
from foosim.deployment.schema import VHUB, Deployment, places
from foosim.deployment.text.files import read_source_file
from foosim.launcher.run_options import RunOptions
from foosim.protocol import identity
from foosim.runtime.transport.certificates import load_credentials, operator_credentials
from foosim.world.assembly.sections import findings_of
from foosim.world.layout import build_layout
from foosim.world.scenery import SceneryMesh

if TYPE_CHECKING:
    from foosim.capture.start_frame import Branch
    from foosim.supervisor.settings import RunSettings
    from foosim.world.start import Start

DESCRIPTORS: Final = 48
"""What the process with the most file descriptors has: its files, Zenoh's own, operators; 24 were measured."""
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
    everybody = [who for process in started for who in identity.of_process(process, deployment)]
    found = [*(load_credentials(pki, who) for who in everybody), operator_credentials(pki)]
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
