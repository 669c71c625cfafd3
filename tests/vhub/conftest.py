"""A vHub driven by hand, for tests of its journal and its capture: synthetic commits, samples and clients' packets.

The core is the real one; the world is made up by hashing, so that every number is exact and every byte value occurs.
What happens in a run: two lockstep players, a free-running client that comes, goes and comes back, repeats, packets
to nobody, bytes that are no message, a robot that is down for a while, a ball that is added and removed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from hashlib import shake_128
from pathlib import Path

import numpy as np
import pytest

from foosim.capture import contents as capture_contents
from foosim.capture import writer as capture_writer
from foosim.common import limits
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.actions import Journal, Publish
from foosim.protocol.codec import decode, decode_any, encode
from foosim.protocol.messages import (
    Build,
    ClientHello,
    Commit,
    Deliveries,
    Done,
    Down,
    End,
    Epoch,
    Go,
    Heard,
    Join,
    Recovered,
    Samples,
    Sent,
    Subscription,
    Up,
)
from foosim.vhub.core import HubCore
from foosim.vhub.recording.recorder import Recorder
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.records import Closing, HubRecord, TickRecord
from foosim.world.assembly.world import initial_numbers
from foosim.world.edits import Add, Edit, Push, Remove, write
from foosim.world.frame import Frame
from foosim.world.layout import Layout, build_layout
from foosim.world.robot_packets import RobotPacket
from tests.turns import BY_PERIOD

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
NAME = "table.yaml"
WATCHER = "watcher"
ADDED_AT, PUSHED_AT, REMOVED_AT = 25, 30, 45
DOWN_FROM, DOWN_TO = 20, 40
GONE_AT, BACK_AT = 35, 50
EPOCH_AT = 28
RECOVERED = {
    29: [Recovered("node", "n1", "its connection closed", 28, 2, 3_100_000)],
    41: [Recovered("join", "n1", "back", 40, 2, 0), Recovered("vhub", "vhub", "no heartbeat for 1 s", 38, 1, 2**62)],
}
"""What the commits of these frames tell of."""
SETS = (
    *BY_PERIOD,
    "table.spare_balls=1",
    "clients={watcher: {lockstep: false}}",
    "network.links=[{id: slow, from: watcher, to: '*', delay: 7 ms},"
    " {id: steady, from: '*', to: red.goal, delay: 1 ms, jitter: {shape: gamma, sd: 1 ms}},"
    " {id: wild, from: '*', to: '*', delay: 1 ms, jitter: {shape: gamma, sd: 3 ms}, loss: 20 %, order: free}]",
    "capture.frames_every='10 ticks'",
)


def noise(size: int, *key: object) -> bytes:
    """Bytes that depend on the key alone."""
    return shake_128(repr(key).encode()).digest(size)


def spare_ball(layout: Layout) -> Add:
    """The edit that adds the spare ball."""
    ball = layout["ball-2"]
    numbers = [0.0] * (ball.stop - ball.start)
    for name, values in (
        ("position", (0.1, -0.0, 1e-9)),
        ("orientation", (0, 0, 0, 1)),
        ("linear_velocity", (0, 1, -2.5)),
    ):
        at = ball.offsets[name] - ball.start
        numbers[at : at + len(values)] = map(float, values)
    return Add(ball.name, numbers)


@dataclass
class HubRun:
    """What a driven hub gave: its first head and a record for each tick, the closings, the state's bytes after each
    record; and the whole journal, in which there is more."""

    text: str
    deployment: Deployment
    core: HubCore
    records: list[bytes] = field(default_factory=list)
    journal: list[bytes] = field(default_factory=list)
    snapshots: list[bytes] = field(default_factory=list)
    closings: list[Closing] = field(default_factory=list)
    epochs: list[Epoch] = field(default_factory=list)
    deliveries: dict[int, list[bytes]] = field(default_factory=dict)
    downs: list[tuple[str, Go | Down]] = field(default_factory=list)
    head: bytes = b""
    """The head that a new journal file would have at the end."""

    @property
    def state(self) -> HubState:
        """The state of the hub that began."""
        assert self.core.state is not None
        return self.core.state


class Driver:
    """Plays supervisor, nodes and clients to one hub."""

    def __init__(self, sets: Sequence[str] = SETS) -> None:
        text = apply_sets(TABLE.read_text(), NAME, sets)
        self.deployment = load_deployment(text, NAME)
        self.layout = build_layout(self.deployment)
        self.core = HubCore("boot", bytes(32), 0)
        self.run = HubRun(text, self.deployment, self.core)
        self.sent = dict.fromkeys((*self.deployment.players, WATCHER), 0)
        self.answers = True
        """Whether players answer Go."""
        self.tick = -1
        self._now_ns = 0

    def say(self, channel: channels.Channel, name: str, payload: bytes) -> None:
        self._now_ns = (self.tick + 1) * self.deployment.tick_ns
        self.core.receive(channel, name, payload, self._now_ns)
        self.core.advance(self._now_ns)
        self._perform()

    def _perform(self) -> None:
        actions = [*self.core.actions]
        self.core.actions.clear()
        for action in actions:
            if isinstance(action, Journal):
                self.run.journal.append(action.record)
                if not self.run.records or isinstance(decode_any(HubRecord, action.record), TickRecord):
                    self.run.records.append(action.record)
            elif isinstance(action, Closing):
                self.run.closings.append(action)
            elif isinstance(action, Epoch):
                self.run.epochs.append(action)
            elif isinstance(action, Publish) and action.channel is channels.DELIVERIES:
                deliveries = decode(Deliveries, action.payload)
                self.run.deliveries.setdefault(deliveries.tick, []).append(action.payload)
            elif isinstance(action, Publish) and action.channel is channels.DOWN:
                message = decode_any(Go | Down | Heard, action.payload)
                if isinstance(message, Heard):
                    continue
                self.run.downs.append((action.name, message))
                if isinstance(message, Go) and self.answers:
                    self._done(action.name, message.tick)

    def start(self) -> None:
        build = Build("vhub", "boot", "first", "run-1", NAME, self.run.text, "fast")
        self.say(channels.BUILD, "vhub", encode(build))
        self.core.begin(None, self._now_ns)
        self._perform()
        for name, player in self.deployment.players.items():
            wanted = [Subscription(robot, heard) for robot, names in player.robots.items() for heard in names]
            self.join(name, self.deployment.ticks(player.rate_hz), wanted)
        self.begin_epoch(1, "n1", b"")

    def begin_epoch(self, epoch: int, node: str, arithmetic: bytes) -> None:
        """Begin an epoch at the tick that was closed last, in which one of two nodes owns everything; say it twice."""
        owners = [(robot, node) for robot in self.deployment.robots]
        message = Epoch(epoch, max(0, self.tick), bytes([epoch]) * 32, ["n1", "n2"], owners, arithmetic)
        for _ in range(2):
            self.say(channels.EPOCH, channels.SUPERVISOR, encode(message))

    def join(self, name: str, period: int, wanted: list[Subscription], boot: str = "one") -> None:
        hello = ClientHello(name, boot, limits.PROTOCOL_VERSION, "", 0)
        self.say(channels.CLIENT_HELLO, name, encode(hello))
        self.say(channels.UP, name, encode(Join(name, boot, period, wanted)))

    def close(self, last: bool = False) -> None:
        """Bring the hub through one more tick."""
        self.tick += 1
        tick = self.tick
        self._clients_before(tick)
        if tick == EPOCH_AT:
            self.begin_epoch(2, "n2", noise(32, "arithmetic"))
        frame = self.frame(tick)
        epoch = len(self.run.epochs)
        content = frame.digest, frame.values.tobytes(), frame.outbox_items, self.edits(tick)
        commit = Commit(epoch, tick, *content, last, RECOVERED.get(tick, []))
        self.say(channels.COMMIT, channels.VHUB, encode(commit))
        if last:
            return
        robots = [entity.name for entity in frame.layout.robots]
        for node, names in (("n1", robots[:4]), ("n2", robots[2:])):
            packets = [packet for name in names for packet in self._samples(tick, name)]
            self.say(channels.SAMPLES, node, encode(Samples(tick, bytes(32), node, names, [])))
            self.say(channels.SAMPLES, node, encode(Samples(tick, frame.digest, node, names, packets)))
        assert self.core.state is not None
        if self.core.state.closed < tick:
            assert not self.answers
            return
        self.run.snapshots.append(self.core.state.snapshot())

    def end(self) -> HubRun:
        """Give the hub a last frame and end the run."""
        self.run.head = self.core.head()
        self.close(last=True)
        self.say(channels.END, channels.SUPERVISOR, encode(End(self.tick, "enough", False)))
        assert self.core.finished
        return self.run

    # --- the world ---------------------------------------------------------------------------------------------------

    def frame(self, tick: int) -> Frame:
        """A frame whose numbers are all different from tick to tick; `down` is the only one that means something."""
        layout = self.layout
        numbers = initial_numbers(self.deployment, layout)
        if ADDED_AT <= tick < REMOVED_AT:
            write(layout, numbers, spare_ball(layout))
        for entity in layout.of("rod"):
            at = entity.offsets["joint_positions"]
            numbers[at : at + 2] = np.frombuffer(noise(16, tick, entity.name), np.uint64).astype(float) * 2.0**-66
        numbers[layout["red.attack"].offsets["down"]] = float(DOWN_FROM <= tick < DOWN_TO)
        outboxes = {layout["red.goal"].index: noise(9, "outbox", tick)} if tick % 3 == 0 else {}
        return Frame(tick, layout, np.array(numbers), outboxes)

    def edits(self, tick: int) -> list[Edit]:
        """The edits of the order that led to frame `tick`."""
        if tick == ADDED_AT:
            return [spare_ball(self.layout)]
        if tick == PUSHED_AT:
            return [Push("ball", (0.01, 1 / 3, -0.0)), Push("ball-2", (0.0, -1e-300, 2.5))]
        return [Remove("ball-2")] if tick == REMOVED_AT else []

    def _samples(self, tick: int, robot: str) -> list[RobotPacket]:
        sensors = sorted(self.deployment.robots[robot].sensors)
        if tick % 2:
            return []
        packets = [RobotPacket(robot, i, "", name, noise(16, tick, robot)) for i, name in enumerate(sensors)]
        if robot == "red.goal":
            packets += [
                RobotPacket(robot, len(sensors), "blue.goal", "talk", noise(5, tick)),
                RobotPacket(robot, len(sensors) + 1, "nobody", "talk", b""),
            ]
        return packets

    # --- the clients -------------------------------------------------------------------------------------------------

    def packet(self, name: str, destination: str, channel: str = "position") -> Sent:
        self.sent[name] += 1
        sequence = self.sent[name]
        return Sent(sequence, destination, channel, 1_000_000 + sequence, noise(16, name, sequence))

    def _done(self, name: str, tick: int) -> None:
        robots = [robot for robot in self.deployment.players[name].robots if robot != "camera"]
        packets = [self.packet(name, robot) for robot in robots]
        packets = [*packets[::-1], packets[0], self.packet(name, "nobody"), self.packet(name, "player-red", "chat")]
        self.say(channels.UP, name, encode(Done(name, "one", tick, packets)))

    def _clients_before(self, tick: int) -> None:
        wanted = [Subscription("camera", "ball"), Subscription("red.goal", "encoder")]
        if tick == 3:
            self.join(WATCHER, 0, wanted)
        elif tick == GONE_AT:
            self.core.client_gone(WATCHER, self._now_ns)
        elif tick == BACK_AT:
            self.join(WATCHER, 0, wanted[:1], boot="two")
        boot = "two" if tick >= BACK_AT else "one"
        if tick >= 3 and not GONE_AT <= tick < BACK_AT:
            packets = [self.packet(WATCHER, robot) for robot in ("red.attack", "player-blue", "red.attack")]
            self.say(channels.UP, WATCHER, encode(Up(WATCHER, boot, [*packets, packets[0]])))
        if tick % 7 == 0:
            self.say(channels.UP, WATCHER, noise(20, "no message", tick))


def drive(ticks: int, sets: Sequence[str] = SETS) -> HubRun:
    """Drive a hub through a run of `ticks` ticks."""
    driver = Driver(sets)
    driver.start()
    for _ in range(ticks):
        driver.close()
    return driver.end()


@pytest.fixture(scope="session")
def half_closed_run() -> HubRun:
    """A run that ends by a failure while its tick 15 waits for the players."""
    driver = Driver()
    driver.start()
    for _ in range(15):
        driver.close()
    driver.answers = False
    driver.close()
    driver.say(channels.END, channels.SUPERVISOR, encode(End(15, "player-red is lost", True)))
    driver.tick += 100_000
    driver.core.wake((driver.tick + 1) * driver.deployment.tick_ns)
    driver.say(channels.END, channels.SUPERVISOR, encode(End(15, "player-red is lost", True)))
    assert driver.core.finished
    return driver.run


@pytest.fixture(scope="session")
def hub_run() -> HubRun:
    """A run of 64 ticks, with everything in it; not to be changed."""
    return drive(64)


LOG_LINES = [("info", "kick-off", 0), ("warning", "late", 3), ("error", "gone", 63)]


BY_TIME = "capture.split_time=20 ms"
"""Ten ticks, as often as a frame is captured: files begin at ticks 10, 20, ..., 60."""
METADATA = {"run": "run-1", "fingerprint": "00"}


def with_sets(run: HubRun, *sets: str) -> HubRun:
    """The run as one of a deployment with other settings of its capture."""
    text = apply_sets(run.text, NAME, sets)
    return replace(run, text=text, deployment=load_deployment(text, NAME))


def write_capture(path: Path, run: HubRun, *sets: str) -> Recorder:
    """Write a run's capture, with three lines of log."""
    run = with_sets(run, *sets)
    writer = Recorder(path, run.deployment, NAME, run.text, METADATA)
    epochs = {epoch.tick: epoch for epoch in run.epochs}
    for closing in run.closings:
        if closing.frame.tick in epochs:
            writer.keep(epochs[closing.frame.tick])
        writer.keep(closing)
    for line in LOG_LINES:
        writer.log(*line)
    writer.finish({"reason": "enough"})
    return writer


@pytest.fixture(scope="session")
def path(hub_run: HubRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run's capture."""
    return write_capture(tmp_path_factory.mktemp("captures") / "run.mcap", hub_run).path


@pytest.fixture(scope="session")
def parts(hub_run: HubRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run in seven files; not to be changed."""
    return write_capture(tmp_path_factory.mktemp("split") / "run.mcap", hub_run, BY_TIME).path


@pytest.fixture(scope="session")
def chunked(hub_run: HubRun, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The same in a file of many small chunks."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(capture_writer, "BATCH_ROWS", 40)
        patch.setattr(capture_contents, "CHUNK_BYTES", 1)
        return write_capture(tmp_path_factory.mktemp("captures") / "chunked.mcap", hub_run).path.read_bytes()
