"""Pictures of captures as files: what other programs read back is what the readings draw."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
import pytest
from matplotlib.image import imread
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from foosim.capture.pictures import export_pictures
from foosim.capture.reader import CaptureData, open_capture
from foosim.common.errors import BadValue, Failed
from foosim.deployment.channel_kinds import channel_codec
from foosim.rendering.cameras import Camera
from foosim.simulation.run import rehearse
from foosim.simulation.verify import simulated_again
from foosim.world.layout import build_layout
from tests.deployed import TABLE, TEXT
from tests.looking import LOOKERS

LENS: Final = "width: 64, height: 36, at: {x: 30 cm, z: 1.2 m}, look_at: {entity: ball}"
EYES: Final = [
    f"robots.camera.sensors.{name}={{kind: rgbd, rate: {rate}, {LENS}}}"
    for name, rate in (("eye", "50 Hz"), ("unheard", "50 Hz"), ("between", "60 Hz"))
]
ALL: Final = (0, None)


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> CaptureData:
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    found = rehearse(TEXT, TABLE.name, 60, 1, (*EYES, LOOKERS), capture=path)
    assert not found.json["failed"], found.json["reason"]
    return open_capture(path)


def drawn(capture: CaptureData) -> dict[int, tuple[object, object]]:
    codec = channel_codec(capture.deployment, "camera", "eye")
    assert codec is not None
    sights = map(codec.decode, capture.packets.where(capture.packets.channel == "eye").payload)
    return {int(sight.tick): (sight.image(), sight.depth()) for sight in sights}


def test_png_files_and_mcap_have_the_pictures_of_packets(capture: CaptureData, tmp_path: Path) -> None:
    known = drawn(capture)
    count = export_pictures(capture.path, tmp_path / "png", "png", ["camera/eye"], ALL, simulated_again)
    assert count == 2 * len(known) == len([*(tmp_path / "png").iterdir()])
    for tick, (image, depth) in known.items():
        name = f"{tick:09d}.png"
        assert np.array_equal(imread(tmp_path / "png" / f"camera.eye.image.{name}") * 255.0, np.array(image))
        grey = imread(tmp_path / "png" / f"camera.eye.depth.{name}") * 65535.0
        assert np.abs(grey / 1000.0 - np.array(depth)).max() < 0.00051
    assert export_pictures(capture.path, tmp_path / "a.mcap", "mcap", ["*/eye"], ALL, simulated_again) == count
    read = {}
    with (tmp_path / "a.mcap").open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, channel, message, content in reader.iter_decoded_messages():
            read[channel.topic, message.log_time // capture.deployment.tick_ns] = content
    for tick, (image, depth) in known.items():
        colour, distances = read["/camera/eye/image", tick], read["/camera/eye/depth", tick]
        assert (colour.encoding, colour.step) == ("rgb8", 192) and colour.data == np.array(image).tobytes()
        assert distances.encoding == "32FC1" and distances.data == np.array(depth).tobytes()
        lens, pose = read["/camera/eye/calibration", tick], read["/tf", tick].transforms[0]
        assert lens.frame_id == pose.child_frame_id == colour.frame_id == "camera/eye" and lens.K[0] == lens.K[4]


def test_cameras_without_packets_are_drawn_from_frames(capture: CaptureData, tmp_path: Path) -> None:
    """One at ticks of captured frames, one between them, which are computed again."""
    deployment, layout = capture.deployment, build_layout(capture.deployment)
    frames = {frame.tick: frame for frame in simulated_again(capture)}
    for channel in ("unheard", "between"):
        camera = Camera(deployment, layout, "camera", channel)
        due = [tick for tick in frames if camera.is_due(tick)]
        out = tmp_path / channel
        assert export_pictures(capture.path, out, "png", [f"camera/{channel}"], ALL, simulated_again) == 2 * len(due)
        for tick in due:
            sight = camera.at(tick, frames[tick].numbers)
            assert sight is not None
            assert np.array_equal(imread(out / f"camera.{channel}.image.{tick:09d}.png") * 255.0, sight.image())
    heard = Camera(deployment, layout, "camera", "eye")
    for tick, (image, _) in drawn(capture).items():
        sight = heard.at(tick, frames[tick].numbers)
        assert sight is not None and np.array_equal(sight.image(), np.array(image)), "as the packet of the tick"


def test_what_cannot_be_exported_is_refused(
    capture: CaptureData, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    for form, cameras, problem in (
        ("gif", ["*"], "not one of png, mcap, video"),
        ("png", ["camera/nose"], "no such camera, there are camera/between, camera/eye, camera/unheard"),
        ("video", ["*"], "a video is of one camera"),
    ):
        with pytest.raises(BadValue, match=problem):
            export_pictures(capture.path, tmp_path / "out.mp4", form, cameras, ALL, simulated_again)
    for camera in ("camera/eye", "overview"):
        with pytest.raises(Failed, match="a video needs ffmpeg: no such program"):
            export_pictures(capture.path, tmp_path / "out.mp4", "video", [camera], ALL, simulated_again)
    (tmp_path / "ffmpeg").write_text('#!/bin/sh\nfor last; do :; done\n/bin/cat > "$last"\n')
    (tmp_path / "ffmpeg").chmod(0o755)
    count = export_pictures(capture.path, tmp_path / "v.mp4", "video", ["camera/eye"], ALL, simulated_again)
    assert (tmp_path / "v.mp4").stat().st_size == count * 64 * 36 * 3
