"""Deployments as environments for learning: of PettingZoo (`parallel_env`) and of Gymnasium (`foosim/Table-v0`).

To import this registers the environments of Gymnasium. It needs the extra `learn`.
"""

from __future__ import annotations

try:
    import gymnasium
    import pettingzoo
except ModuleNotFoundError as error:
    if error.name not in {"gymnasium", "pettingzoo"}:
        raise
    what = f"{error.name} is not installed, which environments for learning need: pip install 'foosim[learn]'"
    raise ModuleNotFoundError(what, name=error.name) from None

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from foosim.client.jobs import Jobs
from foosim.client.vectors import Column
from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.schema import Deployment
from foosim.library.table.learning.exercises import ENVIRONMENTS, TABLE
from foosim.simulation.agents import agents_of
from foosim.simulation.env.episodes import Episodes, Nothing, Reward
from foosim.simulation.env.looks import READINGS
from foosim.simulation.simulation import Simulation, read_for_stepping

__all__ = ["TABLE", "FoosimEnv", "FoosimParallelEnv", "Nothing", "Reward", "parallel_env"]

RENDER_MODES: Final = ["rgb_array"]
Vector = NDArray[np.float64]
Infos = dict[str, dict[str, Any]]
ByAgent = TypeVar("ByAgent")


class _Shown:
    """What both environments show beside the steps of their episodes."""

    _episodes: Episodes
    render_mode: str | None = None

    @property
    def simulation(self) -> Simulation:
        """What is stepped: the frame, the tick, the score."""
        return self._episodes.simulation

    def jobs(self, robot: str, actuator: str) -> Jobs:
        """Return the jobs of an actuator in this episode: see `Episodes.jobs`."""
        return self._episodes.jobs(robot, actuator)

    def render(self) -> NDArray[np.uint8] | None:
        """Return the present frame, from above or by the camera, with `render_mode="rgb_array"`: uint8, (height, width,
        3)."""
        return self._episodes.paint() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Free the engines."""
        self._episodes.close()

    def _begin(self, episodes: Episodes, render_mode: str | None) -> dict[str, Any]:
        """Take the episodes; return the rate at which agents act, as `metadata`. Raises BadValue for the mode."""
        if render_mode is not None and render_mode not in RENDER_MODES:
            episodes.close()
            raise BadValue(f"no render mode (there is {', '.join(RENDER_MODES)})", render_mode)
        if render_mode is None and episodes.camera is not None:
            episodes.close()
            raise BadValue("a camera is rendered with render_mode='rgb_array'", episodes.camera)
        self._episodes, self.render_mode = episodes, render_mode
        return {"render_fps": episodes.rate_hz}

    def _observation_space(self, agent: str) -> spaces.Space[Any]:
        """Return the space of an agent's readings, with pictures of these as well, by their names."""
        readings = box_of(self._episodes.columns(agent)[0])
        shapes = self._episodes.looks[agent].shapes
        if not shapes:
            return readings
        pictures = {name: spaces.Box(0, its.most, its.shape, its.form) for name, its in shapes.items()}  # type: ignore[arg-type]
        return spaces.Dict({READINGS: readings, **pictures})

    def _info(self) -> dict[str, Any]:
        return {"tick": self.simulation.tick, "time_s": self.simulation.time_s}


class FoosimParallelEnv(_Shown, pettingzoo.ParallelEnv[str, Any, Vector]):  # type: ignore[misc]
    """Agents of a deployment that act together. All end together: by the reward's class, or cut after the time.

    `agents` are the present ones. One whose last robot is removed is terminated; when one is added it comes back, with
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
        self.metadata = {**self.metadata, **self._begin(Episodes(deployment, **arguments), render_mode)}
        self.possible_agents = list(self._episodes.agents)
        self.agents: list[str] = []
        self.observation_spaces = {name: self._observation_space(name) for name in self.possible_agents}
        self.action_spaces = {name: box_of(self._episodes.columns(name)[1]) for name in self.possible_agents}

    def columns(self, agent: str) -> tuple[tuple[Column, ...], tuple[Column, ...]]:
        """Return what the numbers of an agent's observations and actions are. Raises UnknownName."""
        if agent not in self.possible_agents:
            raise UnknownName("no agent", agent, self.possible_agents)
        return self._episodes.columns(agent)

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Return the space of an agent's observations."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Box:
        """Return the space of an agent's actions."""
        return self.action_spaces[agent]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[dict[str, Any], Infos]:
        """Begin an episode. The option `start` is what to begin with: a `Frame`, a `Start`, or `CAPTURE@12.5s`."""
        found = self._episodes.reset(seed, options)
        self.agents = self._episodes.present()
        return _of(found, self.agents), self._infos(self.agents)

    def step(
        self, actions: Mapping[str, Vector]
    ) -> tuple[dict[str, Any], dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Take an action of each agent; return observations, rewards, terminations, truncations and infos."""
        if not self._episodes.is_running:
            return {}, {}, {}, {}, {}
        found = self._episodes.step(actions)
        here = self._episodes.present()
        shown = [name for name in self.possible_agents if name in here or name in self.agents]
        ends = {name: found.is_over or name not in here for name in shown}, dict.fromkeys(shown, found.is_cut)
        self.agents = [] if found.is_over or found.is_cut else here
        return _of(found.observations, shown), _of(found.rewards, shown), *ends, self._infos(shown)

    def _infos(self, agents: Sequence[str]) -> Infos:
        return {name: self._info() for name in agents}


class FoosimEnv(_Shown, gymnasium.Env[Any, Vector]):
    """One agent of a deployment. `info` has the tick and the simulated time (`tick`, `time_s`).

    `metadata["render_fps"]` of an environment is the rate at which its agent acts.
    """

    metadata: dict[str, Any] = {"render_modes": RENDER_MODES}  # noqa: RUF012  # as Gymnasium declares it

    def __init__(
        self,
        deployment: Deployment | str | Path,
        agent: str | None = None,
        *,
        render_mode: str | None = None,
        **arguments: Any,
    ) -> None:
        """`agent` is the player that acts, by default the first possible one by name; others as `parallel_env`.

        Raises as it does.
        """
        if agent is None:
            if not isinstance(deployment, Deployment):
                deployment = read_for_stepping(deployment, arguments.pop("sets", ()))
            agent = agents_of(deployment)[0]
        episodes = Episodes(deployment, agents=[agent], **arguments)
        self.metadata = {**self.metadata, **self._begin(episodes, render_mode)}
        (self._agent,) = self._episodes.agents
        self.observation_space: spaces.Space[Any] = self._observation_space(self._agent)
        self.action_space: spaces.Box = box_of(self._episodes.columns(self._agent)[1])  # type: ignore[assignment]

    @property
    def columns(self) -> tuple[tuple[Column, ...], tuple[Column, ...]]:
        """What the numbers of observations and actions are."""
        return self._episodes.columns(self._agent)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode. The option `start` is what to begin with: a `Frame`, a `Start`, or `CAPTURE@12.5s`."""
        super().reset(seed=seed)
        return self._episodes.reset(seed, options)[self._agent], self._info()

    def step(self, action: Vector) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Take an action; return observation, reward, whether it is over, whether it is cut, and info."""
        found = self._episodes.step({self._agent: action})
        ends = found.is_over, found.is_cut
        return found.observations[self._agent], found.rewards[self._agent], *ends, self._info()


def box_of(columns: Sequence[Column]) -> spaces.Box:
    """Return the space of vectors with these columns: float64, of the shape (columns,), within their limits.

    A column without limits is unbounded.
    """
    low = np.array([column.low for column in columns])
    high = np.array([column.high for column in columns])
    return spaces.Box(low, high, dtype=np.float64)


def _of(found: Mapping[str, ByAgent], agents: Sequence[str]) -> dict[str, ByAgent]:
    return {name: found[name] for name in agents}


def parallel_env(deployment: Deployment | str | Path = TABLE, **arguments: Any) -> FoosimParallelEnv:
    """Return a deployment, loaded or in a file, as an environment whose agents act together. Arguments, by keyword:

    * `agents`: the players that act by actions; by default all that command a robot, or `learner`, which commands all
      robots, if the deployment has no such player. The others act by themselves, as declared.
    * `rate_hz`: how often agents act (100); a period is whole ticks.
    * `network`: whether packets go through the network that the deployment declares; without, readings arrive at once,
      and so do commands.
    * `reward`: a class as `Reward` describes it, made with the deployment and the robots of each agent; rewards of
      the table are in `foosim.library.table.learning.table_rewards`. By default `Nothing`.
    * `seconds`: the simulated time, more than 0, after which an episode is cut; by default never.
    * `start`: the frame that episodes begin with, a `Frame`, a `Start` or `CAPTURE@12.5s`; by default the first one.
    * `readings`, `commands`: globs of `robot/channel` that select among the channels that agents hear and command.
    * `bounds`: least and greatest values of commands by globs of `robot/channel.field`, within the actuators' limits.
    * `ages`: whether the age of each reading (s) is observed, too; -1 before the first.
    * `pictures`: globs of `robot/channel` that select among the cameras that agents hear, by default none. With some,
      an observation is a mapping: `readings` are the vector, and each picture is under `robot/channel.image`, `.depth`
      or `.segmentation`; all zeros before the first, and of one that the network has changed.
    * `sets`: changes of the file's values, as `--set` makes them.
    * `pixels`: width and height of what `render` returns (320, 180), the world from straight above; or
      `camera`: the camera, `robot/channel`, whose pictures it returns.
    * `render_mode`: `rgb_array`, or None.

    Raises DeploymentError, AssetError, UnknownName, BadValue and PlayerError for invalid arguments.
    """
    return FoosimParallelEnv(deployment, **arguments)


for _id, _arguments in ENVIRONMENTS.items():
    gymnasium.register(id=_id, entry_point="foosim.simulation.env:FoosimEnv", kwargs=dict(_arguments))
