"""Trains a goalkeeper by CMA-ES, and lets it play against the keeper that foosim has.

    pip install 'foosim[learn]' cma
    python examples/train_keeper.py

Each policy of a generation defends the same shots, and CMA-ES learns from their ranks. The mean of each generation
defends other shots; the one that saves most of them is written to `keeper.json`. Equal seeds train equal keepers, with
any number of processes. The class `Keeper` plays by that file in any run of the table.
"""

import argparse
import json
import multiprocessing
import os
import warnings
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foosim import Commands, Deployment, Player, Samples, Simulation
from foosim.env import TABLE

HIDDEN, INPUTS = 4, 5
WEIGHTS = HIDDEN * INPUTS + HIDDEN + INPUTS
SLIDE_M = 0.12
SMOOTHING = 0.6  # the share of a new measurement in the ball's velocity
SPEED_MAX = 20.0  # m/s: a ball that seems faster was put elsewhere
FIRST_TRIAL = 1_000_000  # the seed of the first shot that chooses a mean; none of these is learned from
Numbers = NDArray[np.float64]


class Policy:
    """From the ball's place and velocity, in its team's view, to the goalkeeper's slide: one hidden layer."""

    def __init__(self, weights: Sequence[float] | Numbers) -> None:
        hidden, self.last = np.split(np.asarray(weights, float), [HIDDEN * INPUTS])
        self.hidden = hidden.reshape(HIDDEN, INPUTS)
        self.measured_s, self.place, self.velocity = -np.inf, np.zeros(2), np.zeros(2)

    def slide(self, now_s: float, measured_s: float, place: Numbers) -> float:
        """Return the slide (m) at a time, by the ball's place (m) and when it was measured."""
        if measured_s > self.measured_s + 1e-6:
            moved = (place - self.place) / (measured_s - self.measured_s)
            is_put = self.measured_s == -np.inf or np.hypot(*moved) > SPEED_MAX
            self.velocity = np.zeros(2) if is_put else self.velocity + SMOOTHING * (moved - self.velocity)
            self.measured_s, self.place = measured_s, place
        present = self.place + self.velocity * (now_s - self.measured_s)
        inputs = np.array([present[0], 20 * present[1], 0.1 * self.velocity[0], self.velocity[1], 1.0])
        hidden = np.append(squashed((self.hidden * inputs).sum(axis=1)), inputs)
        return SLIDE_M * float(squashed((self.last * hidden).sum()))


def squashed(number: Any) -> Any:
    """Return numbers between -1 and 1."""
    return number / (1.0 + np.abs(number))


@cache
def environment() -> Any:
    """Return this process's environment: red's goalkeeper against one shot."""
    import gymnasium

    return gymnasium.make("foosim.env:foosim/DefendShot-v0", ages=True)


def mean_reward(weights: Numbers, seeds: Sequence[int]) -> float:
    """Return the mean reward of some shots: 1 for each that is saved, -1 for each goal."""
    env, total = environment(), 0.0
    for seed in seeds:
        policy, is_over = Policy(weights), False
        (x, y, _, age), info = env.reset(seed=seed)
        while not is_over:
            now_s = info["time_s"]
            slide = 0.0 if age < 0 else policy.slide(now_s, now_s - age, np.array([x, y]))
            (x, y, _, age), reward, is_over, _, info = env.step(np.array([slide, 0.0]))
            total += reward
    return total / len(seeds)


def train(pool: Executor, chosen: argparse.Namespace) -> tuple[Numbers, list[float]]:
    """Return the weights that are kept, and the mean rewards of the trials: at the start, after each generation."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # cma warns that it cannot draw without matplotlib
        from cma import CMAEvolutionStrategy
    options = {"seed": chosen.seed + 1, "popsize": chosen.policies, "verbose": -9}
    strategy, best = CMAEvolutionStrategy(np.zeros(WEIGHTS), 0.3, options), np.zeros(WEIGHTS)
    trials = range(FIRST_TRIAL, FIRST_TRIAL + chosen.trials)
    rewards = [mean_reward(best, trials)]
    print(f"standing still: mean reward {rewards[0]:+.2f}", flush=True)
    for generation in range(1, chosen.generations + 1):
        first = 10_000_000 * chosen.seed + generation * chosen.shots
        policies = strategy.ask()
        tried = pool.map(mean_reward, policies, [range(first, first + chosen.shots)] * len(policies))
        strategy.tell(policies, [-reward for reward in tried])
        rewards.append(mean_reward(strategy.mean, trials))
        if rewards[-1] >= max(rewards):
            best = strategy.mean.copy()
        print(f"generation {generation}: mean reward {rewards[-1]:+.2f}", flush=True)
    return best, rewards


class Keeper(Player):
    """A player: a team's trained goalkeeper; its other rods rest. Parameters: `team`, and the file `weights`."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        self.policy = Policy(json.loads(Path(parameters.get("weights", "keeper.json")).read_text()))
        self.rod = f"{parameters['team']}.goal"
        self.side = 1.0 if parameters["team"] == "red" else -1.0
        self.tick_s = deployment.tick_ns * 1e-9

    def act(self, tick: int, samples: Samples) -> Commands:
        """Return the goalkeeper's command, once the ball was seen."""
        ball: Any = samples.get(("camera", "ball"))
        if ball is None:
            return {}
        place = np.array([self.side * ball.value.x, ball.value.y])
        return {self.rod: {"slide": self.policy.slide(tick * self.tick_s, ball.sent_ns * 1e-9, place), "spin": 0.0}}


def match(player: str, parameters: Mapping[str, str], minutes: float) -> str:
    """Return the score of a match over the emulated network: a player as red against the shipped keeper."""
    red = {"class": player, "parameters": {"team": "red", **parameters}}
    sets = [f"players.player-red.{key}={json.dumps(value)}" for key, value in red.items()]
    sets.append("players.player-blue.class=foosim.library.table.players.football:Keeper")
    with Simulation(TABLE, sets=sets, agents=[], network=True) as simulation:
        simulation.step(ticks=round(minutes * 60e9 / simulation.deployment.tick_ns))
        return "{red} : {blue}".format(**simulation.status["score"])


def main(arguments: Sequence[str] | None = None) -> list[float]:
    """Train, write, play; return the mean rewards of the training."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("keeper.json"), help="the trained weights (keeper.json)")
    parser.add_argument("--generations", type=int, default=12, help="number of generations (12)")
    parser.add_argument("--policies", type=int, default=12, help="policies of a generation (12)")
    parser.add_argument("--shots", type=int, default=40, help="shots at each of them (40)")
    parser.add_argument("--trials", type=int, default=60, help="other shots at the mean of a generation (60)")
    parser.add_argument("--seed", type=int, default=1, help="of the shots and of the policies that are tried (1)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="number of processes; changes no result")
    parser.add_argument("--minutes", type=float, default=1.0, help="simulated length of each match (1)")
    chosen = parser.parse_args(arguments)
    with ProcessPoolExecutor(chosen.jobs, multiprocessing.get_context("spawn")) as pool:
        best, rewards = train(pool, chosen)
        chosen.out.write_text(json.dumps(best.tolist()))
        print(f"kept: mean reward {max(rewards):+.2f}, in {chosen.out}", flush=True)
        trained = ("train_keeper:Keeper", {"weights": str(chosen.out.absolute())})
        players = {"standing still": ("foosim.library.table.players.football:Passive", {}), "trained": trained}
        scores = pool.map(match, *zip(*players.values(), strict=True), [chosen.minutes] * len(players))
        for name, score in zip(players, scores, strict=True):
            print(f"{name} against the shipped keeper: {score}")
    return rewards


if __name__ == "__main__":
    main()
