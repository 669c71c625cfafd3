"""The executor of a sweep or match: child processes of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Executor
from contextlib import contextmanager
from importlib import import_module
from logging import CRITICAL, getLogger
from typing import Annotated, Any, Final

import typer

from foosim.common.errors import BadValue, Failed
from foosim.simulation.study.run import OtherVersion, version_here
from foosim.simulation.workers import executor_here

CONNECT: Final = "5s"

JobsOption = Annotated[
    int | None, typer.Option("--jobs", help="Number of processes; by default that of the processors.", min=1)
]
DaskOption = Annotated[
    str | None,
    typer.Option("--dask", metavar="ADDRESS", help="Use the workers of this Dask scheduler; needs foosim[dask]."),
]


@contextmanager
def executor_of(jobs: int | None, dask: str | None) -> Iterator[Executor]:
    """Give the executor. Raises Failed for a cluster that does not answer, and where all workers end."""
    if dask is not None and jobs is not None:
        raise BadValue("--jobs: the workers of --dask are those of its cluster", jobs)
    with executor_here(jobs or os.cpu_count() or 1) if dask is None else _cluster(dask) as found:
        try:
            yield found
        except BrokenExecutor as error:
            raise Failed(f"all workers have ended: {error}") from None


@contextmanager
def _cluster(address: str) -> Iterator[Executor]:
    try:
        distributed: Any = import_module("distributed")
    except ImportError:
        raise Failed("--dask needs Dask: pip install 'foosim[dask]'") from None
    getLogger("distributed.client").setLevel(CRITICAL)  # a scheduler that ends is the message of the command
    try:
        client = distributed.Client(address, timeout=CONNECT)
    except (OSError, ValueError, TypeError) as error:  # the last one for tls:// without certificates
        raise Failed(f"--dask: {address}: no scheduler answers, {error}") from None
    with client:
        _check_versions(client)
        yield client.get_executor()


def _check_versions(client: Any) -> None:
    """Raise OtherVersion for a cluster with another foosim or none: a worker without it would end at its first run."""
    found = client.run(version_here, on_error="return")
    if not found:
        typer.echo("--dask: the cluster has no workers, the runs wait for some", err=True)
    try:
        found["its scheduler"] = client.run_on_scheduler(version_here)
    except (ImportError, AttributeError) as error:
        found["its scheduler"] = error
    for where, other in found.items():
        if other != version_here():
            raise OtherVersion(f"--dask: {where} has another foosim than this machine, {version_here()}: {other}")
