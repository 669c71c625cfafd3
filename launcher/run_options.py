"""The options of a run: parsed from the command line, passed to its processes, stored in its folder."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, get_type_hints

import msgspec
import typer

from foosim.common.errors import Refused
from foosim.runtime.command import PkiOption
from foosim.runtime.run_folder import LAUNCH_FILE, Launch, RunFolder


@dataclass(frozen=True, slots=True)
class RunOptions:
    """How to run a deployment file, texts as a person types them. Each field is an option of the commands."""

    file: Annotated[Path, typer.Argument(metavar="FILE", help="The deployment file.")]
    pace: Annotated[str | None, typer.Option("--pace", help="realtime, fast, or a factor such as 2x.")] = None
    duration: Annotated[str | None, typer.Option("--for", help="End after this much simulated time, e.g. 20s.")] = None
    seed: Annotated[int | None, typer.Option("--seed", help="Seed of all random draws; short for --set seed=N.")] = None
    branch: Annotated[
        str | None,
        typer.Option("--from", metavar="CAPTURE@TIME", help="Start with a captured frame: run.mcap@12.5s or @last."),
    ] = None
    sets: Annotated[
        tuple[str, ...],
        typer.Option("--set", help="Change the deployment, e.g. --set table.gravity='9.83 m/s2'; may be repeated."),
    ] = ()
    engine: Annotated[
        str | None, typer.Option("--engine", help="bullet, pure or another; short for --set engine=NAME.")
    ] = None
    listen: Annotated[
        str | None,
        typer.Option("--listen", help="HOST[:PORT], by default as deployed; the radio plane listens at PORT + 1."),
    ] = None
    insecure: Annotated[bool, typer.Option("--insecure", help="Listen for other machines without certificates.")] = (
        False
    )
    pki: PkiOption = None
    balance: Annotated[bool, typer.Option("--balance", help="Move robots from busy nodes to idle ones.")] = False
    processes: Annotated[
        str | None,
        typer.Option("--processes", help="deployed, one (a process for each host) or each (a process for each role)."),
    ] = None

    @property
    def all_sets(self) -> tuple[str, ...]:
        engine = () if self.engine is None else (f"engine={self.engine}",)
        return (*self.sets, *engine, *(() if self.seed is None else (f"seed={self.seed}",)))

    def arguments(self) -> list[str]:
        """Return the options as arguments of `foosim up` or `run`."""
        given = []
        for name, annotation in get_type_hints(RunOptions, include_extras=True).items():
            value, info = getattr(self, name), annotation.__metadata__[0]
            if isinstance(info, typer.models.ArgumentInfo):
                given.append(str(value))
            elif isinstance(value, bool):
                given += [info.default] if value else []
            elif value is not None:
                for one in value if isinstance(value, tuple) else (value,):
                    given += [info.default, str(one.absolute() if isinstance(one, Path) else one)]
        return given

    def pki_arguments(self) -> list[str]:
        """Return the certificates' folder as an argument for each process of the run."""
        return [] if self.pki is None else ["--pki", str(self.pki.absolute())]


def launch_of(options: RunOptions, capture: Path | None) -> Launch:
    """Return the options and the capture of a run as stored in its folder, with absolute paths."""
    kept = replace(
        options,
        file=options.file.absolute(),
        pki=None if options.pki is None else options.pki.absolute(),
        branch=None if options.branch is None else str(Path(options.branch).absolute()),
    )
    raw = msgspec.Raw(msgspec.json.encode(kept, enc_hook=str))
    return Launch("" if capture is None else str(capture.absolute()), raw)


def launched_options(folder: RunFolder) -> RunOptions:
    """Return the options stored in a run's folder. Raises Refused when there are none."""
    launch = folder.launch()
    path = folder.path / LAUNCH_FILE
    if launch is None and not path.exists():
        raise Refused(f"run {folder.name} has no launcher that was lost: what was started by hand is so again")
    try:
        if launch is None:
            raise msgspec.ValidationError("it has no capture and options")
        known = {field.name for field in fields(RunOptions)}
        if unknown := sorted(set(msgspec.json.decode(launch.options)) - known):
            raise msgspec.ValidationError(f"there is no option {unknown[0]}")
        return msgspec.json.decode(launch.options, type=RunOptions, dec_hook=lambda kind, value: kind(value))
    except msgspec.DecodeError as error:
        reason = f"{path} was written by another version of foosim, or is damaged: {error}"
        raise Refused(f"run {folder.name} cannot be resumed with its options: {reason}") from None
