"""A deployment as a PettingZoo `ParallelEnv`: each agent acts at each step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from foosim.client.jobs import Jobs
from foosim.client.vectors import Column
from foosim.common.errors import UnknownName
from foosim.deployment.schema import Deployment
from foosim.simulation.env.episodes import Episodes
from foosim.simulation.env.single import RENDER_MODES, check_render_mode
from foosim.simulation.env.spaces import box_of
from foosim.simulation.simulation import Simulation

Actions = Mapping[str, NDArray[np.float64]]
Infos = dict[str, dict[str, Any]]
Told = TypeVar("Told")


class FoosimParallelEnv(ParallelEnv[str, NDArray[np.float64], NDArray[np.float64]]):  # type: ignore[misc]
    """Agents of a deployment that act together. All end together: by the reward's class, or cut after the time.

    `agents` are those that exist. One whose last robot is removed is terminated; when one is added it comes back, with
    an observation.

    `infos` have the tick and the simulated time (`tick`, `time_s`). `metadata["render_fps"]` of an environment is the
    rate at which its agents act.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012  # as PettingZoo declares it
        "name": "foosim",
        "render_modes": RENDER_MODES,
        "is_parallelizable": True,
    }

    def __init__(
        self, deployment: Deployment | str | Path, *, render_mode: str | None = None, **arguments: Any
    ) -> None:
        """The arguments are those of `parallel_env`."""
        check_render_mode(render_mode)
        self.render_mode = render_mode
        self._episodes = Episodes(deployment, **arguments)
        self.metadata = {**self.metadata, "render_fps": self._episodes.rate_hz}
        self.possible_agents = list(self._episodes.agents)
        self.agents: list[str] = []
        of_all = {name: self._episodes.columns(name) for name in self.possible_agents}
        self.observation_spaces = {name: box_of(columns[0]) for name, columns in of_all.items()}
        self.action_spaces = {name: box_of(columns[1]) for name, columns in of_all.items()}

    @property
    def simulation(self) -> Simulation:
        """What is stepped: the frame, the tick, the score."""
        return self._episodes.simulation

    def columns(self, agent: str) -> tuple[tuple[Column, ...], tuple[Column, ...]]:
        """Return what the numbers of an agent's observations and actions are. Raises UnknownName."""
        if agent not in self.possible_agents:
            raise UnknownName("no agent", agent, self.possible_agents)
        return self._episodes.columns(agent)

    def observation_space(self, agent: str) -> spaces.Box:
        """Return the space of an agent's observations."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Box:
        """Return the space of an agent's actions."""
        return self.action_spaces[agent]

    def jobs(self, robot: str, actuator: str) -> Jobs:
        """Return the jobs of an actuator in this episode: see `Episodes.jobs`."""
        return self._episodes.jobs(robot, actuator)

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, NDArray[np.float64]], Infos]:
        """Begin an episode. The option `start` is what to begin with: a `Frame`, a `Start`, or `CAPTURE@12.5s`."""
        found = self._episodes.reset(seed, options)
        self.agents = self._episodes.present()
        return _of(found, self.agents), self._infos(self.agents)

    def step(
        self, actions: Actions
    ) -> tuple[dict[str, NDArray[np.float64]], dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Take an action of each agent; return observations, rewards, terminations, truncations and infos."""
        if not self._episodes.is_running:
            return {}, {}, {}, {}, {}
        found = self._episodes.step(actions)
        here = self._episodes.present()
        told = [name for name in self.possible_agents if name in here or name in self.agents]
        ends = {name: found.is_over or name not in here for name in told}, dict.fromkeys(told, found.is_cut)
        self.agents = [] if found.is_over or found.is_cut else here
        return _of(found.observations, told), _of(found.rewards, told), *ends, self._infos(told)

    def _infos(self, agents: Sequence[str]) -> Infos:
        simulation = self.simulation
        return {name: {"tick": simulation.tick, "time_s": simulation.time_s} for name in agents}

    def render(self) -> NDArray[np.uint8] | None:
        """Return the present frame from above, with `render_mode="rgb_array"`: uint8, (height, width, 3)."""
        return self._episodes.paint() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Free the engines."""
        self._episodes.close()


def _of(told: Mapping[str, Told], agents: Sequence[str]) -> dict[str, Told]:
    return {name: told[name] for name in agents}
