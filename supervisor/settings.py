"""The settings with which a supervisor is started."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from foosim.common.units import Pace
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.world.start import Origin, Start


@dataclass(frozen=True, slots=True)
class RunSettings:
    """The settings of one run. It ends after `ticks`, or by request where that is 0.

    `start` is the frame of another run that it begins with; None: frame 0.
    """

    run: str
    deployment_name: str
    deployment_text: str
    pace: Pace
    ticks: int = 0
    start: Start | None = None
    balance: bool = False
    """Whether robots move between nodes by measured load."""
    options: Sequence[str] = ()
    """The arguments of the command that began the run; where there are none, its deployment's file."""
    files: Mapping[str, bytes] = field(default_factory=dict, repr=False)
    """The contents of the files that the deployment refers to, by path."""
    processes: Mapping[str, str] = field(default_factory=dict)
    """The process of each role that `up` started with others in one, by role."""

    def load_deployment(self) -> Deployment:
        """The deployment with its files; raises DeploymentError or AssetError."""
        return load_deployment(self.deployment_text, self.deployment_name).with_assets(self.files)

    @property
    def arguments(self) -> Sequence[str]:
        """Return the arguments with which another run of the deployment begins."""
        return self.options or (self.deployment_name,)

    @property
    def origin(self) -> Origin | None:
        return None if self.start is None else self.start.origin

    @property
    def last_tick(self) -> int:
        """The tick of the frame that ends the run; 0: it ends on request."""
        return self.ticks and self.ticks + (0 if self.start is None else self.start.origin.tick)
