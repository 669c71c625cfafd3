"""The states of the jobs of an actuator."""

from __future__ import annotations

from foosim.common.names import nearest_quoted
from foosim.world.component_types.jobs import CHANGED, FAILURE, NUMBERS, RUNNING, STATES
from foosim.world.component_types.registry import sensor
from foosim.world.components.base import Sensor
from foosim.world.components.job_reading import Jobs, JobSettings
from foosim.world.components.view import IncompatibleComponent, Mounting, View


@sensor("job", JobSettings, Jobs, trigger=lambda settings: f"{settings.actuator}.{CHANGED}")
class JobSensor(Sensor):
    """The sender of an actuator's running job, and the last job of each sender with its state."""

    def __init__(self, settings: JobSettings, at: Mounting) -> None:
        self._running, self._numbers, self._states = (
            at.slot(f"{settings.actuator}.{slot}") for slot in (RUNNING, NUMBERS, STATES)
        )
        failure = f"{settings.actuator}.{FAILURE}"
        self._failure = at.slot(failure) if failure in at.robot.offsets else None

    @staticmethod
    def check(settings: JobSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent for an actuator that the robot does not have, or that does no jobs."""
        name, offsets = settings.actuator, at.robot.offsets
        having = [one for one in at.spec.robots[at.robot.name].actuators if f"{one}.{CHANGED}" in offsets]
        if name not in having:
            what = f"{at.robot.name} has no such actuator with jobs; there are {', '.join(having) or 'none'}"
            raise IncompatibleComponent(("actuator",), what, name, nearest_quoted(name, having))

    def sample(self, view: View) -> Jobs:
        failure = 0.0 if self._failure is None else view.numbers[self._failure.at]
        numbers, states = tuple(view.read(self._numbers)), tuple(view.read(self._states))
        return Jobs(view.numbers[self._running.at], failure, numbers, states)
