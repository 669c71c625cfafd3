"""What an actuator knows of its jobs: begun, repeated, preempted, cancelled, refused, dropped, in every order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import pairwise, permutations
from typing import Annotated, Any, Final

import pytest
from msgspec import Meta, Struct

from foosim.client.player import Packet, Player
from foosim.common.errors import DeploymentError, Refused
from foosim.deployment.loader import load_deployment
from foosim.library.mobile.go_to import Place
from foosim.library.mobile.waypoint import Waypoint
from foosim.simulation.simulation import Simulation
from foosim.world.component_types import registry
from foosim.world.component_types.jobs import JobState
from foosim.world.component_types.payloads import PayloadCodec
from foosim.world.component_types.quantities import JobNumber, Metres
from foosim.world.component_types.registry import actuator
from foosim.world.component_types.settings import ActuatorSettings
from foosim.world.components.base import Actuator
from foosim.world.components.job_reading import Jobs
from tests.kinematic_yard import yard_text

NAME: Final = "yard.yaml"
ANN, BEN, EVE = "ann", "ben", "eve"
NONE, RUNNING, DONE, FAILED, PREEMPTED, CANCELLED = JobState
PLACE: Final = PayloadCodec(Place, "go_to")
BATTERY: Final = {"own": {"kind": "battery", "capacity": "5 J", "idle": "10 W"}}
DELAY: Final = [{"kind": "delay", "time": "50 ms"}]


class Silent(Player):
    """Says nothing: its test does."""


@contextmanager
def yard(
    robot: Mapping[str, Any] | None = None, drive: Mapping[str, Any] | None = None, **sections: Any
) -> Iterator[Simulation]:
    """A base that ann and ben may command, and eve only hears."""
    about = {"class": f"{__name__}:Silent", "rate": "100 Hz"}
    players = {ANN: {**about, "robots": {"base": ["jobs"]}}, BEN: {**about, "robots": {"base": ["jobs"]}}}
    sensors = {"jobs": {"kind": "job", "actuator": "go", "rate": "1 Hz"}}
    base = {"model": "holonomic", "actuators": {"go": {"kind": "go_to", **(drive or {})}}, "sensors": sensors}
    players[EVE] = {**about, "robots": {}, "hears": {"base": ["jobs"]}}
    text = yard_text({"base": {**base, **(robot or {})}}, players=players, **sections)
    with Simulation(load_deployment(text, NAME), agents=[ANN, BEN, EVE]) as simulation:
        yield simulation


def tell(simulation: Simulation, *sent: tuple[str, float], ticks: int = 1) -> list[tuple[int, JobState]]:
    """Send jobs, by sender and number, to far places of their own; return the last jobs of ann and of ben."""
    packets: dict[str, list[Packet]] = {ANN: [], BEN: [], EVE: []}
    for sender, job in sent:
        packets[sender].append(Packet("base", "go", PLACE.encode(place_of(sender, job))))
    simulation.advance(packets, ticks)
    return known(simulation)


def place_of(sender: str, job: float) -> Place:
    """The place that belongs to a sender's job."""
    return Place(10.0 + abs(job), {ANN: 1.0, BEN: 2.0, EVE: 3.0}[sender], job)


def known(simulation: Simulation) -> list[tuple[int, JobState]]:
    numbers, states = (simulation.frame.vector("base", f"go.jobs_{what}", 2) for what in ("numbers", "states"))
    return [(int(number), JobState(int(state))) for number, state in zip(numbers, states, strict=True)]


def running(simulation: Simulation) -> int:
    return int(simulation.frame.at("base", "go.jobs_running"))


def target(simulation: Simulation) -> tuple[float, ...]:
    return tuple(simulation.frame.vector("base", "go.target", 2))


# --- one after the other ---------------------------------------------------------------------------------------------


def test_a_new_job_preempts_any_running_one() -> None:
    with yard() as its:
        assert known(its) == [(0, NONE), (0, NONE)]
        assert tell(its, (ANN, 1.0)) == [(1, RUNNING), (0, NONE)]
        assert running(its) == 1
        assert tell(its, (BEN, 4.0)) == [(1, PREEMPTED), (4, RUNNING)]
        assert running(its) == 2
        assert tell(its, (BEN, 5.0)) == [(1, PREEMPTED), (5, RUNNING)]
        assert target(its) == (15.0, 2.0)


def test_only_its_owner_cancels() -> None:
    with yard() as its:
        tell(its, (ANN, 1.0))
        assert tell(its, (BEN, -1.0)) == [(1, RUNNING), (1, CANCELLED)]
        assert tell(its, (ANN, -1.0)) == [(1, CANCELLED), (1, CANCELLED)]
        assert (running(its), its.frame.at("base", "go.has_target")) == (0, 0.0), "it stops"
        assert tell(its, (ANN, -1.0), (ANN, 1.0)) == [(1, CANCELLED), (1, CANCELLED)]


def test_a_plain_command_is_no_job() -> None:
    with yard() as its:
        tell(its, (ANN, 1.0))
        assert tell(its, (BEN, 0.0)) == [(1, PREEMPTED), (0, NONE)]
        assert (running(its), target(its)) == (0, (10.0, 2.0))
        assert tell(its, (ANN, -1.0)) == [(1, PREEMPTED), (0, NONE)]
        assert its.frame.at("base", "go.has_target") == 1.0, "it goes on"


def test_who_may_not_command_the_robot_gives_it_no_jobs() -> None:
    with yard() as its:
        assert tell(its, (EVE, 1.0), (ANN, 1.5), (ANN, 2.0**60)) == [(0, NONE), (0, NONE)]
        assert its.frame.at("base", "refused") == 3.0


# --- every order -----------------------------------------------------------------------------------------------------

SENT: Final = ((ANN, 1.0), (ANN, -1.0), (ANN, 2.0), (BEN, 1.0), (BEN, -1.0))


@pytest.mark.parametrize("together", [False, True])
def test_in_every_order_a_job_begins_once_and_what_was_cancelled_never(together: bool) -> None:
    """In one tick, and each in a tick of its own; afterwards all come once more, and nothing changes."""
    ends = set()
    with yard() as its:
        start = its.frame
        for order in permutations(SENT):
            its.reset(start)
            seen = [known(its)]
            for sent in [order] if together else [(one,) for one in order]:
                seen.append(tell(its, *sent))
                numbers = [row for row, (_, state) in enumerate(seen[-1], 1) if state == RUNNING]
                assert numbers == ([running(its)] if running(its) else []), order
            for row in (0, 1):
                for (number, state), after in pairwise([one[row] for one in seen]):
                    assert after[0] >= number, order
                    assert not (after[0] == number and state.has_ended and after[1] != state), order
            ann, ben = seen[-1]
            assert (ann[0], ben[0]) == (2, 1)
            if order.index((BEN, -1.0)) < order.index((BEN, 1.0)):
                assert (ann[1], ben[1]) == (RUNNING, CANCELLED), order
            assert tell(its, *order) == seen[-1], order
            ends.add((ann[1], ben[1]))
    assert ends | {(RUNNING, PREEMPTED)} == {(RUNNING, PREEMPTED), (RUNNING, CANCELLED), (PREEMPTED, CANCELLED)}


# --- ends ------------------------------------------------------------------------------------------------------------


def test_it_is_done_when_the_robot_is_there_and_stays() -> None:
    with yard() as its:
        its.advance({ANN: [Packet("base", "go", PLACE.encode(Place(0.5, 0.0, 1.0)))]}, 200)
        assert known(its)[0] == (1, DONE)
        x, y, _ = its.frame.vector("base", "position", 3)
        assert 0.4 <= x <= 0.5
        assert y == 0.0
        assert its.frame.vector("base", "base_velocity", 3) == [0.0, 0.0, 0.0]


def test_it_fails_when_the_robot_goes_out_of_service() -> None:
    with yard() as its:
        tell(its, (ANN, 1.0))
        its.set("base", "down", True)
        assert tell(its) == [(1, FAILED), (0, NONE)]
        its.set("base", "down", False)
        assert tell(its, (ANN, 1.0)) == [(1, FAILED), (0, NONE)]
        assert its.frame.at("base", "go.has_target") == 0.0


def test_what_was_known_outlasts_a_robot_that_leaves_and_comes_back() -> None:
    with yard() as its:
        tell(its, (ANN, 3.0), (BEN, 2.0))
        its.remove("base")
        assert tell(its) == [(3, PREEMPTED), (2, FAILED)]
        its.add("base", "1,1")
        assert tell(its, (BEN, 2.0), (ANN, 3.0)) == [(3, PREEMPTED), (2, FAILED)]
        assert running(its) == 0
        assert tell(its, (ANN, 4.0)) == [(4, RUNNING), (2, FAILED)]


def test_it_fails_when_the_battery_is_empty() -> None:
    with yard({"rules": BATTERY}) as its:
        assert tell(its, (ANN, 1.0), ticks=40)[0] == (1, RUNNING)
        assert tell(its, ticks=20)[0] == (1, FAILED)


def test_a_delayed_job_begins_later_and_is_still_its_senders() -> None:
    with yard(drive={"modifiers": DELAY}) as its:
        assert tell(its, (BEN, 7.0), ticks=4) == [(0, NONE), (0, NONE)]
        assert tell(its, (BEN, 7.0), ticks=4) == [(0, NONE), (7, RUNNING)]
        assert target(its) == (17.0, 2.0)


# --- what is told of it ----------------------------------------------------------------------------------------------


def test_the_sensor_sends_at_each_change() -> None:
    """At its rate there is a reading each 100 ticks; and one more for each tick in which something has changed."""

    def readings() -> float:
        return its.frame.at("base", "jobs.samples")

    with yard() as its:
        assert readings() == 0.0
        tell(its, ticks=10)
        assert readings() == 1.0
        tell(its, (ANN, 1.0), ticks=10)
        assert readings() == 2.0
        assert its.readings["base", "jobs"].value == Jobs(1.0, 0.0, (1.0, 0.0), (1.0, 0.0))
        tell(its, (ANN, 1.0), ticks=10)
        assert readings() == 2.0, "a repeat changes nothing"
        tell(its, (ANN, -1.0), ticks=1)
        tell(its, (BEN, 1.0), ticks=10)
        assert readings() == 4.0
        assert its.readings["base", "jobs"].value == Jobs(2.0, 0.0, (1.0, 1.0), (5.0, 1.0))
        tell(its, ticks=70)
        assert readings() == 5.0


def test_a_rotorcraft_that_has_come_to_its_waypoint_is_done() -> None:
    pilot = {"actuators": {"go": {"kind": "waypoint", "patience": "1 s"}}, "model": "rotorcraft"}
    codec = PayloadCodec(Waypoint, "waypoint")
    with yard(pilot) as its:
        its.advance({ANN: [Packet("base", "go", codec.encode(Waypoint(1.0, 0.0, 1.0, 3.0, 1.0)))]}, 50)
        assert known(its)[0] == (1, RUNNING)
        its.advance({}, 400)
        assert known(its)[0] == (1, DONE)
        assert its.frame.vector("base", "position", 3) == pytest.approx([1.0, 0.0, 1.0])
    wall = {"length": "1 m", "width": "9 m", "height": "9 m", "at": {"x": "2 m"}}
    with yard(pilot, scene={"kind": "boxes", "boxes": {"wall": wall}}) as its:
        its.advance({ANN: [Packet("base", "go", codec.encode(Waypoint(4.0, 0.0, 1.0, 0.0, 1.0)))]}, 500)
        assert known(its)[0] == (1, FAILED)
        assert 0.0 < its.frame.vector("base", "position", 3)[0] < 1.5


@pytest.mark.parametrize("model", ["holonomic", "differential_drive", "rigid"])
def test_with_feelers_it_goes_round_what_is_in_its_way(model: str) -> None:
    """Without it stands before the box until its patience is over."""
    robot: dict[str, Any] = {"model": model}
    engine: dict[str, Any] = {}
    if model == "rigid":
        robot, engine = {"model": "differential_drive", "dynamics": "rigid"}, {"engine": "mujoco", "substeps": 4}
    box = {"length": "50 cm", "width": "50 cm", "height": "50 cm", "at": {"x": "2 m", "y": "5 cm"}}
    scene = {"kind": "boxes", "boxes": {"box": box}}
    sent = {ANN: [Packet("base", "go", PLACE.encode(Place(4.0, 0.0, 1.0)))]}
    for feelers, state in (("80 cm", DONE), (None, FAILED)):
        drive = {"kind": "go_to", "feelers": feelers, "patience": "8 s"}
        with yard({**robot, "actuators": {"go": drive}}, scene=scene, **engine) as its:
            its.advance(sent, 2000)
            assert known(its)[0] == (1, state), feelers


# --- what is refused -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("robot", "text"),
    [
        ({"sensors": {"jobs": {"kind": "job", "actuator": "og", "rate": "1 Hz"}}}, "there are go, 'og'"),
        ({"actuators": {"go": {"kind": "x_y_w"}}}, "no such actuator with jobs; there are none"),
        ({"model": "rotorcraft"}, "valid are robots on two wheels and of the model holonomic"),
        ({"model": "station", "x": "0 m", "y": "0 m"}, "go_to"),
    ],
)
def test_what_does_no_jobs_is_refused(robot: dict[str, Any], text: str) -> None:
    with pytest.raises(DeploymentError, match=text), yard(robot):
        pass


class Bare(Struct, frozen=True):
    """A command without a number."""

    x: Metres


class Numbered(Struct, frozen=True):
    """A command with a number."""

    x: Metres
    job: JobNumber = 0.0


class Named(Struct, frozen=True):
    """A command that is not numbers."""

    place: str
    job: JobNumber = 0.0


class Several(Struct, frozen=True):
    """A command of two numbers at least."""

    places: Annotated[tuple[Metres, ...], Meta(min_length=2)]
    job: JobNumber = 0.0


@pytest.mark.parametrize(
    ("command", "methods", "text"),
    [
        (Named, ("progress",), "its fields must be numbers, or tuples which may be empty"),
        (Several, ("progress",), "its fields must be numbers, or tuples which may be empty"),
        (Bare, ("progress",), "its last field is not `job: JobNumber = 0.0`"),
        (Numbered, (), "has no method progress"),
    ],
)
def test_an_actuator_that_cannot_do_jobs_is_not_registered(
    command: type[Struct], methods: Sequence[str], text: str
) -> None:
    made = type("Made", (Actuator,), dict.fromkeys(("command", *methods), lambda self, view: RUNNING))
    with pytest.raises(Refused, match=text):
        actuator("of_no_jobs", ActuatorSettings, command, jobs=True)(made)
    assert registry.lookup("actuator", "of_no_jobs") is None
