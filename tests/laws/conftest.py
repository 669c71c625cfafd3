"""A rehearsal into which somebody speaks who takes no part in it: for law 7."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

import msgspec
import pytest
from msgspec import inspect

from foosim.client.core import ClientCore
from foosim.common import limits
from foosim.common.units import Pace
from foosim.protocol import channels
from foosim.protocol.channels import SUPERVISOR, VHUB, Channel, Plane
from foosim.protocol.codec import encode
from foosim.simulation.run import Rehearsed, rehearse, with_nodes
from foosim.simulation.settings import Traced
from foosim.simulation.system import Settings, System
from foosim.supervisor.settings import RunSettings
from foosim.world.frame import Frame
from tests.deployed import TABLE, TEXT

NODES: Final = ("n1", "n2")
PLAYERS: Final = ("player-blue", "player-red")
TICKS: Final = 100
SETS: Final = ("engine=pure", "table.rules.kickoff_delay=20 ms", "deadlines.start=5 s")
NOBODY: Final = "nobody"
READS: Final[Mapping[str, tuple[tuple[Channel, bool], ...]]] = {
    **dict.fromkeys(NODES, channels.NODE_READS),
    VHUB: channels.VHUB_READS,
    SUPERVISOR: channels.SUPERVISOR_READS,
    **dict.fromkeys(PLAYERS, channels.CLIENT_READS),
}
"""Who takes part, and what each reads."""


_NAN: Final = float("nan")
_INFINITE: Final = float("inf")
NAMES: Final = (
    *("n1", "n2", *PLAYERS, VHUB, SUPERVISOR, "ball", "b2", "red.goal", "camera", "boot", "part", "commit", "order"),
    *("position", "echo", "encoder", "fast", "2x", "node", "push", "x" * limits.NAME_LENGTH_MAX, ""),
)


class Talk:
    """Well-formed messages made from the schema, with values near to what could matter."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)
        self._tick = 0
        self._makers: dict[type[inspect.Type], Callable[[Any], Any]] = {
            inspect.IntType: self._number,
            inspect.FloatType: lambda kind: self.rng.choice((0.0, -1.0, 1e308, _NAN, _INFINITE)),
            inspect.BoolType: lambda kind: self.rng.random() < 0.5,
            inspect.NoneType: lambda kind: None,
            inspect.StrType: lambda kind: self.rng.choice(
                [name for name in NAMES if len(name) >= (kind.min_length or 0)]
            ),
            inspect.BytesType: self._bytes,
            inspect.ListType: lambda kind: [
                self._value(kind.item_type) for _ in range(self.rng.choice((0, 0, 1, 2, 9)))
            ],
            inspect.TupleType: lambda kind: tuple(map(self._value, kind.item_types)),
            inspect.UnionType: lambda kind: self._value(self.rng.choice(kind.types)),
            inspect.StructType: lambda kind: kind.cls(**{f.name: self._value(f.type) for f in kind.fields}),
        }

    def about(self, channel: Channel, tick: int) -> Any:
        """A message for this channel, while the run is at `tick`."""
        self._tick = tick
        return self._value(inspect.type_info(channel.message))

    def _value(self, kind: inspect.Type) -> Any:
        return self._makers[type(kind)](kind)

    def _number(self, kind: inspect.IntType) -> int:
        tick = self._tick
        high = kind.le if kind.le is not None else (kind.lt or 1) - 1
        number = self.rng.choice((0, 1, 2, 5, tick - 1, tick, tick + 1, tick + 5, 2**40, limits.COUNTER_MAX))
        return min(max(kind.ge or 0, number), high)

    def _bytes(self, kind: inspect.BytesType) -> bytes:
        least = kind.min_length or 0
        size = max(least, min(self.rng.choice((0, 8, 16, 32, 1592)), kind.max_length or 0))
        return self.rng.choice((bytes(size), self.rng.randbytes(size), b"{}" if least <= 2 else bytes(size)))


def mutated(rng: random.Random, raw: bytes) -> bytes:
    """A message with some bytes flipped, put in or taken out; or cut, or with a tail."""
    content = bytearray(raw)
    for _ in range(rng.choice((1, 1, 2, 5))):
        at = rng.randrange(len(content) + 1)
        kind = rng.randrange(6)
        if kind < 2 and at < len(content):
            content[at] ^= 1 << rng.randrange(8)
        elif kind == 2:
            content[at : at + rng.randrange(4)] = b""
        elif kind == 3:
            content[at:at] = rng.randbytes(rng.randrange(1, 4))
        elif kind == 4:
            del content[at:]
        else:
            content += rng.randbytes(rng.randrange(1, 9))
    return bytes(content)


class Disturbed:
    """A rehearsal of 100 ticks on two nodes. `put` says something on a key; `go` runs, `system` is the whole."""

    text, name, ticks, sets = TEXT, TABLE.name, TICKS, SETS
    talk, mutated = Talk, staticmethod(mutated)

    def __init__(self) -> None:
        self.settings = Settings()
        self.frames: list[Frame] = []
        self.settings.on_commit = self.frames.append
        self._system: System | None = None
        self._plans: list[tuple[int, Callable[[], None]]] = []

    @property
    def system(self) -> System:
        assert self._system is not None, "before the run"
        return self._system

    def at(self, tick: int, action: Callable[[], None]) -> None:
        """Do something when frame `tick` is committed; 0 is before anything else."""
        self._plans.append((tick, action))

    def put(self, channel: Channel, name: str, message: msgspec.Struct | bytes) -> None:
        payload = message if isinstance(message, bytes) else encode(message)
        self.system.bus.put(NOBODY, channel, name, payload, self.system.bus.now_ns)

    def go(self) -> Rehearsed:
        def prepare(system: System) -> None:
            self._system = system
            for tick, action in self._plans:
                if tick:
                    system.at_tick(tick, action)
                else:
                    action()

        return rehearse(TEXT, TABLE.name, TICKS, len(NODES), SETS, self.settings, prepare=prepare)

    def counts(self, *fields: str) -> dict[str, int]:
        """The sum of these counts of every process, as far as it has them."""
        cores: dict[str, Any] = {name: process.core for name, process in self.system.processes.items()}
        numbers = {name: self.counted(core) for name, core in {**cores, VHUB: self.system.hub}.items()}
        return {name: sum(getattr(number, field, 0) for field in fields) for name, number in numbers.items()}

    @staticmethod
    def counted(core: Any) -> Any:
        """What has the counts of a core as attributes."""
        return core.statistics() if isinstance(core, ClientCore) else core

    def malformed(self) -> dict[str, int]:
        """How many messages each process refused; the vHub and clients call it so, the others `refused`."""
        refused, malformed = self.counts("refused"), self.counts("malformed")
        return {name: malformed[name] or refused[name] for name in refused}

    @staticmethod
    def undisturbed() -> tuple[Rehearsed, dict[str, list[bytes]]]:
        """The run that nobody disturbs, and what was published in it by plane and channel."""
        return _undisturbed()

    @staticmethod
    def hearers(channel: Channel, name: str) -> list[str]:
        """Who reads what is said on a channel's key of `name`."""
        return [who for who, read in READS.items() if {(channel, False), (channel, who == name)} & {*read}]

    @staticmethod
    def assert_untouched(result: Rehearsed) -> None:
        """The run was done, its frames and its packets are those of the undisturbed one."""
        usual, _ = _undisturbed()
        assert result.json["reason"] == "done" and len(result.digests) == TICKS
        assert result.digests == usual.digests
        accounts = [dict(one.json["packets"], refused=None) for one in (result, usual)]
        assert accounts[0] == accounts[1], "no packet was lost or came twice"


@cache
def _undisturbed() -> tuple[Rehearsed, dict[str, list[bytes]]]:
    disturbed = Disturbed()
    said: dict[str, list[bytes]] = {}

    def watch(traced: Traced) -> None:
        if traced.what == "publish":
            is_radio = traced.process in PLAYERS or traced.channel in (channels.DOWN.name, channels.CLIENT_WELCOME.name)
            plane = Plane.RADIO if is_radio else Plane.SIMULATION
            said.setdefault(plane.name + traced.channel, []).append(traced.payload)

    disturbed.settings.observer = watch
    return disturbed.go(), said


@pytest.fixture
def disturbed() -> Disturbed:
    """A rehearsal that is not run yet."""
    return Disturbed()


# --- fuzz ------------------------------------------------------------------------------------------------------------

BLOCK: Final = 2_000
"""Payloads that share a start: a failing one is repeated with those before it in its block."""
MEMORY_MAX: Final = 64 << 20
"""How much memory all blocks but the first may add, in bytes."""


class Fuzz:
    """Brings payloads made by seed to something, in blocks; a failure says the bytes and how to repeat it."""

    def __init__(self, request: pytest.FixtureRequest) -> None:
        option = request.config.getoption
        self.payloads: int = option("--fuzz-payloads")
        self.seed: int = option("--fuzz-seed")
        self._only: int = option("--fuzz-block")
        self._name: str = request.node.name

    def run(self, bring: Callable[[random.Random, int], Iterator[bytes]], share: float = 1.0) -> None:
        """Let `bring(rng, count)` yield each of `count` payloads, then bring it; `share` is of those asked for."""
        total = max(1, round(self.payloads * share))
        first_bytes = 0
        for block in range(-(-total // BLOCK)):
            if self._only >= 0 and block != self._only:
                continue
            payload = b""
            rng = random.Random(f"{self.seed} {self._name} {block}")
            try:
                for payload in bring(rng, min(BLOCK, total - block * BLOCK)):  # noqa: B007  # told below
                    pass
            except Exception as error:
                words = " and ".join(word for word in self._name.replace("]", "").split("[") if word)
                again = f"make fuzz N={self.payloads} SEED={self.seed} ARGS='-k \"{words}\" --fuzz-block {block}'"
                raise AssertionError(f"{type(error).__name__}: {error}\npayload: {payload.hex()}\n{again}") from error
            now_bytes = int(Path("/proc/self/statm").read_text().split()[1]) * 4096
            first_bytes = first_bytes or now_bytes
            assert now_bytes - first_bytes < MEMORY_MAX, f"{now_bytes - first_bytes} bytes more than after the first"


@pytest.fixture
def fuzz(request: pytest.FixtureRequest) -> Fuzz:
    """As many payloads as the command line says."""
    return Fuzz(request)


class Raw(bytes):
    """MessagePack bytes as they are."""


LIES: Final = tuple(Raw(bytes.fromhex(text)) for text in (
    *("ddffffffff", "dcffff", "dfffffffff", "dbffffffff", "d9ff", "c6ffffffff", "c5ffff", "9f", "8f", "bf"),  # lengths
    *("c1", "d40100", "d6ff00000000", "c70300616263", "c9ffffffff01"),  # no type, extensions, timestamps
    *("a3eda080", "a2c3ff", "a1ff"),  # half a character, no UTF-8
    *("82a16101a16102", "80", "81c0c0"),  # a key twice, maps
    *("cb7ff8000000000000", "cb7ff0000000000000", "cbfff0000000000000", "cb8000000000000000", "ca7fc00000"),
    *("cf8000000000000000", "cfffffffffffffffff", "d38000000000000000", "d3ffffffffffffffff", "cd0001"),
))  # fmt: skip
"""Values and headers that no message of ours has, or that claim to be longer than they are."""


def pack(value: Any) -> bytes:
    """Return the MessagePack bytes of plain data with raw parts."""
    if isinstance(value, Raw):
        return bytes(value)
    if isinstance(value, list | tuple):
        return b"\xdd" + len(value).to_bytes(4, "big") + b"".join(map(pack, value))
    return msgspec.msgpack.encode(value)


def swapped(rng: random.Random, value: Any) -> Any:
    """Another value for a part of a message: near to it, of another type, or of none."""
    kind = rng.randrange(8)
    if kind == 0:
        return rng.choice(LIES)
    if kind == 1:
        return Raw(b"\x91" * rng.choice((1, 3, 100, 2_000, 50_000)) + b"\xc0")
    if kind == 2 or isinstance(value, bool):
        return rng.choice((None, True, 0, -1, 1.5, "", "n1", b"", [], [[]], [0], 2**63 - 1))
    near: dict[type, Callable[[Any], tuple[Any, ...]]] = {
        int: lambda n: (*(n + way for way in (-1, 1, 2, 16, 17, 10_000)), 0, 1, 2**32, 2**63 - 1),
        float: lambda x: (0.0, -0.0, 1e308, -1e308, 5e-324, 1e9, -x),
        str: lambda text: (*NAMES, text[:-1], text + "x", "x" * 33, "\0", "\u202e", "../../x", "{" * 40),
        bytes: lambda raw: (raw[:-1], raw + b"x", raw[: len(raw) // 2], bytes(len(raw)), rng.randbytes(8)),
        list: lambda items: (items[:-1], items * 2, items[::-1], [*items, None], []),
    }
    return rng.choice(near[type(value)](value)) if type(value) in near else None


def edited(rng: random.Random, payload: bytes) -> bytes:
    """A message with one part, however deep, swapped for something else."""
    content = msgspec.msgpack.decode(payload)
    whole = [content]
    holder, key = whole, 0
    while isinstance(holder[key], list) and holder[key] and rng.random() < 0.85:
        holder, key = holder[key], rng.randrange(len(holder[key]))
    holder[key] = swapped(rng, holder[key])
    return pack(whole[0])


class Running:
    """A rehearsal at its 30th tick, and what was said on the way, for whoever wants to say more."""

    tick: Final = 30

    def __init__(self) -> None:
        self.said: dict[str, list[bytes]] = {}
        settings = RunSettings("run", TABLE.name, _running_text(), Pace("fast"))
        self.system = System(settings, Settings(observer=self._watch))
        self.system.at_tick(self.tick, self._arrive)
        try:
            self.system.run()
        except _Arrived:
            return
        raise AssertionError("it ended before")

    def core(self, name: str) -> Any:
        return self.system.processes[name].core

    def is_over(self, name: str) -> bool:
        """Whether this process has no more to do: the run has ended, or it was refused."""
        core = self.core(name)
        if name == SUPERVISOR:
            return core.state.end is not None
        return bool(core.ended or getattr(core, "refusal", "") or (name not in PLAYERS and core.member.refusal))

    def _watch(self, traced: Traced) -> None:
        if traced.what == "receive":
            key = traced.process, traced.channel
            kept = self.said.setdefault(" ".join(key), [])
            if len(kept) < 20:
                kept.append(traced.payload)

    def _arrive(self) -> None:
        raise _Arrived


@cache
def _running_text() -> str:
    return with_nodes(TEXT, TABLE.name, len(NODES), SETS)


class _Arrived(Exception):
    """It is at its tick."""


@pytest.fixture
def running() -> type[Running]:
    """Makes rehearsals that stand at a tick."""
    return Running


@pytest.fixture
def spoil() -> Callable[[random.Random, bytes], bytes]:
    """Makes a bad message from a good one."""
    return lambda rng, payload: edited(rng, payload) if rng.random() < 0.6 else mutated(rng, payload)
