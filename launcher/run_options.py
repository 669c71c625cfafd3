"""The options of a run, as a person gives them and as they are kept in its folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from foosim.runtime.run_folder import Launch


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
