"""The settings that cameras share, their pose, and the sensor of which each kind of camera is one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import copysign, degrees, radians, sqrt
from typing import Annotated, Any, ClassVar, Final, Self

from pydantic import Field, model_validator

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.exact_math import atan
from foosim.common.names import nearest_quoted
from foosim.common.spec_base import RobotName, SpecBase, default
from foosim.common.units import Quantity, custom_error
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import Sensor
from foosim.world.components.entities import mounting_of
from foosim.world.components.in_view import InView
from foosim.world.components.mounted import Mounted
from foosim.world.components.optics import Optics
from foosim.world.components.sight import NUMBERS_MAX, Seen, Sight, looks_of
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import IncompatibleComponent, Mounting, View
from foosim.world.placing import FIRST_LINK, FIRST_LINK_OR_WORLD, Coordinate, MountedOrStanding
from foosim.world.scene import ORIGIN, Quaternion, Vector, moved, multiply, rotate

DEFAULT_FOV: Final = radians(60.0)
LEAST_DEG: Final = 1.0
GREATEST_DEG: Final = 170.0
Fov = Annotated[float, Quantity(units.ANGLE, "1 deg", "170 deg")]
FocalLength = Annotated[float, Quantity(units.LENGTH, "0.1 mm", "10 m")]
Near = Annotated[float, Quantity(units.LENGTH, "1 mm", "10 m")]
Far = Annotated[float, Quantity(units.LENGTH, "1 cm", "10 km")]
Latency = Annotated[int, Quantity(units.TIME, "0 s", "10 s")]
Exposure = Annotated[int, Quantity(units.TIME, "0 s", "1 s")]
Size = Annotated[int, Quantity(units.SIZE, "1 B", "16 MB")]
Coefficient = Annotated[float, Field(ge=-10.0, le=10.0)]


class Target(SpecBase):
    """A place in the world, or in the frame of the first link of an `entity`."""

    entity: RobotName | None = None
    x: Coordinate = default("0 m")
    y: Coordinate = default("0 m")
    z: Coordinate = default("0 m")


class Distortion(SpecBase):
    """Brown's coefficients of a lens: radial k1, k2, k3, tangential p1, p2."""

    k1: Coefficient = 0.0
    k2: Coefficient = 0.0
    p1: Coefficient = 0.0
    p2: Coefficient = 0.0
    k3: Coefficient = 0.0


class EyeSettings(SensorSettings):
    """The pose of a sensor that looks along the x axis of `at`, with z up.

    `at` is in the frame of a link, of a robot without a body in the world's. With `look_at` the sensor turns to a place
    or an entity that is in the world.
    """

    at: MountedOrStanding = FIRST_LINK_OR_WORLD
    look_at: Target | None = None


class SightSettings(EyeSettings):
    """The settings of what is drawn where it is looked at.

    `latency` is added to the delay of the network. `size` is what the network carries: by default that of a usual
    encoding.
    """

    latency_ns: Latency = default("0 s", "latency")
    size_bytes: Size | None = Field(default=None, alias="size")

    @property
    def encoded_bytes(self) -> int:
        """The bytes of a usual encoding of what is drawn."""
        return 0

    @property
    def carried_bytes(self) -> int:
        """The bytes that the network carries for a reading."""
        return self.encoded_bytes if self.size_bytes is None else self.size_bytes

    @property
    def late_by_ns(self) -> int:
        """The latency."""
        return self.latency_ns


class ViewSettings(EyeSettings):
    """The view of a camera.

    The angle of view is the horizontal `fov`, or follows from the `focal_length` of a lens before a sensor of
    `sensor_width`; without both it is 60 degrees. The vertical one follows from `width` and `height` of the picture
    (pixels). Things from `near` to `far` along the axis are seen.
    """

    width: Annotated[int, Field(ge=8, le=1280)] = 320
    height: Annotated[int, Field(ge=8, le=960)] = 180
    fov: Fov | None = None
    focal_length: FocalLength | None = None
    sensor_width: FocalLength = default("32 mm")
    near: Near = default("5 cm")
    far: Far = default("50 m")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.fov is not None and self.focal_length is not None:
            raise custom_error(BadValue("both fov and focal_length, which are one angle of view", self.focal_length))
        if self.focal_length is not None and not LEAST_DEG <= degrees(self.angle) <= GREATEST_DEG:
            what = f"the angle of view would be {degrees(self.angle):g} deg, not {LEAST_DEG:g} to {GREATEST_DEG:g} deg"
            raise custom_error(BadValue(what, self.focal_length))
        if self.near >= self.far:
            raise custom_error(BadValue(f"near is not below far, {self.far:g} m", self.near))
        return self

    @property
    def angle(self) -> float:
        """The horizontal angle of view (rad)."""
        if self.focal_length is not None:
            return 2.0 * atan(self.sensor_width / (2.0 * self.focal_length))
        return DEFAULT_FOV if self.fov is None else self.fov

    @property
    def optics(self) -> Optics:
        """What its view depends on beside its pose."""
        return Optics(self.width, self.height, self.angle, self.near, self.far)


class PictureSettings(ViewSettings, SightSettings):
    """The lens of a camera of pictures."""

    pictures: ClassVar[Sequence[str]] = ()
    """Those of `image`, `depth` and `segmentation` that its readings have."""
    bytes_per_pixel: ClassVar[float] = 0.0

    distortion: Distortion = Distortion()

    @property
    def encoded_bytes(self) -> int:
        """The bytes of a usual encoding of a picture."""
        return round(self.width * self.height * self.bytes_per_pixel)

    @property
    def optics(self) -> Optics:
        """What its pictures depend on beside its pose."""
        lens = self.distortion
        return replace(super().optics, distortion=(lens.k1, lens.k2, lens.p1, lens.p2, lens.k3))


class ColourSettings(PictureSettings):
    """Each pixel is the mean of `samples` x `samples` points. Links that move blur over the `exposure` before the tick,
    where their state has velocities; the camera counts as standing. `gain` is a factor of brightness, `noise` the
    standard deviation of each value from 0 to 255."""

    samples: Annotated[int, Field(ge=1, le=4)] = 1
    shadows: bool = False
    exposure_ns: Exposure = default("0 s", "exposure")
    noise: Annotated[float, Field(ge=0.0, le=255.0)] = 0.0
    gain: Annotated[float, Field(ge=0.0, le=16.0)] = 1.0

    @property
    def optics(self) -> Optics:
        """What its pictures depend on beside its pose."""
        lens = super().optics
        exposure = self.exposure_ns / 1e9
        return replace(
            lens, samples=self.samples, shadows=self.shadows, exposure=exposure, noise=self.noise, gain=self.gain
        )


class Eye:
    """The pose of a camera. What it keeps follows from deployment and layout."""

    def __init__(self, at: Mounting, settings: EyeSettings) -> None:
        """Raises IncompatibleComponent for a link that the robot does not have, or an unknown entity to look at."""
        where = settings.at
        around = Surroundings(at.spec, at.layout)
        self._mount: Mounted | None = None
        self._standing = where.position, where.orientation
        if at.robot.name in around.bodies:
            self._mount = Mounted(at, where)
        elif where.link is not None:
            what = f"{at.robot.name} has no body, so its cameras are placed in the world's frame, without a link"
            raise IncompatibleComponent(("at", "link"), what, where.link)
        self._target, self._seen = settings.look_at, None
        if settings.look_at is not None and (name := settings.look_at.entity) is not None:
            if name not in around.bodies:
                there = [*around.bodies]
                nearest = nearest_quoted(name, there)
                raise IncompatibleComponent(("look_at", "entity"), "no entity with a body", name, nearest)
            self._seen = Mounted(mounting_of(at.spec, at.layout, at.layout[name]), FIRST_LINK)

    def pose(self, numbers: Sequence[float]) -> tuple[Vector, Quaternion]:
        """Return the place (m) and the orientation of the camera, in the world frame.

        It keeps the orientation of its mount while the entity to look at is absent, or where the camera is.
        """
        place, turned = self._standing if self._mount is None else self._mount.pose(numbers)
        if self._target is None:
            return place, turned
        goal = self._target.x, self._target.y, self._target.z
        if self._seen is not None:
            if self._seen.entity.is_absent(numbers):
                return place, turned
            origin, orientation = self._seen.pose(numbers)
            goal = moved(origin, rotate(orientation, goal), 1.0)
        way = moved(goal, place, -1.0)
        return place, turned if way == ORIGIN else towards(way)


def towards(way: Vector) -> Quaternion:
    """Return the orientation whose x axis points along a way, and whose y axis is level: straight up and down its y
    axis is the world's."""
    x, y, z = way
    flat = sqrt(x * x + y * y)
    length = sqrt(flat * flat + z * z)
    (ys, yc) = half_turn(x / flat, y / flat) if flat > 0.0 else (0.0, 1.0)
    (ps, pc) = half_turn(flat / length, -z / length)
    return multiply((0.0, 0.0, ys, yc), (0.0, ps, 0.0, pc))


def half_turn(c: float, s: float) -> tuple[float, float]:
    """Return sine and cosine of half an angle from its cosine and sine."""
    if c >= 0.0:
        cos_half = sqrt((1.0 + c) / 2.0)
        return s / (2.0 * cos_half), cos_half
    sin_half = copysign(sqrt((1.0 - c) / 2.0), s)
    return sin_half, s / (2.0 * sin_half)


class PictureSensor(Sensor):
    """A sensor that is drawn at its readers: its reading is its pose and the moving bodies in its view."""

    reading: ClassVar[type[Seen]] = Sight

    def __init__(self, settings: Any, at: Mounting) -> None:
        self._eye, self._in_view = Eye(at, settings), InView(settings.optics, looks_of(at))

    @staticmethod
    def check(settings: Any, at: Mounting) -> None:
        """Raise IncompatibleComponent for a pose that cannot be, or for more moving bodies than a packet takes."""
        Eye(at, settings)
        exposure, bodies = settings.optics.exposure, looks_of(at)
        count = len(bodies) + sum([end - first for looks in bodies for first, end in looks.runs(exposure)])
        if count > NUMBERS_MAX:
            less = "fewer of them, or no exposure, would help" if exposure else "fewer of them would help"
            what = (
                f"a packet takes {NUMBERS_MAX} numbers, and all {len(bodies)} moving bodies of this world, which may be"
            )
            raise IncompatibleComponent(("kind",), f"{what} in view, have {count}; {less}", settings.kind)

    def sample(self, view: View) -> Seen:
        place, turned = self._eye.pose(view.numbers)
        numbers = view.numbers if isinstance(view.numbers, list) else list(view.numbers)
        return self.reading(float(view.tick), *place, *turned, tuple(self._in_view.moving(numbers, place, turned)))
