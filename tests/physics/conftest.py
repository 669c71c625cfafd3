"""A world on one engine, loaded anew from its numbers at every tick, and the experiments that both must pass."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from foosim.library.table.settings import table_of
from foosim.world.assembly.world import build_scene, initial_numbers
from foosim.world.layout import Entity, build_layout
from foosim.world.scene import Vector, inertia_about_axis
from tests.deployed import deployed
from tests.physics.test_rod_drives import Driven
from tests.placing import place_ball
from tests.shared_engine import make_shared_engine

Motors = tuple[tuple[float, float], tuple[float, float]]
OFF: Motors = ((0.0, 0.0), (0.0, 0.0))
CENTRE: Vector = (0.0, 0.0, 0.0)


class World:
    """The table with one ball; bodies that an experiment does not name stay parked."""

    def __init__(self, *sets: str) -> None:
        self.deployment = deployed(*sets)
        self.table = table_of(self.deployment)
        self.layout = build_layout(self.deployment)
        self.scene = build_scene(self.deployment, self.layout)
        self.engine = make_shared_engine(self.deployment, self.layout)
        self.numbers = initial_numbers(self.deployment, self.layout)
        self.ball = self.layout["ball"]
        self.tick_s = self.deployment.tick_ns / 1e9

    def put(self, position: Vector, velocity: Vector = CENTRE, spin: Vector = CENTRE) -> None:
        """Place the ball."""
        place_ball(self.numbers, self.ball, position, velocity)
        start = self.ball.offsets["angular_velocity"]
        self.numbers[start : start + 3] = spin

    def set_rod(self, name: str, positions: tuple[float, float], velocities: tuple[float, float]) -> None:
        offsets = self.layout[name].offsets
        self.numbers[offsets["joint_positions"] : offsets["joint_positions"] + 2] = positions
        self.numbers[offsets["joint_velocities"] : offsets["joint_velocities"] + 2] = velocities

    def tick(self, motors: dict[str, Motors] | None = None, ball: bool = True) -> None:
        """Load, command, step and read the ball and the rods that `motors` names."""
        rods = [self.layout[name] for name in sorted(motors or {})]
        bodies: list[Entity] = [self.ball, *rods] if ball else rods
        self.engine.load(bodies, self.numbers)
        self.engine.command(rods, [(motors or {})[rod.name] for rod in rods])
        self.engine.step(self.deployment.substeps)
        self.engine.read(bodies, self.numbers)

    def of(self, name: str, field: str, count: int) -> list[float]:
        start = self.layout[name].offsets[field]
        return self.numbers[start : start + count]

    @property
    def position(self) -> list[float]:
        return self.of("ball", "position", 3)

    @property
    def velocity(self) -> list[float]:
        return self.of("ball", "linear_velocity", 3)

    @property
    def spin(self) -> list[float]:
        return self.of("ball", "angular_velocity", 3)

    @property
    def energy(self) -> float:
        """Mechanical energy of the ball, 0 when it rests on the floor (J)."""
        ball = self.table.ball
        inertia = 0.4 * ball.mass * ball.radius * ball.radius
        motion = ball.mass * sum(v * v for v in self.velocity) + inertia * sum(w * w for w in self.spin)
        return motion / 2 + ball.mass * self.table.gravity * (self.position[2] - ball.radius)

    def rod_inertia(self, name: str) -> float:
        return inertia_about_axis(self.scene.bodies[name].links[1])

    def rod_mass(self, name: str) -> float:
        return sum(link.mass for link in self.scene.bodies[name].links)

    # --- experiments -------------------------------------------------------------------------------------------------

    def bounce_off_side(self, speed: float, phase: float, along: float = 0.0) -> None:
        """Throw the ball at the side wall without gravity; `phase` is the part of a substep by which it is farther."""
        substep = self.tick_s / self.deployment.substeps
        face = self.table.field.width / 2 - self.table.ball.radius
        self.put((0.0, face - 0.004 - phase * speed * substep, 0.07), (along, speed, 0.0))
        for _ in range(2 + int(0.004 / (speed * self.tick_s)) + 2):
            self.tick()

    def roll(self, x: float, speed: float, seconds: float) -> None:
        """Roll the ball along x."""
        self.put((x, 0.06, self.table.ball.radius), (speed, 0.0, 0.0), (0.0, speed / self.table.ball.radius, 0.0))
        for _ in range(round(seconds / self.tick_s)):
            self.tick()

    def energy_rises(self, start: Vector, velocity: Vector, ticks: int) -> tuple[float, float, int]:
        """Return the greatest rise of energy in a tick, the energy at the start (J), and the touches of walls."""
        self.put(start, velocity)
        first = before = self.energy
        rise, touches = -1.0, 0
        for _ in range(ticks):
            self.tick()
            rise = max(rise, self.energy - before)
            before = self.energy
            touches += int(self.of("ball", "contacts", 1)[0])
        return rise, first, touches

    def shoot_at_foot(self, name: str, speed: float, turning: float, phase: float) -> tuple[bool, float]:
        """Shoot at a figure in the middle of a rod that turns against the ball; return whether it passed, and touches.

        Ball and foot meet after 8 ms, with the foot straight down.
        """
        base = self.scene.bodies[name].position
        meet = 0.008 + phase * self.tick_s / self.deployment.substeps
        front = base[0] - self.table.rod.foot.length / 2 - self.table.ball.radius
        radius = self.table.ball.radius
        self.put((front - speed * meet, 0.0, radius), (speed, 0.0, 0.0), (0.0, speed / radius, 0.0))
        self.set_rod(name, (0.0, -turning * meet), (0.0, turning))
        spin = self.table.drive.spin
        passed, touches = False, 0.0
        for _ in range(12):
            self.tick({name: ((0.0, self.table.drive.slide.force), (turning, spin.torque))})
            touches += self.of("ball", "contacts", 1)[0]
            passed = passed or self.position[0] > base[0]
        return passed, touches

    def kick(self, name: str, turning: float, *, phase: float = 0.0, held: bool = False) -> tuple[float, float, float]:
        """Let a rod kick a resting ball; return its speed, a free rod's in theory, and the rod's turning speed after.

        The foot meets the ball as it hangs straight down, `phase` of a substep later. The rod is free, or a motor holds
        its place and speed with any force.
        """
        motors: Motors = ((0.0, 1e6), (turning, 1e5)) if held else OFF
        base = self.scene.bodies[name].position
        radius = self.table.ball.radius
        self.put((base[0] - self.table.rod.foot.length / 2 - radius, 0.0, radius))
        self.set_rod(name, (0.0, -0.1 - phase * turning * self.tick_s / self.deployment.substeps), (0.0, turning))
        for _ in range(round((0.1 + 0.06) / turning / self.tick_s) + 2):
            self.tick({name: motors})
            if self.of("ball", "contacts", 1)[0]:
                break
        arm = self.table.rod.axis_height - radius
        bounce = 1 + self.table.surfaces.figures.restitution
        theory = bounce * turning * arm / (1 + self.table.ball.mass * arm * arm / self.rod_inertia(name))
        return -self.velocity[0], theory, self.of(name, "joint_velocities", 2)[1]


def _worlds() -> Iterator[Callable[..., World]]:
    """Makes worlds with settings of the deployment, and frees their engines."""
    made: list[World] = []

    def make(*sets: str) -> World:
        made.append(World(*sets))
        return made[-1]

    yield make
    for one in made:
        one.engine.close()


world = pytest.fixture(_worlds)
lasting_world = pytest.fixture(_worlds, scope="module")


@pytest.fixture
def driven() -> Iterator[Callable[..., Driven]]:
    """Makes driven rods, whose engines end with the test."""
    made: list[Driven] = []

    def make(*arguments: Any, **more: Any) -> Driven:
        made.append(Driven(*arguments, **more))
        return made[-1]

    yield make
    for one in made:
        one.engine.close()
