"""The player that acts by a learned policy: what it reads, and that it is the same in training and in a run."""

from __future__ import annotations

import json
from math import inf
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import pytest
from msgspec.structs import replace

from foosim.client.vectors import Column
from foosim.common.errors import BadValue, UnknownName
from foosim.players.learning.exercises import DEFEND
from foosim.players.learning.learned import Learned, read_policy
from foosim.players.learning.policy import Policy, PolicyFile
from foosim.rehearsal.env.episodes import Episodes
from foosim.rehearsal.simulation import Simulation, read_for_stepping

READS: Final = [Column("camera", "ball", field, "m", -inf, inf) for field in "xy"]
AGE: Final = Column("camera", "ball", "age", "s", -1.0, inf)
SLIDE: Final = Column("red.goal", "position", "slide", "m", -0.1, 0.1)
SPIN: Final = Column("red.goal", "position", "spin", "rad", -2.0, 4.0)
SHAPE: Final = PolicyFile(
    readings=["camera/ball"],
    commands=["red.goal/position"],
    bounds={},
    columns={"camera/ball.y": (1.0, 10.0)},
    moves=["red.goal/position.slide"],
    hidden=1,
)


def policy(**weights: float) -> Policy:
    """Return a policy with weights: those of the hidden unit, then those of the slide."""
    made = Policy(SHAPE, [*READS, AGE], [SLIDE, SPIN])
    names = ("value", "rate", "one", "hidden", "straight", "straight_rate", "last")
    made.set_weights([weights.get(name, 0.0) for name in names])
    return made


def squashed(number: float) -> float:
    return number / (1.0 + abs(number))


def test_it_has_the_weights_of_one_hidden_layer() -> None:
    assert SHAPE.size == 7
    found = policy(value=2.0, one=0.5, hidden=3.0, last=-1.0).act(np.array([9.0, 0.25, 0.0]), 1.0)
    assert found[0] == pytest.approx(0.1 * squashed(3.0 * squashed(2.0 * 0.25 + 0.5) - 1.0), abs=1e-15)
    assert found[1] == 1.0, "what it does not move stays in the middle of its bounds"


def test_what_it_moves_sees_the_inputs_beside_the_hidden_units() -> None:
    made = policy(straight=2.0, straight_rate=0.5)
    assert made.act(np.array([9.0, 0.25, 0.0]), 1.0)[0] == pytest.approx(0.1 * squashed(2.0 * 0.25), abs=1e-15)
    found = made.act(np.array([9.0, 0.26, 0.0]), 1.01)
    assert found[0] == pytest.approx(0.1 * squashed(2.0 * 0.26 + 0.5 * 1.0 / 10.0), abs=1e-9)
    linear = Policy(replace(SHAPE, hidden=0), [*READS, AGE], [SLIDE, SPIN])
    linear.set_weights([2.0, 0.0, 1.0])
    assert linear.act(np.array([9.0, 0.25, 0.0]), 1.0)[0] == pytest.approx(0.1 * squashed(1.5), abs=1e-15)


def test_a_reading_is_carried_on_by_its_rate_to_the_present() -> None:
    """0.1 m in 10 ms is 10 m/s: read 20 ms ago at 0.2 m, it is at 0.4 m now."""
    made = policy(value=1.0, hidden=1.0)
    made.act(np.array([0.0, 0.1, 0.0]), 0.0)
    found = made.act(np.array([0.0, 0.2, 0.02]), 0.03)
    assert found[0] == pytest.approx(0.1 * squashed(squashed(0.4)))
    again = made.act(np.array([0.0, 0.2, 0.03]), 0.04)
    assert again[0] == pytest.approx(0.1 * squashed(squashed(0.5))), "the same reading, which is older now"


def test_a_reading_that_has_not_come_and_one_put_elsewhere_have_no_rate() -> None:
    made = policy(rate=1.0, hidden=1.0)
    for vector, now_s in (((0.0, 0.0, -1.0), 0.0), ((0.0, 0.3, 0.0), 0.01), ((0.0, 0.9, 0.0), 0.02)):
        assert made.act(np.array(vector), now_s)[0] == 0.0
    assert made.act(np.array([0.0, 0.8, 0.0]), 0.03)[0] == pytest.approx(0.1 * squashed(squashed(-10.0 / 10.0)))
    made.begin()
    assert made.act(np.array([0.0, 0.7, 0.0]), 0.04)[0] == 0.0


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"columns": {"camera/ball.w": (1.0, 1.0)}}, UnknownName, "uses what is not read.*camera/ball.x"),
        ({"moves": ["red.goal/position.slip"]}, UnknownName, "moves what is not commanded.*red.goal/position.slide"),
        ({"weights": [1.0]}, BadValue, "has 7 finite weights, 1"),
        ({"weights": [float("nan")] * 7}, BadValue, "has 7 finite weights"),
    ],
)
def test_policies_that_do_not_fit(change: dict[str, Any], error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        Policy(replace(SHAPE, **change), [*READS, AGE], [SLIDE, SPIN])


def test_files_that_are_no_policies(tmp_path: Path) -> None:
    deployment = read_for_stepping(DEFEND.file, DEFEND.sets)
    with pytest.raises(BadValue, match=r"a policy that cannot be read: No such file"):
        Learned(deployment, {"weights": str(tmp_path / "none.json")})
    path = tmp_path / "policy.json"
    shape = msgspec.to_builtins(SHAPE)
    for change, words in (
        ({"readings": 3}, r"no policy: Expected `array`"),
        ({"hidden": -1}, r"no policy: Expected `int` >= 0"),
        ({"columns": {"camera/ball.y": (0.0, 1.0)}}, r"no policy: Expected `float` > 0"),
    ):
        path.write_text(json.dumps(shape | change))
        with pytest.raises(BadValue, match=words):
            Learned(deployment, {"weights": str(path)})
    with pytest.raises(BadValue, match=r"weights: not the path of a file, 3"):
        Learned(deployment, {"weights": 3})
    with pytest.raises(UnknownName, match=r"unknown parameter.*weights"):
        Learned(deployment, {"weight": ""})


def test_the_player_of_a_run_does_what_the_policy_did_in_training(tmp_path: Path) -> None:
    """Without a network between: the same frames, bit for bit, over shots that it saves and does not."""
    weights = [round(float(np.sin(3.0 * number)), 3) for number in range(DEFEND.untrained.size)]
    file = replace(DEFEND.untrained, weights=weights)
    path = tmp_path / "policy.json"
    path.write_bytes(msgspec.json.encode(file))
    assert read_policy(path) == file
    episodes = Episodes(
        DEFEND.file,
        rate_hz=DEFEND.rate_hz,
        reward=DEFEND.reward,
        readings=file.readings,
        ages=True,
        sets=DEFEND.sets,
    )
    made = Policy(file, *episodes.columns(DEFEND.agent))
    deployment = read_for_stepping(DEFEND.file, [*DEFEND.sets, f"players.player-red.parameters={{weights: '{path}'}}"])
    with Simulation(deployment, agents=[]) as simulation:
        for seed in (1, 2):
            made.begin()
            vector = episodes.reset(seed, None)[DEFEND.agent]
            simulation.reset(episodes.simulation.frame, seed)
            for _ in range(12):
                vector = episodes.step({DEFEND.agent: made.act(vector, episodes.simulation.time_s)}).observations[
                    DEFEND.agent
                ]
                simulation.step(ticks=episodes.ticks)
                assert simulation.frame.digest == episodes.simulation.frame.digest
                if not episodes.is_running:
                    break
            assert simulation.frame.at("red.goal", "joint_positions") != 0.0
    episodes.close()
