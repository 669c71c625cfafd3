"""Pictures at the readers: live, from captures, on any number of nodes, stepped from Python, as observations."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from gymnasium import spaces

from foosim.capture.reader import open_capture
from foosim.common.errors import UnknownName
from foosim.deployment.channel_kinds import channel_codec
from foosim.rendering.cameras import Overview
from foosim.simulation.env import FoosimEnv
from foosim.simulation.run import rehearse
from foosim.simulation.simulation import Simulation
from tests.deployed import DEPLOY, TABLE, TEXT
from tests.looking import LOOKED, LOOKERS

LENS = "width: 64, height: 36, noise: 4, size: 9 kB, latency: 15 ms"
EYE = f"robots.camera.sensors.eye={{kind: rgbd, rate: 50 Hz, at: {{z: 1.2 m}}, look_at: {{entity: ball}}, {LENS}}}"


def test_pictures_are_equal_live_and_from_captures_on_any_number_of_nodes(tmp_path: Path) -> None:
    """The network carries their size, and adds the latency to its delay."""
    live = []
    for nodes in (1, 2, 3):
        LOOKED.clear()
        found = rehearse(TEXT, TABLE.name, 60, nodes, (EYE, LOOKERS), capture=tmp_path / f"{nodes}.mcap")
        assert not found.json["failed"], found.json["reason"]
        live.append(dict(LOOKED))
    assert live[0] == live[1] == live[2] and len(set(live[0].values())) > 2
    capture = open_capture(tmp_path / "3.mcap")
    codec = channel_codec(capture.deployment, "camera", "eye")
    assert codec is not None
    pictures = capture.packets.where(capture.packets.channel == "eye")
    assert set(pictures.size) == {9000} and (pictures.due_ns - pictures.sent_ns >= 16_000_000).all()
    packets = pictures.payload
    seen = {int(sight.tick): sight.image() for sight in map(codec.decode, reversed(packets))}
    assert live[0].items() <= {tick: sha256(image.tobytes()).hexdigest() for tick, image in seen.items()}.items()


def test_an_environment_observes_zeros_of_a_picture_that_the_network_has_changed() -> None:
    corrupt = "network.links.everything.corrupt={bit_error_rate: 1 %, deliver: true}"
    env = FoosimEnv(TABLE, sets=[EYE, LOOKERS, corrupt], pictures=["camera/eye"], network=True)
    env.reset()
    seen = [bool(env.step(np.zeros(len(env.columns[1])))[0]["camera/eye.image"].any()) for _ in range(12)]
    assert ("camera", "eye") in env.simulation.agents["waver"].newest and not any(seen)
    env.close()


@pytest.mark.parametrize("is_above", [False, True])
def test_an_overview_shows_what_is_in_a_wide_yard(is_above: bool) -> None:
    with Simulation(DEPLOY / "yard.yaml") as yard:
        layout, numbers = yard.frame.layout, yard.frame.numbers
        overview = Overview(yard.deployment, layout, 320, 180, is_above=is_above)
        seen = overview.at(0, numbers).image()
        free = [one for one in layout.entities if "position" in one.offsets and not one.is_absent(numbers)]
        for entity in free:
            without = list(numbers)
            without[entity.offsets["position"]] += 1e3
            assert (overview.at(0, without).image() != seen).any(axis=2).sum() > 15, entity.name
        assert len(free) == 6


def test_an_environment_observes_pictures() -> None:
    env = FoosimEnv(TABLE, sets=[EYE, LOOKERS], pictures=["camera/eye"])
    assert isinstance(env.observation_space, spaces.Dict)
    first, _ = env.reset()
    second, *_ = env.step(np.zeros(len(env.columns[1])))
    assert env.observation_space.contains(first) and env.observation_space.contains(second)
    assert not any(np.shares_memory(first[name], second[name]) for name in first)
    assert sorted(second) == ["camera/eye.depth", "camera/eye.image", "readings"]
    sight = env.simulation.readings["camera", "eye"].value
    assert np.array_equal(second["camera/eye.image"], sight.image())  # type: ignore[union-attr]
    assert sight.kept["drawn_by"].draws <= 2  # type: ignore[union-attr]
    again, _ = env.reset(seed=5)
    other, _ = env.reset(seed=6)
    same, _ = env.reset(seed=5)
    assert np.array_equal(again["camera/eye.image"], same["camera/eye.image"])
    assert not np.array_equal(again["camera/eye.image"], other["camera/eye.image"]), "noise is the episode's"
    assert np.array_equal(again["camera/eye.depth"], other["camera/eye.depth"])
    env.close()
    with pytest.raises(UnknownName, match="waver hears no camera"):
        FoosimEnv(TABLE, sets=[LOOKERS.replace("[eye]", "[ball]")], pictures=["*"])
