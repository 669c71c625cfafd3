"""Agents of environments come and go with their robots."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pytest

from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.simulation.env import FoosimEnv, FoosimParallelEnv, parallel_env
from tests.kinematic_yard import yard_text

PILOT: Final = {"class": "foosim.client.player:Player", "rate": "100 Hz", "robots": {"$robot": ["pose"]}}
ACTION: Final = np.array([0.5, 0.0])


def carts(present: int, spare: int) -> Deployment:
    """Carts with a pilot each, and a player of two of them."""
    pose = {"kind": "pose", "rate": "100 Hz"}
    fleet: dict[str, Any] = {"model": "differential_drive", "sensors": {"pose": pose}, "spacing": {"y": "2 m"}}
    if present:
        fleet["count"] = present
    players = {"pilot-$1": {**PILOT, "each": "cart-*"}}
    return load_deployment(yard_text({"cart": {**fleet, "spare": spare}}, players=players), "yard.yaml")


def step(env: FoosimParallelEnv) -> dict[str, bool]:
    """Step with an action of each agent; return the terminations, of just those of which anything is told."""
    observed, rewards, terminated, truncated, infos = env.step(dict.fromkeys(env.agents, ACTION))
    assert [*observed] == [*rewards] == [*terminated] == [*truncated] == [*infos]
    assert all(env.observation_space(name).contains(numbers) for name, numbers in observed.items())
    return terminated


@pytest.mark.parametrize("network", [False, True])
def test_an_agent_whose_robot_is_removed_is_terminated_and_comes_back_with_it(network: bool) -> None:
    env = parallel_env(carts(2, 1), network=network)
    observed, infos = env.reset(seed=1)
    everyone = ["pilot-1", "pilot-2", "pilot-3"]
    assert env.possible_agents == everyone
    assert env.agents == [*observed] == [*infos] == everyone[:2], "the last one is a spare"
    assert step(env) == dict.fromkeys(everyone[:2], False)
    env.simulation.add("cart-3", "5,5")
    assert step(env) == dict.fromkeys(everyone, False) and env.agents == everyone
    env.simulation.remove("cart-1")
    assert step(env) == {"pilot-1": True, "pilot-2": False, "pilot-3": False}
    assert env.agents == everyone[1:]
    assert step(env) == dict.fromkeys(everyone[1:], False)
    env.simulation.add("cart-1")
    assert step(env) == dict.fromkeys(everyone, False) and env.agents == everyone
    assert env.simulation.frame.vector("cart-1", "motion.set_point", 1) == [0.0], "it has no command yet"
    observed, _ = env.reset()
    assert env.agents == [*observed] == everyone[:2], "an episode begins with the deployment's"
    env.close()


def test_without_any_agent_the_world_goes_on() -> None:
    env = parallel_env(carts(0, 1))
    assert env.reset() == ({}, {}) and env.agents == []
    env.simulation.add("cart-1")
    assert step(env) == {"pilot-1": False} and env.agents == ["pilot-1"]
    env.close()


def test_an_agent_alone_has_its_last_observation_while_it_does_not_exist() -> None:
    env = FoosimEnv(carts(1, 1), "pilot-1")
    env.reset()
    for _ in range(3):
        before, *_ = env.step(ACTION)
    env.simulation.remove("cart-1")
    for _ in range(3):
        observed, _, terminated, truncated, _ = env.step(ACTION)
        assert (observed == before).all() and not terminated and not truncated
    env.simulation.add("cart-1", "3,3")
    observed, *_ = env.step(ACTION)
    assert observed[:2] == pytest.approx([3.0, 3.0])
    assert env.simulation.frame.vector("cart-1", "motion.set_point", 1) == [0.0], "nothing was sent meanwhile"
    env.step(ACTION)
    assert env.simulation.frame.vector("cart-1", "motion.set_point", 1) == [0.5]
    env.close()
