"""What an episode begins with, what it is worth, and when it is over: what the class of a reward is.

A reward is made for a deployment and its agents. `foosim.players.learning` has those of worlds that come with foosim.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol, TypeAlias

from foosim.deployment.schema import Deployment
from foosim.world.frame import Frame

Robots: TypeAlias = Mapping[str, tuple[str, ...]]
"""The robots that each agent commands, by the agent's name."""


class Reward(Protocol):
    """Where episodes begin, and what they are worth."""

    def begin(self, frame: Frame, seed: int) -> Frame:
        """Return the frame that an episode begins with, from that of its reset; draws are keyed by `seed`."""

    def rate(self, before: Frame, after: Frame) -> Mapping[str, float]:
        """Return what a step was worth to each agent."""

    def is_over(self, frame: Frame) -> bool:
        """Whether the episode ends with this frame."""


RewardFactory: TypeAlias = Callable[[Deployment, Robots], Reward]
"""Makes the reward of a deployment and its agents; usually the reward's class."""


class Nothing:
    """The reward of a world that has none: 0 for every step, and no end."""

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
