"""A camera or a head by its two angles. A job is done when it looks there."""

from __future__ import annotations

from msgspec import Struct

from foosim.world.components.base import Actuator
from foosim.world.components.entities import Motors
from foosim.world.components.view import Mounting, View, WritableView
from foosim.world.forms.jobs import JobState
from foosim.world.forms.quantities import JobNumber, Radians
from foosim.world.forms.registry import actuator
from foosim.world.moving.progress import Progress
from foosim.world.parameters.pan_tilt import PanTiltSettings, pan_tilt_of, pan_tilt_slots


class PanTiltAngles(Struct, frozen=True):
    """The angles of its joints."""

    pan: Radians
    tilt: Radians
    job: JobNumber = 0.0


@actuator(
    "pan_tilt",
    PanTiltSettings,
    PanTiltAngles,
    slots=pan_tilt_slots,
    needs=("joint_positions",),
    joints="joints",
    jobs=True,
)
class PanTilt(Actuator):
    """Keeps the angles of the last command by a proportional loop, as `joint_position` does."""

    def __init__(self, settings: PanTiltSettings, at: Mounting) -> None:
        self.group, self._settings = pan_tilt_of(settings, at), settings
        self._progress = Progress(at, settings.patience_ns)

    @staticmethod
    def check(settings: PanTiltSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent unless there are two joints that turn, one on the other."""
        pan_tilt_of(settings, at)

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and the greatest of each angle (rad)."""
        pan, tilt = zip(self.group.lows, self.group.highs, strict=True)
        return {"pan": pan, "tilt": tilt}

    def accept(self, command: PanTiltAngles, view: WritableView) -> bool:
        """Take two angles."""
        self._set(view, [command.pan, command.tilt])
        return True

    def _set(self, view: WritableView, angles: list[float]) -> None:
        view.write(self.group.set_point, *angles)
        self._progress.begin(view)

    def hold(self, view: WritableView) -> None:
        """Stay at the present angles."""
        self._set(view, self.group.positions(view))

    def excite(self, view: WritableView) -> None:
        """Turn a little, for the run that compares engines."""
        self._set(view, [angle + 0.2 for angle in self.group.positions(view)])

    def progress(self, view: WritableView) -> JobState:
        """Return whether both joints are there."""
        wanted, angles = view.read(self.group.set_point), self.group.positions(view)
        left = [abs(to - at) for to, at in zip(wanted, angles, strict=True)]
        return self._progress.judge(view, sum(left), is_there=max(left) <= self._settings.tolerance)

    def command(self, view: View) -> Motors:
        """Return speed and greatest force of both motors."""
        return self.group.towards(view.read(self.group.set_point), view, self._settings.gain)
