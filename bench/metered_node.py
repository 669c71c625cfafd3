"""A node's process with a meter in it: the same code as `foosim-node`, its engine, core, loop and inbox metered.

The bench starts it for a node that the deployment declares as `launch: manual`; its last line is JSON, microseconds a
tick by part. `wait` is the time in the inbox, `encode` that of making its part and of publishing, `decode` that of
reading what came, `rest` what is left of the tick: sensing, editing, assigning, assembling.
"""

from __future__ import annotations

import argparse
import json
import time
from typing import Final
from unittest import mock

from bench.meter import Meter, metered_engine
from foosim.node import main as node_main
from foosim.node.core import NodeCore
from foosim.node.engines_pool import Solver
from foosim.node.tick import Work
from foosim.protocol.channels import Channel
from foosim.runtime.roles import shell
from foosim.runtime.roles.loop import Loop
from foosim.runtime.roles.role import Role
from foosim.runtime.transport.inbox import Inbox, Item

PARTS: Final = ("load", "command", "step", "read", "encode", "decode", "wait")
WARM_TICKS: Final = 50

METER: Final = Meter()


class MeteredCore(NodeCore):
    """Counts what is read and what is said."""

    def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None:
        begun_ns = time.perf_counter_ns()
        super().receive(channel, name, payload, now_ns)
        METER.add("decode", begun_ns)

    def solved(self, work: Work) -> None:
        begun_ns = time.perf_counter_ns()
        super().solved(work)
        METER.add("encode", begun_ns)


class MeteredInbox(Inbox):
    """Counts how long the loop waits."""

    def take(self, timeout_s: float | None, lacking: str = "", count: int = 1) -> list[Item]:
        begun_ns = time.perf_counter_ns()
        items = super().take(timeout_s, lacking, count)
        METER.add("wait", begun_ns)
        return items


class MeteredLoop(Loop):
    """Marks every tick."""

    def go_round(self) -> None:
        super().go_round()
        core = self.roles[0].core
        assert isinstance(core, NodeCore)
        frame = core.frame
        if frame is None or frame.tick < WARM_TICKS:
            return
        if METER.has_begun:
            METER.mark(frame.tick)
        else:
            METER.begin(frame.tick)


class MeteredRole(Role):
    """Counts publishing."""

    def perform(self) -> None:
        begun_ns = time.perf_counter_ns()
        super().perform()
        METER.add("encode", begun_ns)


def metered_solver(core: NodeCore) -> Solver:
    """Return a solver whose engines are metered."""
    return Solver(core, metered_engine(METER))


def run_metered(name: str, connect: str) -> dict[str, float]:
    """Be a node until the run ends; return microseconds a tick by part."""
    with (
        mock.patch.multiple(node_main, NodeCore=MeteredCore, Solver=metered_solver),
        mock.patch.multiple(shell, Inbox=MeteredInbox, Loop=MeteredLoop, Role=MeteredRole),
    ):
        node_main.run_node(name, connect)
    spent = METER.us_per_tick()
    parts = {part: spent.get(part, 0.0) for part in PARTS}
    return {
        **parts,
        "rest": round(spent["total"] - sum(parts.values()), 1),
        "total": spent["total"],
        "cpu": spent["cpu"],
    }


def main() -> None:
    """Run as a process of the bench."""
    parser = argparse.ArgumentParser(description="A node that says where its ticks went.")
    parser.add_argument("--name", required=True)
    parser.add_argument("--connect", required=True)
    chosen = parser.parse_args()
    print(json.dumps(run_metered(chosen.name, chosen.connect)), flush=True)


if __name__ == "__main__":
    main()
