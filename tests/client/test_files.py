"""Files of the world at a client that hears a camera: fetched from the vHub through losses, kept, and checked."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, MutableMapping
from itertools import count
from pathlib import Path
from random import Random
from typing import Any, Final

import numpy as np
import pytest
from msgspec.structs import replace

from foosim.client.core import ClientCore
from foosim.common import limits
from foosim.deployment.assets import pin_assets
from foosim.deployment.channel_kinds import channel_codec
from foosim.deployment.loader import load_deployment, with_owners
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.actions import Action, Publish
from foosim.protocol.asset_transfer import piece_of
from foosim.protocol.channels import Plane
from foosim.protocol.codec import decode, encode
from foosim.protocol.handshake import Member
from foosim.protocol.messages import Build, Fetch, Heartbeat, Piece
from foosim.rendering.cameras import Camera
from foosim.runtime.file_cache import FileCache
from foosim.vhub.core import HubCore
from foosim.world.assembly.world import initial_numbers
from foosim.world.layout import build_layout
from foosim.world.matter.mesh import AssetError, digest_of
from tests.kinematic_yard import yard_text

NAME: Final = "yard.yaml"
MS: Final = 1_000_000
SHARD: Final = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n"
MASS: Final = '<inertial><mass value="1"/><inertia ixx="0.02" ixy="0" iyy="0.02" ixz="0" iyz="0" izz="0.1"/></inertial>'
CART: Final = f"""<robot name="cart"><link name="hull">{MASS}
  <visual><geometry><mesh filename="seen.obj"/></geometry></visual>
  <collision><geometry><box size="1 1 1"/></geometry></collision></link></robot>
"""
EYE: Final = "eye: {kind: camera, rate: 10 Hz, width: 32, height: 18, at: {x: -3 m, z: 1 m}}"
CART_AT: Final = "robots.cart={model: urdf, file: cart.urdf, at: {z: 1 m}, fixed: true, sensors: {%s}}"
SEEDS: Final = count()
"""Equal texts are one deployment in a process, whose files are fetched once."""
SEEN: Final = "seen.obj.visual"


def pinned(folder: Path, sensors: str = EYE) -> tuple[str, Deployment]:
    """A yard with a robot whose looks are in a file, and a client `ear`: its text, and with the files."""
    (folder / "cart.urdf").write_text(CART)
    (folder / "seen.obj").write_bytes(SHARD)
    text = yard_text({"post": {"model": "differential_drive", "at": {"x": "-9 m"}}}, engine="mujoco", tick="2 ms")
    sets = [CART_AT % sensors, f"seed={next(SEEDS)}", "clients={ear: {lockstep: false}}"]
    text, files = pin_assets(with_owners(text, NAME, {"n1": ["*"]}, sets), NAME, folder)
    return text, load_deployment(text, NAME).with_assets(files)


@pytest.fixture
def yard(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[str, Deployment]:
    monkeypatch.setattr(limits, "RADIO_PIECE_BYTES", 100)
    return pinned(tmp_path)


def published(core: ClientCore | HubCore) -> Iterator[Publish]:
    actions = [*core.actions]
    core.actions.clear()
    yield from (action for action in actions if isinstance(action, Publish))


class Radio:
    """A vHub with the files, and a client at the other end of a lossy connection."""

    def __init__(
        self, yard: tuple[str, Deployment], cache: MutableMapping[str, bytes], loss: float = 0.0, channel: str = "eye"
    ) -> None:
        (self.text, self.deployment), self.loss, self.random = yard, loss, Random(1)
        self.now_ns = self.pieces = 0
        self.joined = False
        self.change: Callable[[Piece], Piece] = lambda piece: piece
        self.start("hub-1")
        self.core = ClientCore("ear", "boot", 0, cache=cache)
        self.until(lambda: self.core.deployment is not None)
        self.core.join(0, [("cart", channel)])

    def start(self, boot: str) -> None:
        """Start a vHub, which gets the files from the supervisor."""
        self.hub = HubCore(boot, bytes(32), self.now_ns)
        build = Build("vhub", boot, "super", "run", NAME, self.text, "fast")
        self.hub.receive(channels.BUILD, "vhub", encode(build), self.now_ns)
        while self.hub.member.build is None:
            self.hub.wake(self.now_ns)
            for one in published(self.hub):
                if one.channel is channels.FETCH:
                    piece = piece_of(self.deployment, decode(Fetch, one.payload))
                    self.hub.receive(channels.PIECE, "vhub", encode(piece), self.now_ns)
        self.hub.begin(None, self.now_ns)

    def until(self, reached: Callable[[], bool]) -> None:
        """Carry messages, some of which are lost."""
        while not reached():
            assert self.now_ns < 60_000 * MS
            self.now_ns += 10 * MS
            self.core.wake(self.now_ns)
            for one in published(self.core):
                self.joined |= one.channel is channels.UP
                if self.random.random() >= self.loss:
                    self.hub.receive(one.channel, one.name, one.payload, self.now_ns)
            for one in published(self.hub):
                if one.channel.plane is Plane.RADIO and self.random.random() >= self.loss:
                    payload = one.payload
                    if one.channel is channels.CLIENT_PIECE:
                        self.pieces += 1
                        payload = encode(self.change(decode(Piece, payload)))
                    self.core.receive(one.channel, one.name, payload, self.now_ns)

    def image(self) -> Any:
        """The picture that the client draws of the camera's first reading."""
        layout = build_layout(self.deployment)
        sight = Camera(self.deployment, layout, "cart", "eye").at(0, initial_numbers(self.deployment, layout))
        assert self.core.deployment is not None and sight is not None
        codec = channel_codec(self.core.deployment, "cart", "eye")
        assert codec is not None
        drawn = codec.decode(codec.encode(sight)).image()
        assert np.array_equal(drawn, sight.image())
        return drawn


def test_a_client_that_hears_a_camera_has_the_files_before_it_joins(
    yard: tuple[str, Deployment], tmp_path: Path
) -> None:
    """A third of the messages is lost, and the vHub starts again in between."""
    cache: dict[str, bytes] = {}
    radio = Radio(yard, cache, loss=0.3)
    radio.until(lambda: radio.pieces >= 3)
    assert not radio.joined
    radio.core.hub_gone(radio.now_ns)
    radio.start("hub-2")
    radio.core.hub_here(radio.now_ns)
    radio.until(lambda: radio.joined)
    files = yard[1].asset_files
    assert cache == {digest_of(content): content for content in files.values()} and SEEN in files
    assert np.ptp(radio.image()) > 0
    again = Radio(pinned(tmp_path), cache)
    again.until(lambda: again.joined)
    assert again.pieces == 0, "what is in the cache is not fetched"


@pytest.mark.parametrize("change", [{"content": bytes(100)}, {"offset": 7}, {"size": 100}])
def test_without_true_files_only_the_picture_is_missing(yard: tuple[str, Deployment], change: dict[str, Any]) -> None:
    cache: dict[str, bytes] = {}
    radio = Radio(yard, cache)
    radio.change = lambda piece: replace(piece, **change)
    radio.until(lambda: radio.joined)
    assert not cache
    with pytest.raises(AssetError, match="camera eye of cart cannot be drawn here without the files of the world"):
        radio.image()


def test_a_client_that_hears_no_camera_fetches_nothing(yard: tuple[str, Deployment]) -> None:
    radio = Radio(yard, {}, channel="echo")
    radio.until(lambda: radio.joined)
    assert radio.pieces == 0 and not radio.core.refusal


def test_what_a_client_may_fetch_is_bounded_and_digests_are_known(
    yard: tuple[str, Deployment], monkeypatch: pytest.MonkeyPatch
) -> None:
    radio = Radio(yard, {})
    monkeypatch.setattr(limits, "ASSETS_BYTES_MAX", 150)
    monkeypatch.setattr(limits, "FETCHED_BYTES_PER_S", 1000)

    def fetched(digest: bytes) -> list[Publish]:
        payload = encode(Fetch("ear", "boot", digest, 0))
        radio.hub.receive(channels.CLIENT_FETCH, "ear", payload, radio.now_ns)
        return list(published(radio.hub))

    known = bytes.fromhex(digest_of(CART.encode()))
    assert [len(fetched(digest)) for digest in (bytes(32), known, known, known, known)] == [0, 1, 1, 0, 0]
    radio.now_ns += 100 * MS
    assert [len(fetched(known)) for _ in range(2)] == [1, 0], "100 bytes later"


def test_nodes_get_what_is_only_drawn_for_the_view_of_cameras_alone(tmp_path: Path) -> None:
    def fetched(sensors: str) -> set[str]:
        text, deployment = pinned(tmp_path, sensors)
        actions: list[Action] = []
        member = Member("node", "n1", "boot", bytes(32), "", actions, 0)
        member.take_build(Build("n1", "boot", "super", "run", NAME, text, "fast"))
        while member.build is None:
            member.wake(0, lambda: Heartbeat("n1", 0, 0, "", "", 0.0, b"{}"))
            for action in [*actions]:
                if isinstance(action, Publish) and action.channel is channels.FETCH:
                    member.take_build(piece_of(deployment, decode(Fetch, action.payload)))
            actions.clear()
        assert member.deployment is not None
        return {*member.deployment.asset_files}

    assert fetched("") == {"cart.urdf"} and fetched(EYE) == {"cart.urdf", SEEN}


def test_the_cache_drops_damaged_files_and_the_longest_unused(tmp_path: Path) -> None:
    contents = [bytes([number]) * 100 for number in range(4)]
    names = [digest_of(content) for content in contents]
    cache = FileCache(tmp_path / "cache", 300)
    for age, (name, content) in enumerate(zip(names[:3], contents, strict=False)):
        cache[name] = content
        os.utime(tmp_path / "cache" / name, ns=(age, age))
    assert cache[names[0]] == contents[0], "used again"
    cache[names[3]] = contents[3]
    assert sorted(cache) == sorted([names[0], names[2], names[3]])
    (tmp_path / "cache" / names[2]).write_bytes(b"x" * 100)
    assert names[2] not in cache and len(cache) == 2
    (tmp_path / "file").touch()
    nowhere = FileCache(tmp_path / "file")
    nowhere[names[0]] = contents[0]
    assert names[0] not in nowhere
