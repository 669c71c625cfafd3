"""Law 7 for what comes in files and in texts: deployments, journals, captures, run files, meshes, requests, commands.

Each format is spoiled by the thousand, in `make fuzz` by the hundred thousand; a capture is also cut at every byte.
Whatever is read is read whole, and all else is refused by the typed error of its reader.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from pathlib import Path
from struct import pack
from typing import TYPE_CHECKING, Any, Final

import msgspec
import pytest

from foosim.capture.info import capture_info
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import open_capture
from foosim.common.errors import DeploymentError, Malformed, Refused
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.codec import decode, encode
from foosim.protocol.messages import Answer, Request
from foosim.runtime.journal import Journal, Records
from foosim.runtime.run_folder import RunFolder, RunInfo
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from foosim.vhub.state.records import Fold
from foosim.world.bodies.visual_meshes import drawn_content, drawn_parts
from foosim.world.matter.mesh import AssetError
from foosim.world.mesh_files import read_mesh
from foosim.world.robot_packets import Delivered

if TYPE_CHECKING:
    from tests.laws.conftest import Disturbed, Fuzz, Running

SLOW: Final = 0.05
"""Share of the payloads that a target gets whose one payload costs milliseconds."""
SMALL: Final = """format: 2
world: table
seed: 3
tick: 2 ms
substeps: 4
engine: pure
pace: fast
robots:
  camera: {model: camera, sensors: {ball: {kind: ball, rate: 100 Hz, modifiers: [{kind: gaussian_noise, std: 0.5 mm}]}}}
nodes: {red: {robots: [camera]}}
players: {p: {class: "a:B", rate: 100 Hz, robots: {camera: [ball]}, parameters: {x: [1, {y: null}]}}}
network: {links: [{id: all, from: "*", to: "*", delay: 2 ms, jitter: {shape: gamma, sd: 1 ms}, loss: 0.5 %}]}
scenery:
  crate: {shape: mesh, file: a/b.obj, scale: 0.5, x: 1 cm, yaw: 30 deg, surface: walls, material: {red: 1}}
"""
TOKENS: Final = (
    *(
        "&a ",
        "*a",
        "<<: ",
        "!!str ",
        "!!python/object:os.system ",
        "[" * 40,
        "{a: " * 40,
        "- " * 40,
        "? ",
        "---\n",
        "|\n",
    ),
    *("\x00", "\ufeff", "\u2028", '"\\ud800"', "1e999", ".nan", "-.inf", "0x" + "f" * 50, "9" * 50, "12:30:45", "on"),
    *("2 ms", "-1 ms", "1e300 s", "../..", "file:///x", "\t", ": ", "\n  ", "#", "'", '"', "%YAML 9.9\n", "world: x\n"),
)
COLLADA: Final = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.1"/><up_axis>Y_UP</up_axis></asset><library_geometries><geometry id="g"><mesh>
<source id="s"><float_array id="f" count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array><technique_common>
<accessor source="#f" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
<polylist count="2"><input semantic="VERTEX" source="#v" offset="0"/><vcount>3 4</vcount><p>0 1 2 3 2 1 0</p></polylist>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 3</p></triangles>
</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="w"><node id="n"><matrix>1 0 0 0
0 2 0 0 0 0 1 5 0 0 0 1</matrix><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#w"/></scene></COLLADA>
"""
REFUSED: Final = (Refused, DeploymentError, AssetError, CaptureError, Malformed)
Spoil = Callable[[random.Random, bytes], bytes]


def spoiled_text(rng: random.Random, text: str) -> str:
    """A text with tokens put in, lines moved, words taken out."""
    for _ in range(rng.choice((1, 1, 2, 4))):
        at, length = rng.randrange(len(text) + 1), rng.randrange(1, 30)
        kind = rng.randrange(5)
        if kind == 0:
            text = text[:at] + text[at + length :]
        elif kind == 1:
            text = text[:at] + text[at : at + length] + text[at:]
        elif kind == 2:
            lines = text.splitlines(keepends=True)
            rng.shuffle(lines)
            text = "".join(lines)
        else:
            text = text[:at] + rng.choice(TOKENS) + text[at + rng.choice((0, 0, length)) :]
    return text


def test_spoiled_deployments_are_refused_line_by_line(fuzz: Fuzz, disturbed: Disturbed) -> None:
    def bring(rng: random.Random, count: int) -> Iterator[bytes]:
        for _ in range(count):
            text = spoiled_text(rng, SMALL if rng.random() < 0.95 else disturbed.text)
            yield text.encode("utf-8", "surrogatepass")
            try:
                load_deployment(text, "f")
            except DeploymentError as error:
                assert all(line.isprintable() and len(line) < 400 for line in error.problems), error

    fuzz.run(bring, SLOW)


def test_spoiled_meshes_are_refused_or_are_meshes(fuzz: Fuzz, disturbed: Disturbed) -> None:
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    facet = "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    good = {
        "a.obj": f"{corners}f 1 2 3\nf -1/1 -2/1 -3/1 -4/1\n".encode(),
        "b.stl": f"solid a\n{facet}{facet}endsolid a\n".encode(),
        "c.stl": bytes(80) + b"\2\0\0\0" + bytes(range(100)),
        "d.DAE": COLLADA.encode(),
    }

    def bring(rng: random.Random, count: int) -> Iterator[bytes]:
        for _ in range(count):
            name = rng.choice(sorted(good))
            is_text = name == "d.DAE" and rng.random() < 0.5
            content = (
                spoiled_text(rng, COLLADA).encode(errors="replace") if is_text else disturbed.mutated(rng, good[name])
            )
            yield content
            try:
                mesh = read_mesh(name, content, rng.choice((1.0, 1e-6, 1e6)))
            except AssetError as error:
                assert str(error).isprintable() and str(error).startswith(name)
            else:
                assert mesh.triangles.max() < len(mesh.vertices)
            parts, remark = drawn_parts(drawn_content(name, content))
            assert parts or remark.startswith(name)

    fuzz.run(bring)


class Captured:
    """A run's capture and the vHub's journal."""

    def __init__(self, disturbed: Disturbed, folder: Path) -> None:
        self.path = folder / "run.mcap"
        self.records: list[bytes] = []
        settings = Settings(on_journal=self._keep)
        sets = (*disturbed.sets, "capture.frames_every=50 ticks")
        rehearse(disturbed.text, disturbed.name, 40, 2, sets, settings, capture=self.path)
        self.deployment: Deployment = open_capture(self.path).deployment

    def _keep(self, process: str, record: bytes) -> None:
        if process == channels.VHUB:
            self.records.append(record)


@pytest.fixture
def captured(disturbed: Disturbed, tmp_path: Path) -> Captured:
    return Captured(disturbed, tmp_path)


def test_spoiled_captures_are_refused_or_begin_like_the_true_one(
    fuzz: Fuzz, disturbed: Disturbed, captured: Captured, tmp_path: Path
) -> None:
    whole, path = captured.path.read_bytes(), tmp_path / "spoiled.mcap"
    digests = open_capture(captured.path).digests.tobytes()

    def bring(rng: random.Random, count: int) -> Iterator[bytes]:
        for _ in range(count):
            content = whole[: rng.randrange(len(whole))] if rng.random() < 0.3 else disturbed.mutated(rng, whole)
            yield content if len(content) < 100 else content[:100]
            check_capture(path, content, digests)

    fuzz.run(bring, SLOW)


def test_a_capture_cut_anywhere_is_a_beginning(fuzz: Fuzz, captured: Captured, tmp_path: Path) -> None:
    whole, path = captured.path.read_bytes(), tmp_path / "cut.mcap"
    digests = open_capture(captured.path).digests.tobytes()
    for size in range(0, len(whole), max(1, len(whole) // fuzz.payloads)):
        check_capture(path, whole[:size], digests)


def check_capture(path: Path, content: bytes, digests: bytes) -> None:
    """A capture is refused, or has the first of the true digests: a wrong one would be a wrong message."""
    path.write_bytes(content)
    try:
        found = open_capture(path)
        capture_info(path)
        assert digests.startswith(found.digests.tobytes())
        for _ in found.captured_ticks():
            pass
        assert len(found.packets) >= 0
    except CaptureError:
        return


def test_spoiled_journals_end_where_they_were_spoiled(
    fuzz: Fuzz, disturbed: Disturbed, captured: Captured, tmp_path: Path
) -> None:
    with Journal(tmp_path / "true", "vhub") as journal:
        for record in captured.records:
            journal.append(record)
    whole, path = journal.path.read_bytes(), tmp_path / "spoiled.journal"

    def bring(rng: random.Random, count: int) -> Iterator[bytes]:
        for _ in range(count):
            content = whole[: rng.randrange(len(whole))] if rng.random() < 0.3 else disturbed.mutated(rng, whole)
            yield content[:100]
            path.write_bytes(content)
            try:
                records = list(Records(path))
            except Refused:
                continue
            assert records == captured.records[: len(records)]

    fuzz.run(bring, SLOW)


def test_spoiled_records_of_a_journal_are_refused_by_the_fold(fuzz: Fuzz, captured: Captured, spoil: Spoil) -> None:
    """What passed the checksum and is still not what a run wrote: another version's, or somebody's."""

    def bring(rng: random.Random, count: int) -> Iterator[bytes]:
        for _ in range(count):
            records = captured.records[:4]
            at = rng.randrange(1, len(records))
            records[at] = spoil(rng, records[at])
            yield records[at]
            try:
                for _ in Fold(captured.deployment, records):
                    pass
            except Refused:
                continue

    fuzz.run(bring, SLOW)


def test_spoiled_run_files_are_as_if_there_were_none(fuzz: Fuzz, disturbed: Disturbed, tmp_path: Path) -> None:
    folder = RunFolder(tmp_path)
    true = RunInfo("run", "table", "/x/table.yaml", 1234, "2026-01-01T00:00:00Z", "tcp/127.0.0.1:7447")
    folder.write_info(true)
    folder.write_result({"ticks": 5, "nodes": {"n1": [1.5, None, "x"]}})
    good = {path: path.read_bytes() for path in sorted(tmp_path.iterdir()) if path.is_file()}
    assert len(good) == 2

    def bring(rng: random.Random, count: int) -> Iterator[bytes]:
        for number in range(count):
            path = rng.choice(list(good))
            deep = rng.choice((b"[", b'{"a":')) * 100_000
            content = deep if number % 100 < 2 else disturbed.mutated(rng, good[path])
            yield content[:200]
            path.write_bytes(content)
            info, result = folder.info(), folder.result()
            assert info is None or isinstance(info, RunInfo)
            assert result is None or isinstance(result, dict)

    fuzz.run(bring, 4 * SLOW)


VERBS: Final[dict[str, dict[str, Any]]] = {
    "push": {"impulse": [0.0, 0.1, 0.0], "name": "ball"},
    "add": {"name": "ball", "at": {"x": "0.1 m", "y": "0 m", "z": "50 mm"}},
    "remove": {"name": "ball-2"},
    "move": {"robot": "red.goal", "node": "n2"},
    "balance": {},
    "step": {"ticks": 5},
    "rate": {"pace": "2x"},
    "pause": {},
    "resume": {},
    "status": {},
    "stop": {"node": "n9"},
    "start": {"node": "n1"},
    "dragon": {},
}
NUMBERS: Final = (
    b"1e400",
    b"-0",
    b"NaN",
    b"9" * 400,
    b"1e308",
    b"null",
    b'"x"',
    b"[" * 2_000,
    b"{}",
    b'"\\ud800"',
    b"true",
)


def test_spoiled_requests_are_answered_or_refused(fuzz: Fuzz, disturbed: Disturbed, running: type[Running]) -> None:
    def bring(rng: random.Random, count: int) -> Iterator[bytes]:
        process = None
        for number in range(count):
            if process is None or process.core.state.end is not None or number % 500 == 0:
                process = running().system.processes[channels.SUPERVISOR]
            verb = rng.choice(sorted(VERBS))
            arguments = msgspec.json.encode(VERBS[verb])
            if rng.random() < 0.8:
                at = rng.randrange(len(arguments))
                swap = rng.choice(NUMBERS) if rng.random() < 0.5 else b""
                arguments = arguments[:at] + swap + disturbed.mutated(rng, arguments[at:])
            request = Request("operator", f"r{number}", verb, arguments[:8_000])
            yield encode(request)
            core = process.core
            before = core.refused
            core.receive(channels.REQUEST, "operator", encode(request), number)
            process.turn(number)
            said = [action for action in core.actions if getattr(action, "channel", None) is channels.ANSWER]
            answers = [decode(Answer, action.payload) for action in said]
            assert all(answer.id == request.id and (answer.accepted or answer.text) for answer in answers)
            assert answers or core.refused > before
            core.actions.clear()

    fuzz.run(bring)


def test_spoiled_commands_are_refused_by_the_robot(fuzz: Fuzz, disturbed: Disturbed, running: type[Running]) -> None:
    """The bytes of packets, as they reach an actuator, whatever a client put in."""
    system = running().system
    core = system.processes["n1"].core
    stepper, frame = core.stepper, core.frame
    rods = list(frame.layout.of("rod"))
    true = pack("<2d", 0.05, 1.0)

    def bring(rng: random.Random, count: int) -> Iterator[bytes]:
        for number in range(count):
            payload = disturbed.mutated(rng, true) if rng.random() < 0.8 else rng.randbytes(16)
            yield payload
            rod = rng.choice(rods)
            channel = rng.choice(("position", "echo", "encoder", "", "x"))
            numbers = frame.numbers
            packet = Delivered(0, "x", number, 0, rng.choice((rod.name, "camera", "nobody", "")), channel, payload)
            stepper.deliver([packet], tuple(entity.index for entity in frame.layout.entities), numbers, frame.tick)
            wanted = rod.offsets["position.set_point"]
            assert all(abs(value) < 1e6 for value in numbers[wanted : wanted + 2]), payload.hex()

    fuzz.run(bring)
