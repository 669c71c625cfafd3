"""Several players in one process: all run until the end, and one that fails or is refused takes the others with it."""

from __future__ import annotations

from threading import Event
from typing import Any

import pytest

from foosim.client.errors import PlayerError
from foosim.client.main import Fleet, run_players
from foosim.common.errors import BadValue
from foosim.runtime.command import DONE, FAILED, REFUSED


class Plays:
    """What a Fleet runs: it ends with `code` or `error` at once, or when it is stopped."""

    def __init__(self, code: int | None = None, error: Exception | None = None) -> None:
        self.stopped = Event()
        self._code, self._error = code, error

    def run(self) -> int:
        if self._error is not None:
            raise self._error
        if self._code is None:
            assert self.stopped.wait(900.0), "nobody has stopped it"
            return FAILED
        return self._code

    def stop(self) -> None:
        self.stopped.set()


def fleet_of(*players: Plays) -> Fleet:
    members: Any = players
    return Fleet(members)


def test_all_end_with_the_run() -> None:
    assert fleet_of(Plays(DONE), Plays(DONE), Plays(DONE)).run() == DONE


def test_one_that_is_refused_stops_the_others() -> None:
    waiting = Plays(), Plays()
    assert fleet_of(waiting[0], Plays(REFUSED), waiting[1]).run() == REFUSED
    assert all(player.stopped.is_set() for player in waiting)


def test_one_that_fails_stops_the_others_and_says_why() -> None:
    waiting = Plays()
    with pytest.raises(PlayerError, match="act failed"):
        fleet_of(Plays(DONE), Plays(error=PlayerError("player b: act failed")), waiting).run()
    assert waiting.stopped.is_set()


def test_a_signal_ends_all() -> None:
    players = Plays(), Plays()
    fleet = fleet_of(*players)
    fleet.stop()
    assert fleet.run() == FAILED


@pytest.mark.parametrize(("names", "text"), [(["a", "B"], "not a name for a player"), (["a", "a"], "named twice")])
def test_names_are_looked_at_before_anything_is_opened(names: list[str], text: str) -> None:
    with pytest.raises(BadValue, match=text):
        run_players(names, "tcp/127.0.0.1:1")
