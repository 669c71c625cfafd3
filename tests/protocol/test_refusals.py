"""Refusals, counted by whom, the first ones told with their bytes, strangers who go too far shut out."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import pytest

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.actions import Log
from foosim.protocol.codec import encode
from foosim.protocol.messages import Want
from foosim.protocol.rejects import LOGGED_MAX, OTHERS, QUARANTINE_NS, REFUSALS_MAX, WINDOW_NS, Quarantined, Refusals

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
DEPLOYMENT: Final[Deployment] = load_deployment(TABLE.read_text(), TABLE.name)


class Guard:
    """Refusals, and what it says. `knock` brings something and returns whether it was let in, refused or shut out."""

    def __init__(self, deployment: Deployment | None = DEPLOYMENT) -> None:
        self.said: list[Log] = []
        self.refusals = Refusals(self.said.append, lambda: deployment)

    def knock(self, name: str, now_ns: int, payload: bytes = b"\xc1") -> str:
        try:
            self.refusals.read(channels.WANT, name, payload, now_ns)
        except Malformed as error:
            self.refusals.refuse(channels.WANT, name, payload, error, now_ns)
            return "shut out" if isinstance(error, Quarantined) else "refused"
        return "in"


def true_want(name: str) -> bytes:
    return encode(Want(name, "part", 1, 1, []))


def test_the_first_refusals_of_each_sender_are_told_with_their_bytes() -> None:
    guard = Guard()
    for number in range(5):
        assert guard.knock("red", number, b"\xc1" * 40) == guard.knock("x\n", number, b"") == "refused"
    assert guard.refusals.counts == {("want", "red"): 5, ("want", "x\n"): 5}
    assert guard.refusals.by_sender() == {"want 'x\\n'": 5, "want red": 5}
    lines = [say.text for say in guard.said]
    assert len(lines) == 6 and all("\n" not in line for line in lines)
    assert lines[0].startswith("refused from red on want: ") and lines[0].endswith(f"(40 bytes: {'c1' * 32})")
    assert lines[1].startswith("refused from 'x\\n' on want: ") and lines[1].endswith("(0 bytes)")


def test_a_stranger_who_goes_too_far_is_shut_out_for_a_while() -> None:
    guard = Guard()
    assert [guard.knock("stranger", 5) for _ in range(REFUSALS_MAX)] == ["refused"] * REFUSALS_MAX
    assert guard.knock("stranger", 5, true_want("stranger")) == "in", "a hundred are not too many"
    assert guard.knock("stranger", 6) == "refused"
    assert guard.knock("stranger", 7, true_want("stranger")) == "shut out"
    assert guard.knock("stranger", 6 + QUARANTINE_NS - 1) == "shut out"
    assert guard.refusals.counts == {("want", "stranger"): REFUSALS_MAX + 3}
    (error,) = [say.text for say in guard.said if say.level == "error"]
    assert error == "more than 100 messages of stranger were refused within a second: it is in quarantine for 10 s"
    assert guard.knock("stranger", 6 + QUARANTINE_NS, true_want("stranger")) == "in"
    assert guard.knock("other", 7, true_want("other")) == "in"


def test_slow_refusals_are_no_flood() -> None:
    guard = Guard()
    for number in range(1000):
        assert guard.knock("stranger", number * WINDOW_NS // REFUSALS_MAX) == "refused"


@pytest.mark.parametrize("name", ["red", "player-blue", "supervisor", "vhub"])
def test_whoever_is_declared_is_named_and_heard(name: str) -> None:
    """Or who may write under its name could silence it."""
    guard = Guard()
    for _ in range(5 * REFUSALS_MAX):
        assert guard.knock(name, 5) == "refused"
    assert guard.knock(name, 6, true_want(name)) == "in"
    (error,) = [say.text for say in guard.said if say.level == "error"]
    assert error == f"more than 100 messages of {name} were refused within a second"


def test_nobody_is_a_stranger_before_the_deployment_is_known() -> None:
    guard = Guard(None)
    assert {guard.knock("somebody", 5) for _ in range(5 * REFUSALS_MAX)} == {"refused"}


def test_a_crowd_of_names_costs_no_more_than_a_limit() -> None:
    guard = Guard()
    for number in range(3 * limits.CLIENTS_MAX):
        guard.knock(f"s{number}", number)
    assert len(guard.refusals.counts) == limits.CLIENTS_MAX + 1
    assert guard.refusals.counts["want", OTHERS] == 2 * limits.CLIENTS_MAX
    assert len(guard.said) == LOGGED_MAX
