"""The flight of a quadrotor: where it is, from an inertial unit and satellites, and the rotors that bring it elsewhere.

The estimate integrates what the inertial unit measures (Groves, *Principles of GNSS, Inertial, and Multisensor
Integrated Navigation Systems*, 2013, chapter 5), and each place that satellites give corrects place, velocity and,
since a wrong attitude turns the measured force aside, attitude (Hua, *Attitude estimation for accelerated vehicles
using GPS/INS measurements*, Control Engineering Practice 18, 2010). About the vertical it has the gyroscope alone.

The controller is a cascade of two proportional-derivative loops: from place and velocity to the force that is wanted,
thus to the attitude whose z is along it; from attitude and rate of turning to the torques (Lee, Leok, McClamroch,
*Geometric tracking control of a quadrotor UAV on SE(3)*, IEEE CDC 2010; Mellinger, Kumar, *Minimum snap trajectory
generation and control for quadrotors*, ICRA 2011). Four rotors give any thrust and torques within their speeds.
"""

from __future__ import annotations

from math import cos, sin, sqrt
from typing import Final

from foosim.library.generic.imu import Inertial
from foosim.library.mobile.rotors import QuadrotorRobot
from foosim.world.scene import ORIGIN, Quaternion, Vector, conjugate, cross, moved, multiply, rotate, turn

PLACE_GAIN: Final = 3.0
VELOCITY_GAIN: Final = 3.0
ATTITUDE_GAIN: Final = 1.0
"""Of the estimate, in 1/s, 1/s2, 1/s3: all three roots of s^3 + 3 s^2 + 3 s + 1 are at -1 s^-1."""

STIFFNESS: Final = 2.25
DAMPING: Final = 3.0
"""Of the place, in 1/s2 and 1/s: critically damped at 1.5 rad/s."""
TILT_STIFFNESS: Final = 64.0
TILT_DAMPING: Final = 14.0
"""Of the attitude, in 1/s2 and 1/s: 8 rad/s, five times as fast as the place, well damped."""
YAW_STIFFNESS: Final = 4.0
YAW_DAMPING: Final = 4.0
"""About the vertical, where rotors have little torque."""
PUSH_MAX: Final = 3.0
"""Greatest acceleration to a side, in m/s2: it tilts by 17 degrees at most."""
CLIMB_MAX: Final = 4.0
"""Greatest acceleration up or down, in m/s2."""


class Navigation:
    """Where a quadrotor is, how fast, and how it is turned: world frame, SI units. It starts at rest and level."""

    def __init__(self, yaw: float, gravity: float) -> None:
        self.position, self.velocity = ORIGIN, ORIGIN
        self.orientation: Quaternion = turn((0.0, 0.0, 1.0), yaw)
        self.spin: Vector = ORIGIN
        """rad/s, about its own axes."""
        self.is_known = False
        self._gravity = gravity
        self._force = (0.0, 0.0, gravity)

    def move(self, felt: Inertial, time_s: float) -> None:
        """Take a measurement of the inertial unit over a time."""
        self.spin = felt.wx, felt.wy, felt.wz
        rate = _length(self.spin)
        if rate > 0.0:
            axis = self.spin[0] / rate, self.spin[1] / rate, self.spin[2] / rate
            self._turn(multiply(self.orientation, turn(axis, rate * time_s)))
        self._force = rotate(self.orientation, (felt.fx, felt.fy, felt.fz))
        x, y, z = self._force
        self.velocity = moved(self.velocity, (x, y, z - self._gravity), time_s)
        self.position = moved(self.position, self.velocity, time_s)

    def fix(self, place: Vector, time_s: float) -> None:
        """Take a place, so long after the one before."""
        if not self.is_known:
            self.is_known, self.position = True, place
            return
        off = moved(place, self.position, -1.0)
        self.position = moved(self.position, off, PLACE_GAIN * time_s)
        self.velocity = moved(self.velocity, off, VELOCITY_GAIN * time_s)
        # Turned towards `off`, the force that was measured would have brought it there.
        wrong = cross(self._force, off)
        gain = ATTITUDE_GAIN * time_s / (self._gravity * self._gravity)
        angle = _length(wrong) * gain
        if angle > 0.0:
            length = _length(wrong)
            axis = wrong[0] / length, wrong[1] / length, wrong[2] / length
            self._turn(multiply(turn(axis, angle), self.orientation))

    def _turn(self, orientation: Quaternion) -> None:
        x, y, z, w = orientation
        length = sqrt(x * x + y * y + z * z + w * w)
        self.orientation = x / length, y / length, z / length, w / length


class Flight:
    """Brings a quadrotor to places by its four rotors."""

    def __init__(self, robot: QuadrotorRobot, gravity: float) -> None:
        self._mass, self._moments, self._gravity = robot.mass, robot.moments, gravity
        self._thrust_factor, self._most = robot.thrust_factor, robot.rotor_speed * robot.rotor_speed
        self._arm = robot.arm / sqrt(2.0)
        self._drag = robot.drag_factor / robot.thrust_factor
        """Torque about the vertical per thrust of a rotor (m)."""

    def rotors(self, at: Navigation, place: Vector, velocity: Vector, yaw: float) -> tuple[float, float, float, float]:
        """Return the speeds of the rotors (rad/s), for a place (m) that moves (m/s), and a heading (rad)."""
        x, y, z = (
            STIFFNESS * (to - here) + DAMPING * (pace - now)
            for to, here, pace, now in zip(place, at.position, velocity, at.velocity, strict=True)
        )
        aside = sqrt(x * x + y * y)
        if aside > PUSH_MAX:
            x, y = x * PUSH_MAX / aside, y * PUSH_MAX / aside
        wanted = x, y, min(max(z, -CLIMB_MAX), CLIMB_MAX) + self._gravity
        up = rotate(at.orientation, (0.0, 0.0, 1.0))
        thrust = self._mass * max(0.0, _dot(wanted, up))
        return self._mixed(thrust, self._torques(at, wanted, yaw))

    def _torques(self, at: Navigation, wanted: Vector, yaw: float) -> Vector:
        """Return the torques (N m, own axes) that turn z along the wanted force, and x to the heading.

        The error of the attitude is half of the skew-symmetric part of R_d^T R.
        """
        length = _length(wanted)
        z = wanted[0] / length, wanted[1] / length, wanted[2] / length
        y = cross(z, (cos(yaw), sin(yaw), 0.0))
        length = _length(y)
        y = y[0] / length, y[1] / length, y[2] / length
        x = cross(y, z)
        back = conjugate(at.orientation)
        # Columns of R^T R_d: the wanted axes, seen from its own.
        (_, xy, xz), (yx, _, yz), (zx, zy, _) = rotate(back, x), rotate(back, y), rotate(back, z)
        off = (yz - zy) / 2.0, (zx - xz) / 2.0, (xy - yx) / 2.0
        level = (TILT_STIFFNESS, TILT_DAMPING)
        gains = (level, level, (YAW_STIFFNESS, YAW_DAMPING))
        a, b, c = (
            moment * (stiff * part - damp * rate)
            for moment, part, rate, (stiff, damp) in zip(self._moments, off, at.spin, gains, strict=True)
        )
        return a, b, c

    def _mixed(self, thrust: float, torques: Vector) -> tuple[float, float, float, float]:
        """Return the rotors' speeds for a thrust (N) and torques (N m): front left, rear left, rear right, front right.

        The inverse of the sums of the actuator `rotor_speeds`.
        """
        roll, pitch, yaw = torques[0] / self._arm, torques[1] / self._arm, torques[2] / self._drag
        quarters = (
            thrust + roll - pitch + yaw,
            thrust + roll + pitch - yaw,
            thrust - roll + pitch + yaw,
            thrust - roll - pitch - yaw,
        )
        a, b, c, d = (sqrt(min(max(part / 4.0 / self._thrust_factor, 0.0), self._most)) for part in quarters)
        return a, b, c, d


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _length(vector: Vector) -> float:
    return sqrt(_dot(vector, vector))
