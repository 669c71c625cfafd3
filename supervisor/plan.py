"""What a run is asked for, and the same checked, before anything is started.

Neighbours: `up` and `main` carry it out, `cli` reads the options from a command line.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from foosim.protocol import identity, wall
from foosim.protocol.addresses import Address, check_listen
from foosim.protocol.certificates import load_credentials, operator_credentials
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.deployment import Deployment
from foosim.protocol.deployment_file import apply_sets, load_deployment, read_deployment_text
from foosim.protocol.errors import BadValue
from foosim.protocol.messages import Origin
from foosim.protocol.start import Start
from foosim.protocol.units import Pace, parse_ns, parse_pace


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
        for setting in self.sets:
            given += ["--set", setting]
        return given

    def pki_arguments(self) -> list[str]:
        """Return where the certificates are, as each process of the run is told it."""
        return [] if self.pki is None else ["--pki", str(self.pki)]


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

    @property
    def origin(self) -> Origin | None:
        return None if self.start is None else self.start.origin

    @property
    def last_tick(self) -> int:
        """The tick of the frame that ends the run; 0: it ends when it is asked to."""
        return self.ticks and self.ticks + (0 if self.start is None else self.start.origin.tick)


@dataclass(frozen=True, slots=True)
class Plan:
    """Options that were checked: the canonical text and what is in it, and when it ends (0 ticks: when asked to)."""

    options: RunOptions
    text: str
    deployment: Deployment
    pace: Pace
    ticks: int
    address: Address


def check_certificates(plan: Plan) -> list[str]:
    """Return which certificates end soon, of everybody whom `up` starts and of the operator that it is itself.

    Raises CertificateError when somebody would not be let in.
    """
    pki, deployment = plan.options.pki, plan.deployment
    nodes = [identity.node(name) for name, node in deployment.nodes.items() if node.launch == "local"]
    everybody = (SUPERVISOR, VHUB, *nodes, *map(identity.client, deployment.players))
    found = [*(load_credentials(pki, who) for who in everybody), operator_credentials(pki)]
    warnings = [credentials.ends_soon(wall.now_utc()) for credentials in found if credentials is not None]
    return [warning for warning in warnings if warning]


def make_plan(options: RunOptions) -> Plan:
    """Check everything that was asked for before anything is started; raises Refused."""
    name = str(options.file)
    text = apply_sets(read_deployment_text(options.file), name, options.all_sets)
    deployment = load_deployment(text, name)
    listen = deployment.listen if options.listen is None else options.listen
    address = check_listen(listen, options.insecure, ports=2, secured=options.pki is not None)
    pace = deployment.pace if options.pace is None else parse_pace(options.pace)
    ticks = 0
    if options.duration is not None:
        ticks = -(-parse_ns(options.duration) // deployment.tick_ns)
        if ticks == 0:
            raise BadValue("a run has at least one tick", options.duration)
    return Plan(options, text, deployment, pace, ticks, address)
