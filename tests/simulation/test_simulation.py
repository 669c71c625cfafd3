"""A world that is stepped from Python has the digests of a run: with the emulated network, and without one."""

from __future__ import annotations

import struct
from math import nan
from pathlib import Path
from typing import Final

import pytest

from foosim.client.commands import CommandEncoder
from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.validate_network import BadEvent
from foosim.library.table.learning.table_rewards import with_ball
from foosim.library.table.rod_position import Command
from foosim.protocol.messages import Received
from foosim.simulation.agents import LEARNER
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.simulation import Simulation, read_for_stepping
from foosim.simulation.stepped_world import SteppedWorld
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.robot_packets import Delivered
from tests.waving import PERIOD, PLAYERS, waved

DEPLOY: Final = Path(__file__).parents[2] / "deploy"
TABLE: Final = DEPLOY / "table.yaml"
TICKS: Final = 60
WAIT: Final = "table.rules.kickoff_delay=20 ms"
"""The ball is in play from tick 10 on."""


def run_of(path: Path, ticks: int, *sets: str, capture: Path | None = None) -> Rehearsed:
    return rehearse(path.read_text(), path.name, ticks, 1, sets, capture=capture, folder=path.parent)


def digests_of(simulation: Simulation, ticks: int) -> list[bytes]:
    """Step with nobody acting for an agent."""
    found = []
    for _ in range(ticks):
        simulation.step()
        found.append(simulation.frame.digest)
    return found


def test_a_partition_that_is_called_for_is_that_of_the_deployment() -> None:
    """From the next frame on, by what the players do when the camera is silent, and when it is heard again."""
    cut, healed = 20, 40
    events = f"[{{at: {2 * cut} ms, partition: [[camera], ['player-*']]}}, {{at: {2 * healed} ms, heal: all}}]"
    with Simulation(TABLE, agents=[], network=True, sets=[WAIT]) as simulation:
        found = digests_of(simulation, cut - 1)
        simulation.partition("camera", ["player-*"])
        found += digests_of(simulation, healed - cut)
        simulation.heal()
        found += digests_of(simulation, TICKS + 1 - healed)
        with pytest.raises(BadEvent, match="red\\.gaol"):
            simulation.partition("red.gaol", "camera")
    assert found == run_of(TABLE, TICKS, WAIT, f"network.events={events}").digests
    assert found != run_of(TABLE, TICKS, WAIT).digests
    with Simulation(TABLE, sets=[WAIT]) as simulation, pytest.raises(BadValue, match="no network"):
        simulation.heal()


def test_labels_change_nothing() -> None:
    labels = (
        "robots.red.goal.label=Buts rouges, 1",
        "robots.red.goal.sensors.encoder.label=encoder.001",
        "robots.blue.goal.sensors.encoder.label=encoder.001",
        "robots.red.goal.actuators={position: {kind: rod_position, label: Rod}}",
    )
    with Simulation(TABLE, sets=[WAIT]) as plain, Simulation(TABLE, sets=[WAIT, *labels]) as labelled:
        assert plain.frame.layout.digest == labelled.frame.layout.digest
        assert digests_of(plain, TICKS) == digests_of(labelled, TICKS)


def test_commands_of_an_agent_are_those_of_a_player_who_sends_the_same() -> None:
    """By the network of the deployment: the packets of the agent draw what those of the player draw."""
    sets = [PLAYERS, WAIT, "network.links.0.loss=20 %"]
    with Simulation(TABLE, network=True, sets=sets) as simulation:
        found = []
        for tick in range(TICKS):
            simulation.step(waved(tick) if tick % PERIOD == 0 else {})
            found.append(simulation.frame.digest)
        assert set(simulation.readings) == {
            ("camera", "ball"),
            ("red.goal", "encoder"),
            ("red.midfield", "encoder"),
        }
        late = [sample.due_ns - sample.sent_ns for sample in simulation.readings.values()]
    assert found == run_of(TABLE, TICKS, *sets).digests
    assert min(late) >= 1_000_000, "the links delay by 1 ms and more"


def test_without_a_network_commands_arrive_at_the_frame_at_which_they_are_sent() -> None:
    deployment = load_deployment(apply_sets(TABLE.read_text(), TABLE.name, [PLAYERS, WAIT]), TABLE.name)
    encoder, world = CommandEncoder(deployment), SteppedWorld(deployment, initial_frame(deployment))
    number = 0
    try:
        with Simulation(deployment) as simulation:
            assert simulation.frame.digest == world.frame.digest
            for tick in range(TICKS):
                commands = waved(tick) if tick % PERIOD == 0 else {}
                delivered = []
                for robot, command in sorted(commands.items()):
                    number += 1
                    now_ns = tick * deployment.tick_ns
                    (what,) = encoder.encode(robot, command)
                    delivered.append(Delivered(now_ns, "waver", number, 0, robot, *what))
                simulation.step(commands)
                assert simulation.frame.digest == world.step(delivered).digest, tick
    finally:
        world.close()


def test_what_a_person_sees() -> None:
    with Simulation(TABLE, sets=[WAIT]) as simulation:
        assert [*simulation.agents] == ["player-blue", "player-red"]
        found = simulation.step({"red.goal": Command(0.05, 0.0)}, ticks=100)
        assert simulation.tick == 100 and simulation.time_s == pytest.approx(0.2)
        assert simulation.status["score"] == {"red": 0, "blue": 0}
        assert found["red.goal", "encoder"].value.slide == pytest.approx(0.05, abs=0.002)  # type: ignore[union-attr]
        assert "ball" in simulation.scene.bodies


def test_who_came_into_quarantine_is_said() -> None:
    with Simulation(TABLE) as simulation:
        simulation.step()
        assert simulation.quarantined == []
        too_fast = with_ball(simulation.deployment, simulation.frame, (0.0, 0.0, 0.0175), (100.0, 0.0, 0.0))
        simulation.reset(too_fast)
        simulation.step(ticks=2)
        assert any("ball is in quarantine until" in text for text in simulation.quarantined)
        simulation.reset()
        assert simulation.quarantined == []


def test_an_agent_keeps_the_newest_reading_and_counts_those_that_are_none() -> None:
    """Packets come out of order, and changed by the network."""
    with Simulation(TABLE, agents=["player-red"], network=True) as simulation:
        agent = simulation.agents["player-red"]
        good = [Received("camera", number, 0, "ball", 0, 0, struct.pack("<3d", number, 0.0, 0.0)) for number in (1, 2)]
        changed = Received("camera", 3, 0, "ball", 0, 0, struct.pack("<3d", nan, 0.0, 0.0))
        agent.take([good[1], good[0], changed], is_checked=True)
        assert simulation.readings["camera", "ball"].value.x == 2.0 and agent.malformed == 1  # type: ignore[union-attr]
        simulation.reset()
        assert simulation.readings == {} and agent.malformed == 0


def test_a_deployment_without_players_has_one_agent_who_commands_all() -> None:
    with Simulation(TABLE, sets=["players={}", "robots.camera.sensors.ball.modifiers=[]"]) as simulation:
        assert [*simulation.agents] == [LEARNER]
        assert len(simulation.step({"blue.attack": Command(0.01, 0.0)})) == 9


def test_what_is_not_valid_is_refused() -> None:
    deployment = read_for_stepping(TABLE)
    with pytest.raises(UnknownName, match=r"player-read.*player-red"):
        Simulation(deployment, agents=["player-read"])
    with pytest.raises(BadValue, match=r"a loaded deployment takes no sets"):
        Simulation(deployment, sets=["seed=2"])
    with Simulation(deployment, agents=["player-red"]) as simulation:
        with pytest.raises(UnknownName, match=r"no robot of an agent.*blue.goal"):
            simulation.step({"blue.goal": Command(0.0, 0.0)})
        with pytest.raises(BadValue, match=r"slide is not finite, nan"):
            simulation.step({"red.goal": Command(nan, 0.0)})
        with pytest.raises(BadValue, match=r"1 or more, 0"):
            simulation.step(ticks=0)
        assert simulation.tick == 0, "nothing was computed"


def test_pinned_files_are_read_beside_the_deployment() -> None:
    """The yard's arm is made from a file in a folder beside it."""
    text, files = pin_assets((DEPLOY / "yard.yaml").read_text(), "yard.yaml", DEPLOY)
    assert files and read_for_stepping(DEPLOY / "yard.yaml").digests == load_deployment(text, "yard.yaml").digests
