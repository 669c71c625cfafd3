"""Writes the pictures of a capture's cameras: as PNG files, as an MCAP file for viewers, or as a video by ffmpeg.

A picture is drawn from its packet. A camera whose packets had no subscriber has none: it is drawn at its ticks, from
captured frames if all of these ticks have one, else from the frames of a second computation.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, suppress
from fnmatch import fnmatchcase
from itertools import chain
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from foxglove.messages import CameraCalibration, FrameTransform, FrameTransforms, RawImage, Timestamp, Vector3
from foxglove.messages import Quaternion as FoxgloveQuaternion
from numpy.typing import NDArray

from foosim.capture.foxglove import POSES, WORLD_FRAME, view_schema
from foosim.capture.mcap.writer import McapWriter
from foosim.capture.new_file import check_absent, new_file
from foosim.capture.reader import CaptureData, open_capture
from foosim.capture.rows import PACKETS, PacketRow
from foosim.common.errors import BadValue, Failed
from foosim.common.units import format_ns
from foosim.rendering.cameras import OVERVIEW, Camera, Overview, cameras_of
from foosim.rendering.png import encode_png
from foosim.rendering.view import focal_length
from foosim.world.components.sight import Sight
from foosim.world.frame import Frame
from foosim.world.layout import build_layout
from foosim.world.scene import multiply

FORMS: Final = ("png", "mcap", "video")
OPTICAL: Final = (-0.5, 0.5, -0.5, 0.5)
"""From the camera's frame, x ahead and z up, to that of its picture: x to the right, y down, z ahead."""
OVERVIEW_PIXELS: Final = (1280, 720)
DEPTH_MM_MAX: Final = 65535
CHUNK_BYTES: Final = 4 << 20
_ENCODINGS: Final = {"image": "rgb8", "depth": "32FC1", "segmentation": "mono16"}

Again = Callable[[CaptureData], Iterator[Frame]]
"""Computes the frames of a capture again, one for each tick."""


class Picture(NamedTuple):
    """A camera's reading, which draws the picture, and the tick of it."""

    camera: Camera
    tick: int
    sight: Sight


def export_pictures(
    path: Path, out: Path, form: str, cameras: Sequence[str], span_ns: tuple[int, int | None], again: Again
) -> int:
    """Write the pictures of the cameras whose ROBOT/CHANNEL fits one of these patterns, and return their count.

    `out` is a new folder (png) or file. `span_ns` are simulated times, with both ends. Raises BadValue, CaptureError,
    Existing, and Failed for a file that cannot be written or without ffmpeg.
    """
    check_absent(out)
    assert form in FORMS, form
    capture = open_capture(path)
    if form == "video" and list(cameras) == [OVERVIEW]:
        return _overview(capture, out, span_ns)
    chosen = _chosen(capture, cameras)
    found = _some(pictures_of(capture, chosen, span_ns, again), capture, span_ns)
    if form == "video":
        if len(chosen) != 1:
            raise BadValue(
                "a video is of one camera: choose it with --camera",
                ", ".join([f"{robot}/{name}" for robot, name in chosen]),
            )
        ((camera,),) = ([*chosen.values()],)
        frames = (sight.image() for _, _, sight in found)
        return _video(out, frames, camera.settings.width, camera.settings.height, float(camera.settings.rate_hz))
    return _png_files(out, found) if form == "png" else _mcap_file(out, found, capture.deployment.tick_ns)


def _chosen(capture: CaptureData, patterns: Sequence[str]) -> dict[tuple[str, str], Camera]:
    deployment, layout = capture.deployment, build_layout(capture.deployment)
    known = cameras_of(deployment)
    fitting = [key for key in known if any(fnmatchcase("/".join(key), one) for one in patterns)]
    if not fitting:
        there = ", ".join("/".join(key) for key in known) or "none"
        raise BadValue(f"--camera: no such camera, there are {there}", " ".join(patterns))
    return {key: Camera(deployment, layout, *key) for key in fitting}


def pictures_of(
    capture: CaptureData, cameras: dict[tuple[str, str], Camera], span_ns: tuple[int, int | None], again: Again
) -> Iterator[Picture]:
    """Yield the pictures of cameras: those of packets as they were sent, then those of cameras without packets."""
    first, last = _ticks(capture, span_ns)
    seen: set[tuple[str, int]] = set()
    heard: set[tuple[str, str]] = set()
    for row in capture.rows(PACKETS):
        assert isinstance(row, PacketRow)
        key = row.source, row.channel
        if key not in cameras or (row.source, row.sequence) in seen:
            continue
        heard.add(key)
        seen.add((row.source, row.sequence))
        sight = cameras[key].of(row.payload)
        if first <= sight.tick <= last:
            yield Picture(cameras[key], int(sight.tick), sight)
    silent = [camera for key, camera in cameras.items() if key not in heard]
    if not silent:
        return
    due = [tick for tick in capture.ticks.tolist() if first <= tick <= last and any(c.is_due(tick) for c in silent)]
    frames = capture.each_frame() if set(due) <= set(capture.frame_ticks.tolist()) else again(capture)
    for frame in frames:
        for camera in silent if first <= frame.tick <= last else ():
            sight_at = camera.at(frame.tick, frame.numbers) if camera.is_due(frame.tick) else None
            if sight_at is not None:
                yield Picture(camera, frame.tick, sight_at)


def _ticks(capture: CaptureData, span_ns: tuple[int, int | None]) -> tuple[int, float]:
    tick_ns = capture.deployment.tick_ns
    return -(-span_ns[0] // tick_ns), float("inf") if span_ns[1] is None else span_ns[1] // tick_ns


def _some(pictures: Iterator[Any], capture: CaptureData, span_ns: tuple[int, int | None]) -> Iterator[Any]:
    """Return the pictures. Raises BadValue where there is none."""
    for first in pictures:
        return chain([first], pictures)
    begin, end = (format_ns(int(tick) * capture.deployment.tick_ns) for tick in (capture.ticks[0], capture.ticks[-1]))
    to = "the end" if span_ns[1] is None else format_ns(span_ns[1])
    what = f"no camera has a picture in this span; the capture has {begin} to {end}"
    raise BadValue(what, f"{format_ns(span_ns[0])} to {to}")


# --- PNG -------------------------------------------------------------------------------------------------------------


def _png_files(out: Path, pictures: Iterable[Picture]) -> int:
    count = 0
    with new_file(out) as part:
        part.mkdir(parents=True)
        for camera, tick, sight in pictures:
            for kind in camera.settings.pictures:
                pixels = sight.picture(kind)
                if kind == "depth":
                    pixels = np.minimum(np.rint(pixels * np.float32(1000.0)), DEPTH_MM_MAX)
                name = f"{camera.robot}.{camera.channel}.{kind}.{tick:09d}.png"
                (part / name).write_bytes(encode_png(pixels))
                count += 1
    return count


# --- MCAP ------------------------------------------------------------------------------------------------------------


def _mcap_file(out: Path, pictures: Iterable[Picture], tick_ns: int) -> int:
    count = 0
    with new_file(out) as part, part.open("wb") as stream:
        mcap = McapWriter(lambda content: (stream.write(content), None)[1], "")
        topics: dict[str, int] = {}

        def add(topic: str, message: Any, time_ns: int) -> None:
            if topic not in topics:
                kind: Any = type(message)
                topics[topic] = mcap.add_channel(topic, "protobuf", view_schema(kind))
            mcap.add_message(topics[topic], time_ns, time_ns, 0, message.encode())

        for camera, tick, sight in pictures:
            name, time_ns = f"{camera.robot}/{camera.channel}", tick * tick_ns
            at = Timestamp(*divmod(time_ns, 1_000_000_000))
            add(POSES, FrameTransforms(transforms=[_optical(at, name, sight)]), time_ns)
            add(f"/{name}/calibration", _calibration(at, name, camera), time_ns)
            for kind in camera.settings.pictures:
                pixels = sight.picture(kind)
                pixels = pixels.astype("<u2") if kind == "segmentation" else pixels
                height, width = pixels.shape[:2]
                step, data = pixels.nbytes // height, pixels.tobytes()
                sizes = {"width": width, "height": height, "encoding": _ENCODINGS[kind], "step": step}
                add(f"/{name}/{kind}", RawImage(timestamp=at, frame_id=name, **sizes, data=data), time_ns)
                count += 1
            if mcap.chunk_bytes >= CHUNK_BYTES:
                mcap.end_chunk()
        mcap.end_chunk()
        mcap.finish()
    return count


def _optical(at: Timestamp, name: str, sight: Sight) -> FrameTransform:
    x, y, z, w = multiply((sight.qx, sight.qy, sight.qz, sight.qw), OPTICAL)
    return FrameTransform(
        timestamp=at,
        parent_frame_id=WORLD_FRAME,
        child_frame_id=name,
        translation=Vector3(x=sight.x, y=sight.y, z=sight.z),
        rotation=FoxgloveQuaternion(x=x, y=y, z=z, w=w),
    )


def _calibration(at: Timestamp, name: str, camera: Camera) -> CameraCalibration:
    """Return the matrices of a camera; centres of pixels have whole coordinates."""
    its = camera.settings.optics
    focal, x, y = focal_length(its.fov, its.width), (its.width - 1) / 2, (its.height - 1) / 2
    return CameraCalibration(
        timestamp=at,
        frame_id=name,
        width=its.width,
        height=its.height,
        distortion_model="plumb_bob",
        D=[*its.distortion],
        K=[focal, 0.0, x, 0.0, focal, y, 0.0, 0.0, 1.0],
        R=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        P=[focal, 0.0, x, 0.0, 0.0, focal, y, 0.0, 0.0, 0.0, 1.0, 0.0],
    )


# --- video -----------------------------------------------------------------------------------------------------------


def _overview(capture: CaptureData, out: Path, span_ns: tuple[int, int | None]) -> int:
    deployment = capture.deployment
    view = Overview(deployment, build_layout(deployment), *OVERVIEW_PIXELS)
    first, last = _ticks(capture, span_ns)
    frames = (
        view.at(frame.tick, frame.numbers).image() for frame in capture.each_frame() if first <= frame.tick <= last
    )
    rate_hz = 1e9 / (deployment.capture.frames_every * deployment.tick_ns)
    return _video(out, _some(frames, capture, span_ns), *OVERVIEW_PIXELS, rate_hz)


def _video(out: Path, frames: Iterable[NDArray[np.uint8]], width: int, height: int, rate_hz: float) -> int:
    program = shutil.which("ffmpeg")
    if program is None:
        raise Failed("a video needs ffmpeg: no such program on PATH; --images png needs none")
    given = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{rate_hz:.6f}", "-i", "-"]
    even = ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"]
    count = 0
    with ExitStack() as stack:
        part = stack.enter_context(new_file(out))
        kind = {"": "mp4", ".mkv": "matroska"}.get(out.suffix, out.suffix[1:])
        command = [program, "-loglevel", "error", "-y", *given, *even, "-f", kind, str(part)]
        process = stack.enter_context(subprocess.Popen(command, stdin=subprocess.PIPE))
        assert process.stdin is not None
        with suppress(BrokenPipeError):  # it has ended: its exit code decides
            for frame in frames:
                process.stdin.write(frame.tobytes())
                count += 1
            process.stdin.close()
        if process.wait():
            raise Failed(f"{out}: ffmpeg ended with exit code {process.returncode}")
    return count
