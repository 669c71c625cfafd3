"""A deployment stepped from Python: `with Simulation("deploy/table.yaml") as s: s.step({...})`.

One process computes the world and the network. Agents are players that the caller controls: by default all players of
the deployment, or one called `learner` where it has none. Its other players act by themselves, as declared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from foosim.capture.start_frame import read_branch
from foosim.client.commands import CommandEncoder
from foosim.client.player import Commands, Packet, Sample
from foosim.common.closable import Closable
from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import ClientSpec, Deployment
from foosim.deployment.text.files import read_deployment_text
from foosim.deployment.validate_network import event_text
from foosim.node.physics.mesh_trial import check_shapes
from foosim.protocol.messages import Sent
from foosim.simulation.agents import LEARNER, Agent, Pair, Resident, agents_of
from foosim.simulation.carriers import Bypass, Carrier, EmulatedNetwork
from foosim.simulation.stepped_world import SteppedWorld
from foosim.vhub.network.memory import Joining
from foosim.world.assembly.initial_state import first_frame
from foosim.world.assembly.world import build_scene, status_numbers, world_status
from foosim.world.edits import Disrupt, Edit, Remove, written
from foosim.world.frame import Frame
from foosim.world.scene import Scene
from foosim.world.setting.coming import absent_named, check_present
from foosim.world.setting.settable import add_edit, set_edits
from foosim.world.start import Start


def read_for_stepping(path: str | Path, sets: Sequence[str] = ()) -> Deployment:
    """Return the deployment in a file, with the files that it names.

    Raises DeploymentError for a bad text, AssetError for a bad file.
    """
    path = Path(path)
    text = apply_sets(read_deployment_text(path), path.name, sets)
    text, files = pin_assets(text, path.name, path.parent)
    deployment = load_deployment(text, path.name).with_assets(files)
    check_shapes(deployment, path.name, text)
    return deployment


def _frame(deployment: Deployment, start: Start | Frame | str | None) -> Frame:
    if isinstance(start, Frame):
        return start
    return first_frame(deployment, read_branch(start, deployment).start if isinstance(start, str) else start)


class Simulation(Closable):
    """A world and its network, stepped by the caller. Use it as a context, or `close` it.

    `tick`, `frame`, `status` and `readings` are the present frame's.
    """

    def __init__(
        self,
        deployment: Deployment | str | Path,
        *,
        agents: Sequence[str] | None = None,
        network: bool = False,
        period: int = 1,
        sets: Sequence[str] = (),
        start: Start | Frame | str | None = None,
        seed: int | None = None,
    ) -> None:
        """`deployment` is one that was loaded, or a file, of which `sets` change values as `--set` does.

        `agents` are players that the caller controls. With `network`, packets go through the network that the
        deployment declares; without, readings arrive at once and commands, too. The network hands readings to agents
        every `period` ticks. `start` is the frame to begin with: a `Frame`, a `Start`, or `CAPTURE@12.5s`. `seed` is
        another one than the deployment's.

        Raises DeploymentError, AssetError, UnknownName for an unknown agent, BadValue for a start that does not
        fit, PlayerError for a player that cannot be made.
        """
        loaded: Deployment
        if isinstance(deployment, Deployment):
            loaded = deployment
            if sets:
                raise BadValue("a loaded deployment takes no sets, its file does", list(sets))
        else:
            loaded = read_for_stepping(deployment, sets)
        names = sorted(set(agents_of(loaded) if agents is None else agents))
        unknown = [name for name in names if name not in loaded.players]
        if unknown == [LEARNER]:
            loaded = loaded.model_copy(update={"clients": {**loaded.clients, LEARNER: ClientSpec()}})
        self.declared: Deployment = loaded
        """With the seed that it was given."""
        self.agents = {name: Agent(loaded, name) for name in names}
        self.period = period
        self._has_network = network
        self._encoder: CommandEncoder | None = None
        self._scene: Scene | None = None
        self.deployment: Deployment = loaded
        """As it is stepped: with the seed of the last `reset`."""
        self._world: SteppedWorld | None = None
        self._carrier: Carrier
        self._residents: dict[str, Resident] = {}
        self._events: list[Disrupt] = []
        self._edits: list[Edit] = []
        """What happens to the network from the next frame on."""
        self.reset(start, seed)

    # --- beginning ---------------------------------------------------------------------------------------------------

    def reset(self, start: Start | Frame | str | None = None, seed: int | None = None) -> Frame:
        """Begin anew with the first frame, or another one; the network is empty, and players have no memory.

        `seed` is that of all draws of the world, its network and its players; None: the deployment's.
        """
        deployment = self._seeded(seed)
        self._begin(deployment, _frame(deployment, start))
        return self.frame

    def start_frame(self, start: Start | Frame | str | None = None, seed: int | None = None) -> Frame:
        """Return the frame that `reset` would begin with. It raises as that does."""
        return _frame(self._seeded(seed), start)

    def _seeded(self, seed: int | None) -> Deployment:
        return self.declared if seed is None else self.deployment.with_seed(seed)

    def _begin(self, deployment: Deployment, frame: Frame) -> None:
        self.deployment = deployment
        names = [name for name in sorted(deployment.players) if name not in self.agents]
        self._residents = {name: Resident(deployment, name) for name in names}  # first: one may be refused
        if self._world is None:
            self._world = SteppedWorld(deployment, frame)
        else:
            self._world.begin(deployment, frame)
        for agent in self.agents.values():
            agent.begin(deployment)
        joining = [
            Joining(name, self.period, agent.hears, frame.tick % self.period) for name, agent in self.agents.items()
        ]
        for name, resident in self._residents.items():
            period, offset = deployment.turns(resident.acting.declared)
            hears, arrivals = resident.acting.hears, deployment.arrivals_of(name)
            joining.append(Joining(name, period, hears, offset, arrivals))
        carrier = EmulatedNetwork if self._has_network else Bypass
        self._carrier = carrier(deployment, frame.tick, joining)
        self._events, self._edits = [], []
        self._open()

    # --- what there is -----------------------------------------------------------------------------------------------

    @property
    def frame(self) -> Frame:
        """The present frame."""
        return self._stepped.frame

    @property
    def tick(self) -> int:
        """The present frame's tick."""
        return self._stepped.frame.tick

    @property
    def time_s(self) -> float:
        """Simulated time of the present frame."""
        return self.tick * self.deployment.tick_ns * 1e-9

    @property
    def status(self) -> dict[str, Any]:
        """What rules and kits show, as in the result of a run: of the table `score`."""
        return world_status(self.deployment, self.frame)

    @property
    def metrics(self) -> dict[str, float | None]:
        """The metrics so far, named as in the result of a run: numbers of `status`, what players report that act by
        themselves, and figures of the network where there is one. None stands for infinity and NaN."""
        residents = sorted(self._residents.items())
        reported = {
            f"players.{name}.{metric}": value
            for name, resident in residents
            for metric, value in sorted(resident.acting.metrics.items())
        }
        carrier = self._carrier
        network = carrier.state.metrics.values() if isinstance(carrier, EmulatedNetwork) else {}
        return {**status_numbers(self.status), **reported, **network}

    @property
    def readings(self) -> dict[Pair, Sample]:
        """The newest reading of each (robot, channel) that an agent hears and that has reached one."""
        found: dict[Pair, Sample] = {}
        for agent in self.agents.values():
            for pair, packet in agent.newest.items():
                codec, joints = agent.channels[pair]
                value = packet.payload if codec is None else codec.decode(packet.payload)
                found[pair] = Sample(*pair, packet.sequence, packet.sent_ns, packet.due_ns, value, joints)
        return dict(sorted(found.items()))

    @property
    def quarantined(self) -> list[str]:
        """Who came into quarantine since the last `reset`, and why, in words."""
        return self._stepped.quarantined

    @property
    def scene(self) -> Scene:
        """The bodies, also absent ones, and the scenery."""
        if self._scene is None:
            self._scene = build_scene(self.deployment, self.frame.layout)
        return self._scene

    @property
    def _stepped(self) -> SteppedWorld:
        assert self._world is not None, "closed"
        return self._world

    # --- stepping ----------------------------------------------------------------------------------------------------

    def step(self, commands: Commands | None = None, ticks: int = 1) -> dict[Pair, Sample]:
        """Send commands, by robot, at the present frame, and compute some ticks; return the readings then.

        A robot without a command keeps its last one. Raises UnknownName for a robot that no agent commands or that
        takes no such command, BadValue for an absent robot and for invalid names and numbers of a command,
        ComponentError and PlayerError for a failing component or player.
        """
        by_agent: dict[str, list[Packet]] = {name: [] for name in self.agents}
        if self._encoder is None:
            self._encoder = CommandEncoder(self.declared)
        for robot, command in sorted((commands or {}).items()):
            owner = next((name for name, agent in self.agents.items() if robot in agent.robots), None)
            if owner is None:
                theirs = [robot for agent in self.agents.values() for robot in agent.robots]
                raise UnknownName("no robot of an agent", robot, theirs)
            if self.frame.layout[robot].is_absent(self.frame.numbers):
                raise BadValue(f"{robot} is absent: add it first")
            by_agent[owner] += [Packet(robot, *one) for one in self._encoder.encode(robot, command)]
        self.advance(by_agent, ticks)
        return self.readings

    def set(self, name: str, field: str, value: object) -> None:
        """Set a field of an entity at the next step, as `foosim set` does: `set("crate-1", "at", "3,1")`.

        Raises UnknownName, and BadValue for a fixed field, a value beyond its limits, and an occupied place.
        """
        layout, numbers = self.frame.layout, self._coming()
        if name not in layout:
            raise UnknownName("no entity", name, layout.names)
        if layout[name].is_absent(numbers):
            raise BadValue(f"{name} is absent: add it first")
        self._edits += set_edits(self.deployment, layout, numbers, layout[name], field, value)

    def add(self, name: str, at: object = None) -> str:
        """Add a spare at the next step, as `foosim add` does: `add("crate", "1,0")`; return its name.

        Raises Refused for a present or unknown one, and BadValue for an invalid or occupied place.
        """
        layout, numbers = self.frame.layout, self._coming()
        entity = absent_named(layout, numbers, name)
        self._edits.append(add_edit(self.deployment, layout, numbers, entity, at))
        return entity.name

    def remove(self, name: str) -> None:
        """Remove an entity at the next step, as `foosim remove` does. Raises Refused for an absent one."""
        check_present(self.frame.layout, self._coming(), name)
        self._edits.append(Remove(name))

    def _coming(self) -> list[float]:
        """Return the numbers of the present frame after the edits of the next step."""
        return written(self.frame.layout, self.frame.numbers, self._edits)

    def partition(self, *groups: str | Sequence[str]) -> None:
        """Cut the network between groups of endpoints, names or selectors, from the next frame on until `heal`:
        `partition("red.*", ["camera", "player-blue"])`.

        Raises BadEvent for invalid groups, BadValue without a network.
        """
        self._disrupt({"partition": [[group] if isinstance(group, str) else [*group] for group in groups]})

    def heal(self) -> None:
        """End all partitions and clogs, and take back changed settings, from the next frame on. Raises BadValue."""
        self._disrupt({"heal": "all"})

    def _disrupt(self, event: dict[str, Any]) -> None:
        if not self._has_network:
            raise BadValue("this simulation has no network: network=True gives it one")
        effective_ns = (self.tick + 1) * self.deployment.tick_ns
        self._events.append(Disrupt(event_text(self.deployment, event, effective_ns)))

    def advance(self, packets: Mapping[str, Sequence[Packet]], ticks: int) -> None:
        """Send packets of agents, by name, at the present frame, and compute some ticks."""
        if ticks < 1:
            raise BadValue("ticks of a step are 1 or more", ticks)
        now_ns = self.tick * self.deployment.tick_ns
        sent = {name: self.agents[name].numbered(new, now_ns) for name, new in packets.items() if new}
        for _ in range(ticks):
            self._close(sent)
            self._open()
            sent = {}

    def _open(self) -> None:
        """Let robots send and clients hear what reaches them at the frame; residents that are due act in `_close`."""
        world = self._stepped
        self._due = self._carrier.open(world.frame, world.sense(), self._events)
        self._events = []
        for name, agent in self.agents.items():
            agent.exist(self._carrier.members[name].since)
            arrived = self._carrier.take(name)
            if arrived:
                agent.take(arrived, self._has_network)

    def _close(self, sent: dict[str, list[Sent]]) -> None:
        """Let residents act that are due, and compute the next frame."""
        world = self._stepped
        frame = world.frame
        if self._residents:
            for name in self._due:
                resident = self._residents.get(name)
                if resident is not None:
                    now_ns = frame.tick * self.deployment.tick_ns
                    sent[name] = resident.act(frame.tick, now_ns, self._carrier)
        world.step(self._carrier.close(frame, sent), self._edits)
        self._edits = []

    def close(self) -> None:
        """Free the engines."""
        if self._world is not None:
            self._world.close()
            self._world = None
