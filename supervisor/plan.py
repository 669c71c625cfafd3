"""What a run is asked for, and the same checked, before anything is started.

Neighbours: `up` and `main` carry it out, `cli` reads the options from a command line.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from foosim.client.class_check import player_findings
from foosim.node.engines.probation import check_models
from foosim.protocol import identity, wall
from foosim.protocol.addresses import Address, check_listen
from foosim.protocol.assets import pin_assets
from foosim.protocol.certificates import load_credentials, operator_credentials
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.deployment import Deployment
from foosim.protocol.deployment_file import apply_sets, load_deployment, read_deployment_text, refuse_findings
from foosim.protocol.errors import BadValue, Refused, read_at
from foosim.protocol.hall_start import start_findings
from foosim.protocol.hosts import places
from foosim.protocol.start import Origin, Start
from foosim.protocol.table_clearance import clearance_findings
from foosim.protocol.units import Pace, parse_ns, parse_pace
from foosim.supervisor.resumable import check_resumable
from foosim.supervisor.run_folder import Launch, RunFolder
from foosim.vhub.branching import Branch, read_branch
from foosim.vhub.link_models import check_link_models


@dataclass(frozen=True, slots=True)
class RunOptions:
    """How to run a deployment file; texts as a person types them."""

    file: Path
    pace: str | None = None
    duration: str | None = None
    seed: int | None = None
    sets: tuple[str, ...] = ()
    listen: str | None = None
    """Where to listen; None is where the deployment says."""
    insecure: bool = False
    pki: Path | None = None
    branch: str | None = None
    """`CAPTURE@12.5s`: begin with that frame."""
    balance: bool = False
    """Move robots by the nodes' measured load."""

    @property
    def all_sets(self) -> tuple[str, ...]:
        return self.sets if self.seed is None else (*self.sets, f"seed={self.seed}")

    def arguments(self) -> list[str]:
        """Return the options as arguments of `foosim-supervisor run`."""
        given = [str(self.file)]
        given += ["--listen", self.listen] if self.listen is not None else []
        given += ["--insecure"] if self.insecure else []
        given += self.pki_arguments()
        given += ["--pace", self.pace] if self.pace is not None else []
        given += ["--for", self.duration] if self.duration is not None else []
        given += ["--seed", str(self.seed)] if self.seed is not None else []
        given += ["--from", self.branch] if self.branch is not None else []
        given += ["--balance"] if self.balance else []
        for setting in self.sets:
            given += ["--set", setting]
        return given

    def pki_arguments(self) -> list[str]:
        """Return where the certificates are, as each process of the run is told it."""
        return [] if self.pki is None else ["--pki", str(self.pki.absolute())]


@dataclass(frozen=True, slots=True)
class RunSettings:
    """What a supervisor is started with. `ticks` is how many there are; 0 is until it is asked to end.

    `start` is the frame of another run that it begins with; None: frame 0.
    """

    run: str
    deployment_name: str
    deployment_text: str
    pace: Pace
    ticks: int = 0
    start: Start | None = None
    balance: bool = False
    """Whether robots move by the nodes' measured load."""
    files: Mapping[str, bytes] = field(default_factory=dict, repr=False)
    """The contents of the files that the deployment refers to, by path."""

    def load_deployment(self) -> Deployment:
        """The deployment with its files; raises DeploymentError or AssetError."""
        return load_deployment(self.deployment_text, self.deployment_name).with_assets(self.files)

    @property
    def origin(self) -> Origin | None:
        return None if self.start is None else self.start.origin

    @property
    def last_tick(self) -> int:
        """The tick of the frame that ends the run; 0: it ends when it is asked to."""
        return self.ticks and self.ticks + (0 if self.start is None else self.start.origin.tick)


@dataclass(frozen=True, slots=True)
class Plan:
    """Options that were checked: the canonical text and what is in it, and when it ends (0 ticks: when asked to).

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

    @property
    def start(self) -> Start | None:
        return None if self.branch is None else self.branch.start


def check_certificates(plan: Plan) -> list[str]:
    """Return which certificates end soon, of everybody whom `up` starts here and of the operator that it is itself.

    Raises CertificateError when somebody would not be let in. Those on other machines have theirs there.
    """
    pki, deployment = plan.options.pki, plan.deployment
    elsewhere = places(deployment)
    local = [name for name, node in deployment.nodes.items() if node.launch == "local" and name not in elsewhere]
    players = [identity.client(name) for name in deployment.players if name not in elsewhere]
    servers = [SUPERVISOR] if VHUB in elsewhere else [SUPERVISOR, VHUB]
    everybody = (*servers, *map(identity.node, local), *players)
    found = [*(load_credentials(pki, who) for who in everybody), operator_credentials(pki)]
    warnings = [credentials.ends_soon(wall.now_utc()) for credentials in found if credentials is not None]
    return [warning for warning in warnings if warning]


def check_models_here(plan: Plan) -> None:
    """Raise DeploymentError for a link model that cannot be had, unless the vHub, which looks again, runs elsewhere."""
    if VHUB not in places(plan.deployment):
        file, network = plan.options.file, plan.deployment.network
        check_link_models(network, read_deployment_text(file), str(file), plan.options.all_sets)


def check_players_here(plan: Plan) -> None:
    """Raise DeploymentError for players' classes that cannot be had. Those on other machines have theirs there."""
    deployment, elsewhere = plan.deployment, places(plan.deployment)
    findings = player_findings(deployment, [name for name in deployment.players if name not in elsewhere])
    if findings:
        file = plan.options.file
        refuse_findings(read_deployment_text(file), str(file), findings, plan.options.all_sets)


def check_meshes(deployment: Deployment, options: RunOptions) -> None:
    """Raise DeploymentError for meshes, whose files have been read by now, that bodies start in or pass through."""
    findings = [*start_findings(deployment), *clearance_findings(deployment)]
    if findings:
        refuse_findings(read_deployment_text(options.file), str(options.file), findings, options.all_sets)


def make_plan(options: RunOptions) -> Plan:
    """Check everything that was asked for before anything is started; raises Refused."""
    name = str(options.file)
    text = apply_sets(read_deployment_text(options.file), name, options.all_sets)
    text, files = pin_assets(text, name, options.file.parent)
    deployment = load_deployment(text, name).with_assets(files)
    check_models(deployment, name, text)
    check_meshes(deployment, options)
    listen = deployment.listen if options.listen is None else options.listen
    address = check_listen(listen, options.insecure, ports=2, secured=options.pki is not None)
    pace = deployment.pace if options.pace is None else read_at("--pace", parse_pace, options.pace)
    ticks = 0
    if options.duration is not None:
        ticks = -(-read_at("--for", parse_ns, options.duration) // deployment.tick_ns)
        if ticks == 0:
            raise BadValue("--for: a run has at least one tick", options.duration)
    branch = None if options.branch is None else read_branch(options.branch, deployment)
    return Plan(options, text, deployment, pace, ticks, address, branch, files)


def launch_of(options: RunOptions, capture: Path | None) -> Launch:
    """Return the options of a run as they are kept in its folder."""
    return Launch(
        str(options.file.absolute()),
        "" if capture is None else str(capture.absolute()),
        options.pace,
        options.duration,
        options.seed,
        options.sets,
        options.listen,
        options.insecure,
        None if options.pki is None else str(options.pki.absolute()),
        None if options.branch is None else str(Path(options.branch).absolute()),
        options.balance,
    )


def options_of(launch: Launch) -> RunOptions:
    """Return the options that are kept in a run's folder; the inverse of `launch_of`."""
    pki = None if launch.pki is None else Path(launch.pki)
    timing = launch.pace, launch.duration, launch.seed
    return RunOptions(
        Path(launch.file), *timing, launch.sets, launch.listen, launch.insecure, pki, launch.branch, launch.balance
    )


def plan_again(folder: RunFolder) -> tuple[Plan, Path | None]:
    """Return the plan and the capture of a run whose launcher is gone. Raises Refused when it cannot go on."""
    if folder.is_live() or not folder.is_left():
        raise Refused(f"run {folder.name} is alive: its processes are started again by themselves")
    launch = folder.launch()
    if launch is None:
        raise Refused(f"run {folder.name} has no launcher that was lost: what was started by hand is so again")
    capture = Path(launch.capture) if launch.capture else None
    plan = make_plan(options_of(launch))
    check_resumable(folder, plan.options, capture, has_hub_here=VHUB not in places(plan.deployment))
    return plan, capture
