"""Runs a player: turns each Go into samples, calls `act`, and answers with the packets of its commands.

The process `foosim role player` and the rehearsal run this same loop.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from traceback import format_exception
from typing import Any, Final

from foosim.client.commands import CommandEncoder
from foosim.client.core import NEVER_NS, ClientCore
from foosim.client.errors import PacketError, PlayerError, Unanswered
from foosim.client.loading import load_player
from foosim.client.packets import check_packet
from foosim.client.player import Packet, Player, Sample, Turn, keep_metrics, metric_of
from foosim.common.errors import BadValue, Malformed, Refused, UnknownName
from foosim.deployment.channel_kinds import Channel, channels_of
from foosim.deployment.schema import Deployment
from foosim.deployment.schema import Player as Declaration
from foosim.protocol.messages import Received
from foosim.world.component_types.failures import failure_of, place_of_code

NS_PER_S: Final = 1_000_000_000


PlayerFactory = Callable[[Deployment, Mapping[str, Any]], Player]
"""Makes a player from the deployment and its own parameters: the player's class."""


class Newest:
    """Keeps the newest sample of each channel by sending time; packets may arrive out of order."""

    def __init__(self, channels: Mapping[tuple[str, str], Channel]) -> None:
        """`channels` are by (endpoint, channel); packets of others are ignored."""
        self.samples: dict[tuple[str, str], Sample] = {}
        self.malformed = 0
        """Samples that did not fit their channel."""
        self._channels = channels

    def take(self, packets: Iterable[Received]) -> None:
        """Take packets in order of arrival."""
        for packet in packets:
            pair = (packet.source, packet.channel)
            known = self.samples.get(pair)
            if pair not in self._channels or (known is not None and known.sequence >= packet.sequence):
                continue
            codec, joints = self._channels[pair]
            try:
                value = packet.payload if codec is None else codec.decode(packet.payload)
            except Malformed:
                self.malformed += 1
                continue
            self.samples[pair] = Sample(*pair, packet.sequence, packet.sent_ns, packet.due_ns, value, joints)


class Acting:
    """An instance of a declared player and its received samples: `act` is one turn of it."""

    def __init__(
        self, deployment: Deployment, name: str, load: Callable[[str], PlayerFactory] = load_player, tick: int = -1
    ) -> None:
        """`tick` is the newest tick that is known, for messages.

        Raises PlayerError for an undeclared name, and for a player that cannot be loaded or created.
        """
        if name not in deployment.players:
            raise PlayerError(UnknownName("not declared as a player", name, deployment.players).what)
        self.name = name
        self.declared: Declaration = deployment.players[name]
        self.hears = deployment.heard_by(name)
        """The (endpoint, channel) that it subscribes to."""
        self._deployment = deployment
        self._load = load
        self.metrics: dict[str, float] = {}
        """The last value of each metric that it has reported."""
        self._known: tuple[int | str, ...] = ()
        """The tick since which the player exists, and its robots that are absent, once it has acted."""
        self.player = self._make(tick)
        self._encoder = CommandEncoder(deployment)
        self.newest = Newest(channels_of(deployment, self.hears))

    def exist(self, since: int, absent: Collection[str], tick: int) -> None:
        """Be the player that exists since a tick, before it acts at another one; these of its robots are `absent`.

        It is created anew, without samples, where the one before has existed since another tick. Raises PlayerError.
        """
        wanted: tuple[int | str, ...] = (since, *absent)
        if wanted == self._known:
            return
        if self._known and self._known[0] != since:
            self.player = self._make(tick)
            self.newest.samples = {}
        self._known = wanted
        self.player.robots = tuple([name for name in sorted(self.declared.robots) if name not in absent])

    def _make(self, tick: int) -> Player:
        """Make the player that is declared."""
        factory = self._load(self.declared.class_)
        try:
            return factory(self._deployment, self.declared.parameters)
        except Refused as error:
            raise PlayerError(f"player {self.name}: {error}") from error
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            when = f"at tick {tick}" if tick >= 0 else "before its first tick"
            raise PlayerError(f"{self.name} failed {when}: {failure_of(error, _module_of(self.declared))}") from error

    def act(self, tick: int) -> list[Packet]:
        """Call the player and check its packets and commands; commands are last, in the robots' name order.

        Raises PlayerError for a player that fails, or gives an invalid command.
        """
        where = f"{self.name} failed at tick {tick}"
        try:
            turn = self.player.act(tick, self.newest.samples)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # SystemExit, too: the run cannot continue without the player
            raise PlayerError(f"{where}: {failure_of(error, _module_of(self.declared))}") from error
        if not isinstance(turn, Turn):
            turn = Turn(turn)
        elif turn.metrics:
            metrics: Mapping[Any, Any] = turn.metrics  # which players also fill without `report`
            try:
                keep_metrics(self.metrics, {name: metric_of(name, value) for name, value in metrics.items()})
            except BadValue as error:
                raise PlayerError(f"{where}: {error}{place_of_code(self.player.act)}") from error
        return [*self._packets(turn.packets, where), *self._commands(turn.commands, where)]

    def _packets(self, packets: object, where: str) -> list[Packet]:
        """Return the player's packets to others, and to its robots' channels."""
        deployment, declared = self._deployment, self.declared
        if not isinstance(packets, Sequence) or not all(isinstance(packet, Packet) for packet in packets):
            raise PlayerError(f"{where}: packets is a {type(packets).__name__}; expected a sequence of Packet")
        for packet in packets:
            to = packet.destination
            if to in deployment.robots and to not in declared.robots:
                raise PlayerError(f"{where}: {UnknownName('not one of its robots', to, declared.robots)}")
            if not isinstance(packet.payload, bytes):
                raise PlayerError(f"{where}: a payload is a {type(packet.payload).__name__}; expected bytes")
            try:
                check_packet(deployment, packet)
            except (UnknownName, PacketError) as error:
                raise PlayerError(f"{where}: {error}") from error
        return list(packets)

    def _commands(self, commands: object, where: str) -> list[Packet]:
        """Return a player's commands as packets, in the robots' name order."""
        declared, encoder = self.declared, self._encoder
        if not isinstance(commands, Mapping):
            kind = type(commands).__name__
            raise PlayerError(f"{where}: act returned a {kind}; expected a mapping from robots to commands")
        packets = []
        for robot, command in sorted(commands.items(), key=_by_name):
            if robot not in declared.robots:
                raise PlayerError(f"{where}: {UnknownName('not one of its robots', robot, declared.robots)}")
            try:
                packets += [Packet(robot, *one) for one in encoder.encode(robot, command)]
            except Refused as error:
                raise PlayerError(f"{where}: {error}{place_of_code(self.player.act)}") from error
        return packets


def report_failure(core: ClientCore, error: PlayerError | Unanswered) -> None:
    """Make a player's core report why its process ends; of the player's own error, with its traceback."""
    cause = error if isinstance(error, Unanswered) else error.__cause__
    is_own = cause is not None and not isinstance(cause, Refused)
    core.fail(str(error), "".join(format_exception(cause)).rstrip() if is_own else "")


class PlayerLoop:
    """Runs the player that the deployment declares under the core's name. `step` after every message and wake."""

    def __init__(self, core: ClientCore, load: Callable[[str], PlayerFactory] = load_player) -> None:
        self.core = core
        self.newest = Newest({})
        self._load = load
        self._acting: Acting | None = None
        self._beat_ns = NEVER_NS
        self._period_ns = 0

    def step(self, now_ns: int) -> None:
        """Advance: begin after the welcome, then act at each Go or period.

        Raises PlayerError for a player that cannot be loaded, fails, or gives an invalid command.
        """
        core = self.core
        if core.deployment is None or core.ended:
            return
        if self._acting is None:
            self._begin(core.deployment, now_ns)
        if core.go is not None:
            assert self._acting is not None
            self._acting.exist(core.go.since, core.go.absent, core.go.tick)
            self.newest.take(core.go.packets)
            self._say(core.go.tick, now_ns)
        elif self._period_ns and core.since >= 0:
            assert self._acting is not None
            self._acting.exist(core.since, core.absent, core.tick)
            self.newest.take(core.arrivals)
            core.arrivals.clear()
            if now_ns >= self._beat_ns and not core.is_away:
                self._say(max(core.tick, 0), now_ns)
                following_ns = self._beat_ns + self._period_ns
                self._beat_ns = following_ns if following_ns > now_ns else now_ns + self._period_ns

    @property
    def player(self) -> Player | None:
        """The player that acts; None before the welcome."""
        return None if self._acting is None else self._acting.player

    def deadline_ns(self) -> int:
        """When a free-running player acts next."""
        return NEVER_NS if self.core.ended or self.core.is_away or self.core.since < 0 else self._beat_ns

    def _begin(self, deployment: Deployment, now_ns: int) -> None:
        acting = self._acting = Acting(deployment, self.core.name, self._load, self.core.tick)
        self.newest, declared = acting.newest, acting.declared
        if declared.lockstep:
            period, offset = deployment.turns(declared)
            self.core.join(period, acting.hears, offset, deployment.arrivals_of(acting.name))
        else:
            self.core.join(0, acting.hears)
            self._period_ns = int(NS_PER_S / declared.rate_hz)
            self._beat_ns = now_ns + self._period_ns

    def _say(self, tick: int, now_ns: int) -> None:
        """Call the player and send its packets."""
        assert self._acting is not None
        core, packets = self.core, self._acting.act(tick)
        core.report(self._acting.metrics)
        try:
            if core.go is not None:
                core.done(packets)
            else:
                core.send(packets, now_ns)
        except PacketError as error:
            raise PlayerError(f"{core.name} failed at tick {tick}: {error}") from error


def _by_name(item: tuple[object, object]) -> str:
    """Sort key of a command's name, which may have any type."""
    return str(item[0])


def _module_of(declaration: Declaration) -> str:
    """The module of a player's class."""
    return declaration.class_.partition(":")[0]
