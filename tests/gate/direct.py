"""Planted bugs that the swarm meets too rarely: a test of the cores finds each of them, directly.

`python -m tests.gate.direct` runs these tests, each in a fork of a process that has collected all of them, with its
bug planted. To add one: as in `tests.gate.search`, with the id of the test that fails with the bug in place of a seed.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

import msgspec
import pytest
from msgspec.structs import replace

from foosim.client.core import ClientCore
from foosim.node.core import NodeCore
from foosim.runtime.roles.bus import Bus
from foosim.runtime.roles.loop import Loop
from foosim.supervisor.failover import Failover
from foosim.supervisor.state import RunState
from foosim.vhub.network.draw_address import DrawKeys
from foosim.vhub.sessions import Sessions
from foosim.vhub.state import hub_state
from tests.gate.planting import Planting

ROOT: Final = Path(__file__).parents[2]
OPTIONS: Final = ("-q", "-n", "0", "-p", "no:cacheprovider")


class Failed(NamedTuple):
    """How a test ended with a bug planted."""

    exit_code: int
    output: str


@dataclass(frozen=True, slots=True)
class DirectMutant:
    """A planted bug: the rule that is switched off, and the id of the test that finds it."""

    name: str
    rule: str
    test: str
    plant: Callable[[Planting], None]


def run_all(folder: Path) -> dict[str, Failed]:
    """Run the test of each bug with the bug planted; the folder takes their output."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    command = [sys.executable, "-m", __name__, str(folder)]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    codes = msgspec.json.decode(done.stdout.splitlines()[-1], type=dict[str, int])
    return {name: Failed(code, (folder / name).read_text()) for name, code in codes.items()}


def _run_forked(mutant: DirectMutant, output: Path) -> int:
    """Run a mutant's test in a fork, which ends with the exit code of pytest."""
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        with output.open("w") as file:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
            mutant.plant(Planting())
            code = pytest.main([*OPTIONS, mutant.test])
            sys.stdout.flush()
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def main() -> None:
    """Print the exit codes by name, in the last line; the tests' output goes into the folder that is named."""
    assert pytest.main([*OPTIONS, "--collect-only", *(mutant.test for mutant in DIRECT)]) == pytest.ExitCode.OK
    codes = {mutant.name: _run_forked(mutant, Path(sys.argv[1], mutant.name)) for mutant in DIRECT}
    print(f"\n{msgspec.json.encode(codes).decode()}")


def _epochs_fall(planting: Planting) -> None:
    def on_epoch(self: Any, epoch: Any, payload: bytes, now_ns: int) -> None:
        if self.epoch > epoch.epoch and self.name in epoch.roster:
            self.epoch = epoch.epoch - 1
        before(self, epoch, payload, now_ns)

    before: Any = planting.swap(NodeCore, "_on_epoch", on_epoch)


def _volatile(planting: Planting) -> None:
    def restore(self: Any, history: Any) -> None:
        before(self, history)
        self.epoch = 0

    def on_standing(self: Any, standing: Any, now_ns: int) -> bool:
        self._standing = self._standing or standing
        return True

    before: Any = planting.swap(RunState, "restore", restore)
    planting.swap(Failover, "on_standing", on_standing)


def _unsent(planting: Planting) -> None:
    planting.swap(Sessions, "send_owed", lambda self, name, now_ns: None)


def _any_welcome(planting: Planting) -> None:
    def on_welcome(self: Any, welcome: Any) -> None:
        before(self, replace(welcome, returns=self._gone))

    before: Any = planting.swap(ClientCore, "_on_welcome", on_welcome)


def _other_order(planting: Planting) -> None:
    def add(self: Any, role: Any) -> None:
        before(self, role)
        self.roles.insert(0, self.roles.pop())

    before: Any = planting.swap(Loop, "add", add)


def _work_first(planting: Planting) -> None:
    def turn_all(self: Any, items: Any, bus: Any, now_ns: int) -> None:
        for role in self.roles:
            role.do_work(now_ns)
        before(self, items, bus, now_ns)

    before: Any = planting.swap(Loop, "_turn_all", turn_all)


def _heard_again(planting: Planting) -> None:
    def put(self: Any, sender: str, *message: Any) -> None:
        before(self, "", *message)

    before: Any = planting.swap(Bus, "put", put)


def _by_place(planting: Planting) -> None:
    planting.swap(hub_state, "counts_within_channels", lambda packets: [packet.index for packet in packets])


def _one_key(planting: Planting) -> None:
    planting.swap(DrawKeys, "of", lambda self, channel: self.key)


def _uncounted(planting: Planting) -> None:
    before: Any = planting.swap(hub_state, "robot_number", lambda tick, count: before(tick, 0))


DIRECT: Final = (
    DirectMutant(
        "robots draw by their sequence numbers",
        "another sensor shifts no draw of its robot's other packets",
        "tests/laws/test_components_law.py::test_a_further_encoder_changes_no_other_packet",
        _by_place,
    ),
    DirectMutant(
        "robots draw without the channel",
        "two channels of a robot in one tick have different draws",
        "tests/links/test_channels.py::test_no_two_packets_have_one_draw",
        _one_key,
    ),
    DirectMutant(
        "robots draw without the count",
        "two packets of one channel in one tick have different draws",
        "tests/links/test_channels.py::test_no_two_packets_have_one_draw",
        _uncounted,
    ),
    DirectMutant(
        "node goes back to an old epoch",
        "epochs only grow",
        "tests/laws/test_hub_recovery_law.py::test_an_epoch_that_is_older_than_the_newest_in_the_journal_is_refused",
        _epochs_fall,
    ),
    DirectMutant(
        "epochs are volatile",
        "a restarted supervisor continues with a greater epoch",
        "tests/supervisor/test_take_over.py::test_after_a_take_over_epochs_are_above_those_of_the_journal",
        _volatile,
    ),
    DirectMutant(
        "an unanswered Go is not sent again",
        "the Go of a player that left owing is sent again after the record",
        "tests/vhub/test_sessions.py::test_a_vhub_that_dies_behind_the_record_of_who_left_owing_leaves_nothing_unsaid",
        _unsent,
    ),
    DirectMutant(
        "client takes any welcome",
        "a welcome answers one hello",
        "tests/client/test_return.py::test_the_answer_to_a_hello_of_before_is_none",
        _any_welcome,
    ),
    DirectMutant(
        "roles take turns in another order",
        "the roles of a process take their turns in the order in which they were added",
        "tests/runtime/test_loop.py::"
        "test_roles_of_a_process_get_each_others_messages_in_a_fixed_order_and_the_network_gets_them_too",
        _other_order,
    ),
    DirectMutant(
        "engine before messages",
        "a role's long work begins when no message is left on the bus",
        "tests/runtime/test_loop.py::"
        "test_a_loop_with_messages_between_its_roles_does_not_sleep_and_works_when_none_is_left",
        _work_first,
    ),
    DirectMutant(
        "a role hears itself",
        "the bus hands a message to all readers but its sender",
        "tests/runtime/test_loop.py::"
        "test_roles_of_a_process_get_each_others_messages_in_a_fixed_order_and_the_network_gets_them_too",
        _heard_again,
    ),
)

if __name__ == "__main__":
    main()
