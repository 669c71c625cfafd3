"""Tries at an exercise: by a policy in an environment, or by the player itself over the emulated network."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeAlias

from foosim.client.vectors import Vector
from foosim.players.learning.exercises import Exercise
from foosim.players.learning.learned import Learned
from foosim.players.learning.policy import Policy
from foosim.rehearsal.env.episodes import Episodes
from foosim.rehearsal.simulation import Simulation, read_for_stepping

Act: TypeAlias = Callable[[Vector, float], Vector]
"""From an observation and the time (s) to an action."""


class Range:
    """An exercise without a network, for policies of one shape, one after the other."""

    def __init__(self, exercise: Exercise) -> None:
        """Raises as `Episodes` does."""
        file = exercise.untrained
        self._exercise = exercise
        self._episodes = Episodes(
            exercise.file,
            agents=[exercise.agent],
            rate_hz=exercise.rate_hz,
            reward=exercise.reward,
            readings=file.readings,
            commands=file.commands,
            bounds=file.bounds,
            ages=True,
            sets=exercise.sets,
        )
        self._policy = Policy(file, *self._episodes.columns(exercise.agent))

    def wins(self, weights: Sequence[float] | Vector, seeds: Sequence[int]) -> list[bool]:
        """Return for each try, by its seed, whether its last step was worth more than nothing with these weights."""
        self._policy.set_weights(weights)
        return [self._wins(self._policy.act, seed) for seed in seeds]

    def wins_by_hand(self, seeds: Sequence[int]) -> list[bool]:
        """Return the same of the exercise's controller that was written by hand."""
        return [self._wins(lambda vector, _: self._exercise.by_hand(vector), seed) for seed in seeds]

    def _wins(self, act: Act, seed: int) -> bool:
        episodes, agent = self._episodes, self._exercise.agent
        self._policy.begin()
        vector = episodes.reset(seed, None)[agent]
        while True:
            found = episodes.step({agent: act(vector, episodes.simulation.time_s)})
            if found.is_over:
                return found.rewards[agent] > 0.0
            vector = found.observations[agent]

    def close(self) -> None:
        """Free the engines."""
        self._episodes.close()


class Network:
    """An exercise over the emulated network, at which the player acts by itself, as in a run."""

    def __init__(self, exercise: Exercise, delay_ms: float, weights: Path | None = None) -> None:
        """`delay_ms` is that of each packet, one way. `weights` is the policy's file, by default what was shipped.

        Raises BadValue for a policy that does not fit, DeploymentError for a delay that no link has.
        """
        links = f"network={{links: [{{id: delayed, from: '*', to: '*', delay: {delay_ms:g} ms}}]}}"
        chosen = {} if weights is None else {"weights": str(weights.absolute())}
        sets = [*exercise.sets, links, f"players.{exercise.agent}.parameters={json.dumps(chosen)}"]
        deployment = read_for_stepping(exercise.file, sets)
        Learned(deployment, chosen)  # refused here, a policy is bad input; amid a simulation it is a player that failed
        self._agent = exercise.agent
        self._simulation = Simulation(deployment, agents=[], network=True)
        self._reward = exercise.reward(deployment, {exercise.agent: exercise.robots})
        self._ticks = round(1e9 / exercise.rate_hz / deployment.tick_ns)

    def wins(self, seeds: Sequence[int]) -> list[bool]:
        """Return for each try, by its seed, whether the player's last step was worth more than nothing."""
        return [self._wins(seed) for seed in seeds]

    def _wins(self, seed: int) -> bool:
        simulation, reward = self._simulation, self._reward
        before = simulation.reset(reward.begin(simulation.start_frame(None, seed), seed), seed)
        while True:
            simulation.step(ticks=self._ticks)
            after = simulation.frame
            if reward.is_over(after):
                return reward.rate(before, after)[self._agent] > 0.0

    def close(self) -> None:
        """Free the engine."""
        self._simulation.close()
