"""Deployments as environments for learning: of PettingZoo (`parallel_env`) and of Gymnasium (`foosim/Table-v0`).

To import this registers the environments of Gymnasium. It needs the extra `learn`.
"""

from __future__ import annotations

try:
    import gymnasium
    import pettingzoo  # noqa: F401  # so that what lacks is said here
except ModuleNotFoundError as error:
    if error.name not in {"gymnasium", "pettingzoo"}:
        raise
    what = f"{error.name} is not installed, which environments for learning need: pip install 'foosim[learn]'"
    raise ModuleNotFoundError(what, name=error.name) from None

from pathlib import Path
from typing import Any

from foosim.deployment.schema import Deployment
from foosim.players.learning.exercises import ENVIRONMENTS, TABLE
from foosim.simulation.env.parallel import FoosimParallelEnv
from foosim.simulation.env.reward import Nothing, Reward
from foosim.simulation.env.single import FoosimEnv

__all__ = ["TABLE", "FoosimEnv", "FoosimParallelEnv", "Nothing", "Reward", "parallel_env"]


def parallel_env(deployment: Deployment | str | Path = TABLE, **arguments: Any) -> FoosimParallelEnv:
    """Return a deployment, loaded or in a file, as an environment whose agents act together. Arguments, by keyword:

    * `agents`: the players that act by actions; by default all that command a robot, or `learner`, who commands all
      robots, where the deployment has no such player. The others act by themselves, as declared.
    * `rate_hz`: how often agents act (100); a period is whole ticks.
    * `network`: whether packets go through the network that the deployment declares; without, readings arrive at once,
      and so do commands.
    * `reward`: a class as `reward.Reward` describes it, made with the deployment and the robots of each agent; those of
      the table are in `foosim.players.learning.table_rewards`. By default `Nothing`.
    * `seconds`: the simulated time, more than 0, after which an episode is cut; by default never.
    * `start`: the frame that episodes begin with, a `Frame`, a `Start` or `CAPTURE@12.5s`; by default the first one.
    * `readings`, `commands`: globs of `robot/channel` that select among what agents hear and command.
    * `bounds`: least and greatest values of commands by globs of `robot/channel.field`, within those of the actuators.
    * `ages`: whether the age of each reading (s) is observed, too; -1 before the first.
    * `sets`: changes of the file's values, as `--set` makes them.
    * `pixels`: width and height of what `render` returns (320, 180).
    * `render_mode`: `rgb_array`, or None.

    Raises DeploymentError, AssetError, UnknownName, BadValue and PlayerError for arguments that are not valid.
    """
    return FoosimParallelEnv(deployment, **arguments)


for _id, _arguments in ENVIRONMENTS.items():
    gymnasium.register(id=_id, entry_point="foosim.simulation.env.single:FoosimEnv", kwargs=dict(_arguments))
