"""The section `gateways`: the clients that it makes, their places on board, the processes, and what is refused."""

from __future__ import annotations

from fractions import Fraction

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment.loader import load_deployment
from foosim.deployment.processes import SHAPES, processes_of
from foosim.deployment.schema import Deployment
from foosim.protocol.identity import identities_of, of_process
from foosim.simulation.run import rehearse
from foosim.simulation.simulation import Simulation
from tests.gateways.test_socket import TEXT

NAMED = (
    TEXT.replace("  cat:\n", "  red.cat:\n")
    .replace("[cat, mouse]", "[red.cat, mouse]")
    .replace("from: morse-cat, to: morse-mouse", "from: '*', to: '*'")
)


def loaded(*changes: tuple[str, str]) -> Deployment:
    text = NAMED
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    return load_deployment(text, "x.yaml")


def test_each_robot_has_a_client_on_board_to_which_its_own_packets_go_past_the_network() -> None:
    deployment = loaded()
    assert {name: client.on for name, client in deployment.clients.items()} == {
        "morse": None,
        "morse-red-cat": "red.cat",
        "morse-mouse": "mouse",
    }
    profiles = deployment.profiles()
    assert profiles.find("red.cat", "morse-red-cat", "pose").rule == "on_board"
    assert profiles.find("morse-red-cat", "red.cat", "motion").rule == "on_board"
    assert profiles.find("morse-red-cat", "morse-mouse", "radio").rule == "air"
    assert profiles.find("red.cat", "morse-mouse", "pose").rule == "air"
    assert not deployment.clients["morse"].lockstep


def test_a_trigger_makes_the_own_client_one_in_lockstep() -> None:
    deployment = loaded(("streams: 0", "streams: 0, sync: {rate: 20 Hz}, robots: ['m*']"))
    assert (deployment.clients["morse"].lockstep, deployment.clients["morse"].rate_hz) == (True, Fraction(20))
    assert [*deployment.clients] == ["morse", "morse-mouse"]


def test_without_the_gateway_s_process_steps_are_not_awaited() -> None:
    text = NAMED.replace("streams: 0", "streams: 0, sync: {rate: 20 Hz}")
    assert rehearse(text, "x.yaml", 20).json["ticks"] == 20
    with Simulation(load_deployment(text, "x.yaml"), network=True) as simulation:
        simulation.step(ticks=20)
        assert simulation.tick == 20


@pytest.mark.parametrize("shape", SHAPES)
def test_it_has_a_process_of_its_own_with_the_certificates_of_its_clients(shape: str) -> None:
    deployment = loaded()
    (its,) = [one for one in processes_of(deployment, shape).values() if "morse" in one.roles]  # type: ignore[arg-type]
    assert its.roles == ("morse",)
    assert {*of_process(its, deployment)} == {"client.morse", "client.morse-mouse", "client.morse-red-cat"}
    assert {*of_process(its, deployment)} <= {*identities_of(deployment)}


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (("kind: socket", "kind: sockt"), "gateways.morse.kind: unknown gateway (there are: "),
        (("streams: 0", "streams: 0, robots: [dog]"), "clients.morse-dog.on: unknown robot, 'dog'"),
        (("streams: 0", "streams: 0, robots: ['d*']"), "a selector that matches no robot, 'd*'"),
        (("streams: 0", "streams: 0, robots: 5"), "gateways.morse.robots: "),
        (("streams: 0", "streams: -1"), "gateways.morse.streams: "),
        (("streams: 0", "streams: 0, sync: {rate: 3 Hz}"), "clients.morse.rate: not a whole number of ticks of 10 ms"),
        (("streams: 0", "streams: 0, sync: {}"), "gateways.morse.sync: missing key, 'rate'"),
        (
            ("nodes:", "clients: {morse-mouse: {}}\nnodes:"),
            "gateways.morse: it makes a client with the name of one that is declared",
        ),
        (("streams: 0", "streams: 0, classes: {mouse.pose: Pos}"), "nearest is 'Pose'"),
        (("streams: 0", "streams: 0, classes: {mouse.poze: Pose}"), "no component that the gateway serves"),
        (("streams: 0", "streams: 0, names: {mouse: Cat.001}"), "two robots with one name for programs"),
        (("streams: 0", "streams: 0, names: {mous: m}"), "no robot that the gateway serves"),
        (("streams: 0", "streams: 0, alter: {mouse.poze: [NED]}"), "no component that the gateway serves"),
        (("streams: 0", "streams: 0, alter: {mouse.pose: [NEDD]}"), "gateways.morse.alter: unknown frame"),
        (
            ("streams: 0", "streams: 0, alter: {mouse.pose: [ECEF]}"),
            "gateways.morse.alter: in a world without",
        ),
    ],
)
def test_what_is_wrong_is_named_with_its_place(change: tuple[str, str], problem: str) -> None:
    with pytest.raises(DeploymentError) as raised:
        loaded(change)
    (line,) = str(raised.value).splitlines()
    assert line.startswith("x.yaml:")
    assert problem in line
