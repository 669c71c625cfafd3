"""Episodes of a deployment, on which both environments are built, without a library for learning."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.capture.start_frame import read_branch
from foosim.client.jobs import Jobs
from foosim.client.player import Packet
from foosim.client.vectors import EVERYTHING, Column, CommandVector, ReadingVector, chosen
from foosim.common.errors import BadValue, UnknownName
from foosim.common.keyed_random import draw_key, draw_words
from foosim.common.limits import COUNTER_MAX
from foosim.deployment.schema import Deployment
from foosim.rendering.cameras import Camera, Overview, cameras_of
from foosim.simulation.agents import Agent
from foosim.simulation.env.looks import Looks, Observation
from foosim.simulation.simulation import Simulation, read_for_stepping
from foosim.world.frame import Frame
from foosim.world.start import Start

PIXELS: Final = (320, 180)
PIXELS_MAX: Final = 8192
"""The widest and the highest picture."""
START: Final = "start"
"""The option of `reset` that names a frame to begin with."""


Robots: TypeAlias = Mapping[str, tuple[str, ...]]
"""The robots that each agent commands, by the agent's name."""


class Reward(Protocol):
    """The reward of an episode: its start values, the reward of each step, and its end.

    It belongs to a deployment and its agents; `foosim.library.table.learning` has the ones of the table.
    """

    def begin(self, frame: Frame, seed: int) -> Frame:
        """Return the frame that an episode begins with, from that of its reset; draws are keyed by `seed`."""

    def rate(self, before: Frame, after: Frame) -> Mapping[str, float]:
        """Return what a step was worth to each agent."""

    def is_over(self, frame: Frame) -> bool:
        """Whether the episode ends with this frame."""


RewardFactory: TypeAlias = Callable[[Deployment, Robots], Reward]
"""Makes the reward of a deployment and its agents; usually the reward's class."""


class Nothing:
    """The reward of a world without one: 0 for every step, and no end."""

    def __init__(self, deployment: Deployment, robots: Robots) -> None:
        self._rates = dict.fromkeys(robots, 0.0)

    def begin(self, frame: Frame, seed: int) -> Frame:
        """Begin with the frame as it is."""
        return frame

    def rate(self, before: Frame, after: Frame) -> Mapping[str, float]:
        """Return 0 for each agent."""
        return self._rates

    def is_over(self, frame: Frame) -> bool:
        """It never is."""
        return False


class Stepped(NamedTuple):
    """What a step led to."""

    observations: dict[str, Observation]
    rewards: dict[str, float]
    is_over: bool
    is_cut: bool


class Episodes:
    """A deployment as episodes of agents that observe readings and act by commands, at one rate.

    An observation is the vector of an agent's readings, an action that of its commands (`client.vectors`). With
    `pictures`, an observation has these beside the vector (`Looks`).
    """

    def __init__(  # noqa: PLR0913  # the arguments of both environments, by keyword
        self,
        deployment: Deployment | str | Path,
        *,
        agents: Sequence[str] | None = None,
        rate_hz: float = 100.0,
        network: bool = False,
        reward: RewardFactory = Nothing,
        seconds: float | None = None,
        start: Start | Frame | str | None = None,
        readings: Sequence[str] = EVERYTHING,
        commands: Sequence[str] = EVERYTHING,
        bounds: Mapping[str, tuple[float, float]] | None = None,
        ages: bool = False,
        pictures: Sequence[str] = (),
        sets: Sequence[str] = (),
        pixels: tuple[int, int] | None = None,
        camera: str | None = None,
    ) -> None:
        """Raises DeploymentError, UnknownName and BadValue for invalid arguments; see `parallel_env`."""
        if not isinstance(deployment, Deployment):
            deployment = read_for_stepping(deployment, sets)
        elif sets:
            raise BadValue("a loaded deployment takes no sets, its file does", list(sets))
        if agents is not None and not agents:
            raise BadValue("an environment has one agent or more", list(agents))
        if seconds is not None and not seconds > 0.0:
            raise BadValue("seconds of an episode are more than 0", seconds)
        _check_view(deployment, pixels, camera)
        self.ticks = _ticks(rate_hz, deployment.tick_ns)
        self.rate_hz = rate_hz
        self._start = read_branch(start, deployment).start if isinstance(start, str) else start
        self.simulation = Simulation(deployment, agents=agents, network=network, period=self.ticks, start=self._start)
        simulation = self.simulation
        declared = simulation.deployment
        self.agents = tuple(simulation.agents)
        self._steps_max = None if seconds is None else max(1, round(seconds * rate_hz))
        self.vectors: dict[str, tuple[ReadingVector, CommandVector]] = {}
        self.looks: dict[str, Looks] = {}
        try:
            for name, agent in simulation.agents.items():
                self.vectors[name] = _vectors(declared, agent, readings, commands, bounds or {}, ages)
                self.looks[name] = Looks(agent, [pictures] if isinstance(pictures, str) else pictures)
            robots = {
                name: tuple(dict.fromkeys(column.robot for column in commands.columns))
                for name, (_, commands) in self.vectors.items()
            }
            self._reward: Reward = reward(declared, robots)
        except BaseException:
            simulation.close()
            raise
        self._jobs: dict[tuple[str, str], tuple[str, Jobs]] = {}
        """By (robot, actuator) with jobs: the agent that gives them, and the jobs."""
        self._seed: int | None = None
        self._episode = self._steps = 0
        self._pixels, self.camera = pixels or PIXELS, camera
        self._eye: Camera | Overview | None = None
        self.is_running = False

    def columns(self, agent: str) -> tuple[tuple[Column, ...], tuple[Column, ...]]:
        """Return the columns of an agent's observations and of its actions."""
        readings, commands = self.vectors[agent]
        return readings.columns, commands.columns

    def jobs(self, robot: str, actuator: str) -> Jobs:
        """Return the jobs of an actuator in this episode, which the first agent gives that commands its robot.

        Their commands go with the steps. As long as a job has not ended, actions do not command that actuator. Raises
        UnknownName for a robot that no agent commands, and as `Jobs` does.
        """
        if (robot, actuator) not in self._jobs:
            agents = self.simulation.agents
            owner = next((name for name, agent in agents.items() if robot in agent.robots), None)
            if owner is None:
                raise UnknownName("no robot of an agent", robot, [one for its in agents.values() for one in its.robots])
            self._jobs[robot, actuator] = owner, Jobs(self.simulation.declared, owner, robot, actuator)
            self._hear()
        return self._jobs[robot, actuator][1]

    def _with_jobs(self, packets: dict[str, list[Packet]]) -> None:
        """Replace the commands of actions by the commands of jobs."""
        for pair, (agent, jobs) in self._jobs.items():
            if jobs.job is None or jobs.job.state.has_ended or not self.simulation.agents[agent].exists:
                continue
            for name, its in packets.items():
                packets[name] = [one for one in its if (one.destination, one.channel) != pair]
            payload = jobs.payload(self.simulation.tick)
            if payload is not None:
                packets.setdefault(agent, []).append(Packet(*pair, payload))

    def _hear(self) -> None:
        """Update the jobs' states from the readings."""
        if self._jobs:
            readings = self.simulation.readings
            for _, jobs in self._jobs.values():
                jobs.hear(readings)

    def reset(self, seed: int | None, options: Mapping[str, Any] | None) -> dict[str, Observation]:
        """Begin an episode; return the observations.

        A seed begins a row of episodes: the first has the seed itself, further ones follow from it.
        Without one ever, the first has the deployment's. The option `start` is the frame to begin with, instead of the
        environment's; without a seed, draws are then the deployment's.

        Raises BadValue for an invalid seed, UnknownName for another option, and as `Simulation.reset` does.
        """
        for name in options or {}:
            if name != START:
                raise UnknownName("reset: no such option", name, [START], also="an argument of the environment itself")
        if seed is not None and not 0 <= seed <= COUNTER_MAX:
            raise BadValue(f"a seed is 0 to {COUNTER_MAX}", seed)
        if seed is not None:
            self._seed, self._episode = int(seed), 0
        start = (options or {}).get(START, self._start)
        used = self._seed_of_episode(is_captured=start is not None)
        self._episode += 1
        simulation = self.simulation
        frame = simulation.start_frame(start, used)
        simulation.reset(self._reward.begin(frame, simulation.declared.seed if used is None else used), used)
        self._steps, self.is_running = 0, True
        self._jobs = {}
        return self._observe()

    def _seed_of_episode(self, *, is_captured: bool) -> int | None:
        if self._seed is None and (self._episode == 0 or is_captured):
            return None
        base = self.simulation.declared.seed if self._seed is None else self._seed
        if self._episode == 0:
            return base
        return draw_words(draw_key(base, "episode"), self._episode)[0] & COUNTER_MAX

    def step(self, actions: Mapping[str, NDArray[Any]]) -> Stepped:
        """Take the actions of agents, compute the time to the next ones, and return the result.

        An agent without an action sends nothing: its robots keep their last commands. Nor does an absent one.
        Raises BadValue for an action of another shape or with a non-finite number, UnknownName for one of no
        agent.
        """
        assert self.is_running, "reset begins an episode"
        simulation = self.simulation
        before = simulation.frame
        for name in actions:
            if name not in self.vectors:
                raise UnknownName("an action of no agent", name, self.agents)
        packets = {
            name: self.vectors[name][1].packets(np.asarray(action, np.float64))
            for name, action in actions.items()
            if simulation.agents[name].exists
        }
        self._with_jobs(packets)
        simulation.advance(packets, self.ticks)
        self._hear()
        after = simulation.frame
        self._steps += 1
        rewards = dict(self._reward.rate(before, after))
        is_over = self._reward.is_over(after)
        is_cut = not is_over and self._steps_max is not None and self._steps >= self._steps_max
        self.is_running = not (is_over or is_cut)
        return Stepped(self._observe(), rewards, is_over, is_cut)

    def _observe(self) -> dict[str, Observation]:
        simulation = self.simulation
        now_ns = simulation.tick * simulation.deployment.tick_ns
        found = {}
        for name, agent in simulation.agents.items():
            found[name] = self.looks[name].with_readings(self.vectors[name][0].join(agent.newest, now_ns))
        return found

    def present(self) -> list[str]:
        """Return the agents that exist in the present frame, in order."""
        return [name for name, agent in self.simulation.agents.items() if agent.exists]

    def paint(self) -> NDArray[np.uint8]:
        """Return the present frame from above or by the camera, an array of uint8 of the shape (height, width, 3).

        It is black while the camera's robot is absent.
        """
        simulation, frame = self.simulation, self.simulation.frame
        if self._eye is None:
            spec, layout = simulation.deployment, frame.layout
            robot, _, channel = (self.camera or "").partition("/")
            above = self.camera is None
            self._eye = (
                Overview(spec, layout, *self._pixels, is_above=True) if above else Camera(spec, layout, robot, channel)
            )
        sight = self._eye.at(frame.tick, frame.numbers)
        if sight is None:
            return np.zeros(self._eye.pictures.shapes()["image"].shape, np.uint8)
        return sight.image()

    def close(self) -> None:
        """Free the engines."""
        self.is_running = False
        self.simulation.close()


def _check_view(deployment: Deployment, pixels: tuple[int, int] | None, camera: str | None) -> None:
    """Raise BadValue or UnknownName for a view that cannot be rendered."""
    if pixels is not None and camera is not None:
        raise BadValue("a camera has its own pixels: an environment takes camera or pixels", str(pixels))
    if not all(0 < side <= PIXELS_MAX for side in pixels or PIXELS):
        raise BadValue(f"pixels are a width and a height, each of 1 to {PIXELS_MAX}", str(pixels))
    names = {f"{robot}/{channel}": its for (robot, channel), its in cameras_of(deployment).items()}
    valid = [name for name, its in names.items() if "image" in its.pictures]
    if camera is not None and camera not in valid:
        raise UnknownName("no camera with images", camera, valid)


def _ticks(rate_hz: float, tick_ns: int) -> int:
    ticks = round(1e9 / (rate_hz * tick_ns)) if rate_hz > 0 else 0
    if ticks < 1 or abs(ticks * rate_hz * tick_ns - 1e9) > 1.0:
        nearest = f"{1e9 / (max(1, ticks) * tick_ns):g} Hz"
        raise BadValue(f"a rate whose period is not whole ticks of {tick_ns / 1e6:g} ms", f"{rate_hz:g} Hz", nearest)
    return ticks


def _vectors(
    deployment: Deployment,
    agent: Agent,
    readings: Sequence[str],
    commands: Sequence[str],
    bounds: Mapping[str, tuple[float, float]],
    ages: bool,
) -> tuple[ReadingVector, CommandVector]:
    """Return an agent's readings and commands. Raises UnknownName and BadValue."""
    pairs = [pair for pair in agent.hears if pair[0] in deployment.robots]
    read = ReadingVector(deployment, chosen(pairs, readings), ages=ages)
    command = CommandVector(deployment, agent.robots, commands, bounds)
    if not command.columns:
        raise BadValue(f"agent {agent.name} has no command that is a vector of numbers", list(agent.robots))
    return read, command
