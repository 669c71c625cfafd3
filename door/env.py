"""Deployments as environments for learning, and rewards of the table. It needs the extra `learn`.

To import this registers its environments with Gymnasium: `gymnasium.make("foosim.env:foosim/Table-v0")`.
"""

from foosim.client.vectors import Column
from foosim.library.table.learning.table_rewards import DefendShot, Goals
from foosim.rendering.cameras import Camera, Overview
from foosim.simulation.env import TABLE, FoosimEnv, FoosimParallelEnv, Nothing, Reward, parallel_env

__all__ = [
    "TABLE",
    "Camera",
    "Column",
    "DefendShot",
    "FoosimEnv",
    "FoosimParallelEnv",
    "Goals",
    "Nothing",
    "Overview",
    "Reward",
    "parallel_env",
]
