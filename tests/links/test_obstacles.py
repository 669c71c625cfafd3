"""Obstacles (T21): what stands between two antennas in the newest frame weakens their signal, and nothing else does."""

from __future__ import annotations

from typing import Final

import numpy as np
import pytest

from foosim.deployment.network.radios import Shadowing
from foosim.deployment.schema import Deployment
from foosim.vhub.links.fabric import Fabric
from foosim.vhub.network.packet import Flight
from foosim.vhub.radio.materials import slab_loss_db
from foosim.vhub.radio.propagation import Place
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.frame import Frame
from foosim.world.scene import Vector
from tests.links.offered import deployment_of, uniforms
from tests.links.proof import Proof
from tests.placing import place_ball

HIGH: Final = 0.5
"""Above the table (m)."""
AWAY: Final = (5.0, 5.0, HIGH)
FREQUENCY_HZ: Final = 5.25e9


FREE: Final = "environment: free_space"


def world(*things: str, path_loss: str = FREE, clients: str = "", far: int = 1) -> Deployment:
    """Clients a and b, twice `far` metres apart on a line along x, with a radio that all carry; c beside them."""
    everybody = "a: {}, b: {}, c: {}, d: {}" + clients
    sets = [f"clients={{{everybody}}}"] if clients else []
    radio = f"preset: wifi_5_indoor, shadowing: {{on: false}}, path_loss: {{{path_loss}}}, burst: null, jitter: null"
    return deployment_of(
        *sets,
        f"network.radios={{r: {{{radio}}}}}",
        "network.robots={'*': [r]}",
        f"network.places={{a: [-{far} m, 0 m, {HIGH} m], b: [{far} m, 0 m, {HIGH} m], '*': [0 m, 6 m, {HIGH} m]}}",
        f"scenery={{{', '.join(things)}}}",
    )


def frame_with(deployment: Deployment, ball: Vector, tick: int = 0) -> Frame:
    start = initial_frame(deployment)
    numbers = list(start.numbers)
    place_ball(numbers, start.layout["ball"], ball)
    return Frame(tick, start.layout, np.array(numbers))


def heard(fabric: Fabric, ends: tuple[str, str] = ("a", "b"), sequence: int = 1) -> Flight:
    flight = Flight(*ends, "data", sequence, 0, 0, bytes(20))
    fabric.link(*ends, "data").send(flight)
    return flight


def loss_cdb(deployment: Deployment, ball: Vector = AWAY, ends: tuple[str, str] = ("a", "b")) -> int:
    fabric = Fabric(deployment)
    fabric.turn_to(frame_with(deployment, ball))
    return heard(fabric, ends).path_loss_cdb


def wall(radio: str, thickness: str = "20 cm", at: str = "0 m") -> str:
    size = f"length: {thickness}, width: 3 m, height: 3 m"
    return f"wall: {{shape: box, {size}, x: {at}, z: 1.8 m, surface: walls, radio: {radio}}}"


@pytest.mark.parametrize(
    ("material", "thickness_m"), [("concrete", 0.2), ("brick", 0.1), ("wood", 0.05), ("glass", 0.012)]
)
def test_a_wall_weakens_by_what_its_material_takes(proof: Proof, material: str, thickness_m: float) -> None:
    """P.2040's slab, to a hundredth of a dB, both ways; the receiver gets that much less."""
    clear, built = world(), world(wall(material, f"{100 * thickness_m:g} cm"))
    expected = round(100 * slab_loss_db(material, thickness_m, FREQUENCY_HZ))
    measured = [loss_cdb(built, ends=ends) - loss_cdb(clear, ends=ends) for ends in (("a", "b"), ("b", "a"))]
    assert measured[0] == measured[1]
    what = f"{100 * thickness_m:g} cm of {material} between two, dB"
    proof.within("T21", what, measured[0] / 100, expected / 100, 0.01 + 1e-9, 2)
    fabric = Fabric(built)
    fabric.turn_to(frame_with(built, AWAY))
    flight = heard(fabric)
    assert flight.walls == ("wall",) and abs(flight.walls_cdb - expected) <= 1


def test_walls_add_up_and_a_wall_aside_is_none() -> None:
    one = wall("{loss: 5 dB}", at="-30 cm")
    other = one.replace("wall:", "second:").replace("-30 cm", "40 cm")
    aside = one.replace("wall:", "third:").replace("-30 cm", "150 cm")
    assert loss_cdb(world(one)) - loss_cdb(world()) == 500
    assert loss_cdb(world(one, other, aside)) - loss_cdb(world()) == 1000
    assert loss_cdb(world(wall("none"))) == loss_cdb(world())


def test_a_body_that_moves_in_and_out(proof: Proof) -> None:
    """The ball on the line of sight takes its share, off it takes none: the newest frame decides, tick by tick."""
    deployment = world()
    fabric = Fabric(deployment)
    losses = []
    for tick, y in enumerate([5.0, 0.1, 0.0, 0.01, 0.1, 5.0, 0.0]):
        fabric.turn_to(frame_with(deployment, (0.0, y, HIGH), tick))
        losses.append(heard(fabric, sequence=tick + 1).path_loss_cdb)
    more_db = [round((loss - losses[0]) / 100, 2) for loss in losses]
    on_line = [False, False, True, True, False, False, True]
    off = [db for db, shadowed in zip(more_db, on_line, strict=True) if not shadowed]
    on = [db for db, shadowed in zip(more_db, on_line, strict=True) if shadowed]
    proof.exact("T21", "ball off the line of sight, dB more at each place", off, [0.0] * 4, 4)
    proof.exact("T21", "ball on the line of sight, dB more at each place", on, [0.5] * 3, 3)


def test_the_ends_own_bodies_are_no_obstacles(proof: Proof) -> None:
    """A client on board of a rod is at the rod; its own rod hides nothing, but hides others from each other."""
    deployment = world(clients=", rider: {on: red.goal}")
    fabric = Fabric(deployment)
    fabric.turn_to(frame_with(deployment, AWAY))
    own = [heard(fabric, ends) for ends in (("rider", "a"), ("a", "rider"), ("red.goal", "a"))]
    on_board = Fabric(deployment).link("rider", "red.goal", "data").rule
    own_db = [flight.walls_cdb / 100 for flight in own if "red.goal" in flight.walls]
    proof.exact("T21", "an end's own rod among its obstacles, dB", sum(own_db), 0, 3)
    assert not own_db
    assert on_board == "on_board"
    rod = fabric.world.antenna("red.goal", (0.0, 0.0, 0.0))
    x, _, z = rod
    across = {"a": (x - 1.0, 0.0, z), "b": (x + 1.0, 0.0, z)}
    crossed = [crossing.name for crossing in fabric.world.crossings(across["a"], across["b"], frozenset())]
    assert "red.goal" in crossed
    assert "red.goal" not in [c.name for c in fabric.world.crossings(across["a"], across["b"], frozenset(["red.goal"]))]


def test_the_way_round_bounds_what_walls_take() -> None:
    """`min(LOS + walls, NLOS)`: behind ten metres of concrete it is as out of sight as behind one."""
    losses = []
    for things in ((), (wall("{loss: 1 dB}"),), (wall("{loss: 150 dB}"),), (wall("{loss: 200 dB}"),)):
        losses.append(loss_cdb(world(*things, path_loss="environment: indoor", far=30)))
    assert losses[0] + 100 == losses[1] < losses[2] == losses[3]


def test_strict_sight_is_cut_by_anything() -> None:
    strict = "environment: free_space, strict_los: true"
    fabric = Fabric(world(path_loss=strict))
    causes = []
    for tick, y in enumerate([5.0, 0.0, 5.0]):
        fabric.turn_to(frame_with(fabric.deployment, (0.0, y, HIGH), tick))
        causes.append(heard(fabric, sequence=tick + 1).cause)
    assert causes == ["", "blocked", ""]


@pytest.mark.parametrize("path_loss", ["environment: indoor", "environment: urban_micro", FREE,
                                       "environment: indoor, range: 30 m",
                                       "environment: indoor, strict_los: true"])  # fmt: skip
def test_a_station_senses_what_the_path_says(path_loss: str) -> None:
    """Whatever is known without looking for walls: at every power, near and far, beside walls and behind them."""
    things = [wall("concrete", at=at).replace("wall:", f"wall-{at[0]}:") for at in ("3 m", "6 m", "9 m")]
    deployment = world(*things, path_loss=path_loss)
    shadowed = deployment.network.radios["r"].model_copy(update={"shadowing": Shadowing()})
    network = deployment.network.model_copy(update={"radios": {"r": shadowed}})
    fabric = Fabric(deployment, network)
    fabric.turn_to(frame_with(deployment, AWAY))
    budget = fabric.link("a", "b", "data").setup_at(0).budget
    assert budget is not None
    of, heard_by = budget.propagation, [0, 0]
    places = iter(uniforms(600, 7, "places"))
    for ax, ay, bx, by in zip(places, places, places, places, strict=True):
        a, b = (30.0 * ax - 10.0, 8.0 * ay - 4.0, HIGH), (90.0 * bx - 30.0, 8.0 * by - 4.0, 1.4)
        one, other = Place("a", a), Place("b", b)
        path = of.path(one, other)
        for power_cdbm in (-9000, *range(-2500, 3000, 500)):
            senses = not path.cause and path.loss_cdb <= power_cdbm + of.gain_cdb - of.sense_cdbm
            assert of.hears(one, other, power_cdbm) == senses
            assert of.hears(other, one, power_cdbm) == senses
            heard_by[senses] += 1
    assert min(heard_by) > 60
