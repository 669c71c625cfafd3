"""A deployment as a Gymnasium `Env`: one agent acts, the other players play as declared."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from foosim.client.jobs import Jobs
from foosim.client.vectors import Column
from foosim.common.errors import BadValue
from foosim.deployment.schema import Deployment
from foosim.simulation.env.episodes import Episodes
from foosim.simulation.env.spaces import box_of
from foosim.simulation.simulation import Simulation, agents_of, read_for_stepping

RENDER_MODES: Final = ["rgb_array"]


def check_render_mode(mode: str | None) -> None:
    """Raise BadValue for a render mode that there is not."""
    if mode is not None and mode not in RENDER_MODES:
        raise BadValue(f"no render mode (there is {', '.join(RENDER_MODES)})", mode)


class FoosimEnv(gymnasium.Env[NDArray[np.float64], NDArray[np.float64]]):
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
        """`agent` is the player that acts, by default the first by name of those that could; others as `parallel_env`.

        Raises as it does.
        """
        check_render_mode(render_mode)
        self.render_mode = render_mode
        self._episodes = _episodes(deployment, agent, arguments)
        self.metadata = {**self.metadata, "render_fps": self._episodes.rate_hz}
        (self._agent,) = self._episodes.agents
        readings, commands = self._episodes.columns(self._agent)
        self.observation_space: spaces.Box = box_of(readings)  # type: ignore[assignment]
        self.action_space: spaces.Box = box_of(commands)  # type: ignore[assignment]

    @property
    def simulation(self) -> Simulation:
        """What is stepped: the frame, the tick, the score."""
        return self._episodes.simulation

    @property
    def columns(self) -> tuple[tuple[Column, ...], tuple[Column, ...]]:
        """What the numbers of observations and actions are."""
        return self._episodes.columns(self._agent)

    def jobs(self, robot: str, actuator: str) -> Jobs:
        """Return the jobs of an actuator in this episode: see `Episodes.jobs`."""
        return self._episodes.jobs(robot, actuator)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Begin an episode. The option `start` is what to begin with: a `Frame`, a `Start`, or `CAPTURE@12.5s`."""
        super().reset(seed=seed)
        return self._episodes.reset(seed, options)[self._agent], self._info()

    def step(self, action: NDArray[np.float64]) -> tuple[NDArray[np.float64], float, bool, bool, dict[str, Any]]:
        """Take an action; return observation, reward, whether it is over, whether it is cut, and info."""
        found = self._episodes.step({self._agent: action})
        ends = found.is_over, found.is_cut
        return found.observations[self._agent], found.rewards[self._agent], *ends, self._info()

    def _info(self) -> dict[str, Any]:
        return {"tick": self.simulation.tick, "time_s": self.simulation.time_s}

    def render(self) -> NDArray[np.uint8] | None:
        """Return the present frame from above, with `render_mode="rgb_array"`: uint8, (height, width, 3)."""
        return self._episodes.paint() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Free the engines."""
        self._episodes.close()


def _episodes(deployment: Deployment | str | Path, agent: str | None, arguments: dict[str, Any]) -> Episodes:
    if agent is None:
        if not isinstance(deployment, Deployment):
            deployment = read_for_stepping(deployment, arguments.pop("sets", ()))
        agent = agents_of(deployment)[0]
    return Episodes(deployment, agents=[agent], **arguments)
