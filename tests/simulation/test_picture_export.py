"""Pictures of captures as files: what other programs read back is what the readings draw."""

from __future__ import annotations

import asyncio
from base64 import b64encode
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import msgspec
import numpy as np
import pytest
from matplotlib.image import imread
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from foosim.capture.pictures import export_pictures
from foosim.capture.reader import CaptureData, open_capture
from foosim.capture.rows import PACKETS
from foosim.common.errors import BadValue, Failed
from foosim.console.recorded.capture_source import FileSource
from foosim.deployment.channel_kinds import channel_codec
from foosim.rendering.cameras import Camera
from foosim.rendering.png import encode_png
from foosim.simulation.run import rehearse
from foosim.simulation.verify import simulated_again
from foosim.world.frame import Frame
from foosim.world.layout import build_layout
from tests.console.memory import running
from tests.deployed import TABLE, TEXT
from tests.looking import LOOKERS
from tests.simulation.conftest import messages_of, replay, rewritten, with_row

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


def test_the_console_shows_the_picture_of_the_packet_else_that_of_the_frame(
    capture: CaptureData, tmp_path: Path
) -> None:
    """The first packet has another reading than its frame: the last one."""
    sent, known = capture.packets.where(capture.packets.channel == "eye"), drawn(capture)
    first = min(known)
    rows = [
        with_row(message, payload=b64encode(sent.payload[-1]).decode())
        if message.topic == PACKETS
        and b'"eye"' in message.data
        and message.log_ns == first * capture.deployment.tick_ns
        else message
        for message in messages_of(capture.path)
    ]
    source = FileSource(rewritten(capture.path, tmp_path / "changed.mcap", rows))

    async def look() -> tuple[bytes, bytes]:
        async with running(source) as heard:
            await source.request("seek", {"tick": first}, "me")
            await heard.until(lambda: heard.tick == first and bool(heard.of("links")))
            eyes = source.eyes()
            assert eyes is not None and eyes[0] == first
            return eyes[1]("camera", "eye", "image"), eyes[1]("camera", "unheard", "image")

    of_packet, of_frame = asyncio.run(look())
    assert of_packet == encode_png(np.array(known[max(known)][0])) != of_frame
    assert of_frame == encode_png(np.array(known[first][0]))


def test_commands_export_pictures(capture: CaptureData, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    known = drawn(capture)
    first, *_, last = sorted(known)
    span = "--from", f"{first * 2 + 1} ms", "--to", f"{last * 2} ms"
    eye = "--camera", "camera/eye"
    done = replay("export", capture.path, "--images", "png", *eye, *span, "-o", tmp_path / "png")
    assert (done.code, done.out) == (0, f"{tmp_path / 'png'}: {2 * len(known) - 2} pictures\n")
    ticks = {int(path.name.split(".")[3]) for path in (tmp_path / "png").iterdir()}
    assert ticks == known.keys() - {first}
    done = replay("export", capture.path, "--images", "mcap", *eye, "--json", "-o", tmp_path / "a.mcap")
    assert msgspec.json.decode(done.out) == {"path": str(tmp_path / "a.mcap"), "pictures": 2 * len(known)}
    monkeypatch.setenv("PATH", str(tmp_path))
    for words, problem in (
        (("--video", *eye), "a video needs ffmpeg: no such program on PATH; --images png needs none"),
        (("--images", "png", "--camera", "camera/nose"), "--camera: no such camera, there are camera/between"),
        (("--images", "png", "--video"), "--images and --video are two exports"),
        (eye, "--camera, --from and --to are of --images and --video"),
    ):
        done = replay("export", capture.path, *words, "-o", tmp_path / "none")
        assert done.code == 2 - problem.startswith("a video") and problem in done.err, done
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mcap", "png"]


def first_frame(capture: CaptureData) -> Iterator[Frame]:
    yield next(simulated_again(capture))
    raise Failed("no second frame")


def test_what_cannot_be_exported_is_refused(
    capture: CaptureData, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    for form, cameras, problem in (
        ("png", ["camera/nose"], "no such camera, there are camera/between, camera/eye, camera/unheard"),
        ("video", ["*"], "a video is of one camera"),
    ):
        with pytest.raises(BadValue, match=problem):
            export_pictures(capture.path, tmp_path / "out.mp4", form, cameras, ALL, simulated_again)
    for form, camera in (("png", "*/eye"), ("mcap", "*/unheard"), ("video", "overview")):
        with pytest.raises(BadValue, match="no camera has a picture in this span; the capture has 0 s to 120 ms, '1 s"):
            export_pictures(capture.path, tmp_path / "out", form, [camera], (10**9, None), simulated_again)
    with pytest.raises(Failed, match="no second frame"):
        export_pictures(capture.path, tmp_path / "out", "png", ["*/between"], ALL, first_frame)
    assert [*tmp_path.iterdir()] == []
    for camera in ("camera/eye", "overview"):
        with pytest.raises(Failed, match="a video needs ffmpeg: no such program"):
            export_pictures(capture.path, tmp_path / "out.mp4", "video", [camera], ALL, simulated_again)
    (tmp_path / "ffmpeg").write_text('#!/bin/sh\nfor last; do :; done\n/bin/cat > "$last"\n')
    (tmp_path / "ffmpeg").chmod(0o755)
    count = export_pictures(capture.path, tmp_path / "v.mp4", "video", ["camera/eye"], ALL, simulated_again)
    assert (tmp_path / "v.mp4").stat().st_size == count * 64 * 36 * 3
    (tmp_path / "ffmpeg").write_text("#!/bin/sh\nexit 3\n")
    with pytest.raises(Failed, match=r"bad\.mp4: ffmpeg ended with exit code 3"):
        export_pictures(capture.path, tmp_path / "bad.mp4", "video", ["overview"], ALL, simulated_again)
