"""What a run is asked for, and the same checked, before anything is started.

Neighbours: `up` and `main` carry it out, `cli` reads the options from a command line.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from foosim.protocol.addresses import LOOPBACK, Address, check_listen
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
    listen: str = LOOPBACK
    insecure: bool = False

    @property
    def all_sets(self) -> tuple[str, ...]:
        return self.sets if self.seed is None else (*self.sets, f"seed={self.seed}")

    def arguments(self) -> list[str]:
        """Return the options as arguments of `foosim-supervisor run`."""
        given = [str(self.file), "--listen", self.listen]
        given += ["--insecure"] if self.insecure else []
        given += ["--pace", self.pace] if self.pace is not None else []
        given += ["--for", self.duration] if self.duration is not None else []
        given += ["--seed", str(self.seed)] if self.seed is not None else []
        for setting in self.sets:
            given += ["--set", setting]
        return given


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


def make_plan(options: RunOptions) -> Plan:
    """Check everything that was asked for before anything is started; raises Refused."""
    name = str(options.file)
    text = apply_sets(read_deployment_text(options.file), name, options.all_sets)
    deployment = load_deployment(text, name)
    address = check_listen(options.listen, options.insecure, ports=2)
    pace = deployment.pace if options.pace is None else parse_pace(options.pace)
    ticks = 0
    if options.duration is not None:
        ticks = -(-parse_ns(options.duration) // deployment.tick_ns)
        if ticks == 0:
            raise BadValue("a run has at least one tick", options.duration)
    return Plan(options, text, deployment, pace, ticks, address)
