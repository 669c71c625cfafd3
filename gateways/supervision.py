"""MORSE's services of the simulator, `simulation`, `time` and `communication`, over an operator's session.

Requests wait for answers in a thread; frames come by the lease of a viewer, which gives `Run` its time where no sensor
does.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from math import sqrt
from typing import Any, Final, TypeVar

import numpy as np

from foosim.client.control import Control
from foosim.common.errors import Refused
from foosim.common.units import parse_pace
from foosim.gateways.components import details_of
from foosim.gateways.frames import euler
from foosim.gateways.rows import label_of
from foosim.gateways.run import Listener, Run
from foosim.protocol import channels
from foosim.protocol.codec import decode
from foosim.protocol.messages import Commit
from foosim.runtime.transport.inbox import Inbox, Item
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.component_types.payloads import as_float
from foosim.world.components.surroundings import Surroundings
from foosim.world.frame import Frame, frame_from_bytes
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import WORLD, Entity
from foosim.world.rays.shapes import NOTHING
from foosim.world.scene import Pose, Vector, from_rpy
from foosim.world.setting.settable import AT, settable

T = TypeVar("T")
_LOG: Final = logging.getLogger("foosim.gateways")
SLEEP_S_MAX: Final = 1e6
FRAMES_HZ: Final = 50.0
RENEW_S: Final = 1.0
"""The period in which the lease is renewed; it lasts longer."""
ANSWER_S: Final = 10.0


class Frames(Inbox):
    """Hands each commit that is shown to the loop, from a receiving thread."""

    def __init__(self, loop: asyncio.AbstractEventLoop, take: Callable[[bytes], None]) -> None:
        super().__init__(1)
        self._loop, self._take_commit = loop, take

    def offer(self, item: Item) -> bool:
        self._loop.call_soon_threadsafe(self._take_commit, item[2])
        return True


class World:
    """The world of a run, for what is computed from its frames."""

    def __init__(self, run: Run, control: Control) -> None:
        """Fetches the files that the deployment names."""
        deployment, names = run.deployment, {robot: name for name, robot in run.robots.items()}
        self.spec: Final = deployment.with_assets(control.files(deployment)) if deployment.files() else deployment
        self.start: Final = initial_frame(self.spec)
        self.surroundings: Final = Surroundings(self.spec, self.start.layout)
        bodies = self.surroundings.bodies
        self.entities: Final = {
            names.get(one.name) or label_of(self.spec, one.name): one
            for one in self.start.layout.entities
            if one.name in bodies
        }
        """Those with a place, by the name that programs know."""

    def entity(self, name: str) -> Entity:
        """Return an entity by the name that programs know. Raises Refused."""
        if name not in self.entities:
            raise Refused(f"{name} does not exist in the simulation ")
        return self.entities[name]

    def pose(self, entity: Entity, frame: Frame) -> Pose:
        """Return the pose of the first link of an entity."""
        return forward_kinematics(self.surroundings.bodies[entity.name], entity, frame.numbers)[0]


class Supervision(Listener):
    """The services of the simulator for all programs of a gateway, by component and name: functions of the parameters
    that return the answer, or an awaitable of it. They raise Refused."""

    def __init__(self, run: Run, connect: Callable[[], Control]) -> None:
        """`connect` makes the operator's session; it may wait."""
        self._run, self._connect = run, connect
        self._world: World | None = None
        self._commit: Commit | None = None
        """The newest one that was shown."""
        self._threads = ThreadPoolExecutor(1, "operator")
        self._control: Control | None = None
        self._looking: asyncio.Future[None] | None = None
        self._quitting: asyncio.Future[str] | None = None
        self._sleeps: list[tuple[float, asyncio.Future[None]]] = []
        self.services: Final[Mapping[str, Mapping[str, Callable[..., Any]]]] = {
            "simulation": {
                "activate": partial(self._switch, is_on=True),
                "deactivate": partial(self._switch, is_on=False),
                "details": lambda: details_of(run.components.values(), run.robots, run.deployment),
                "get_scene_objects": self._scene_objects,
                "list_robots": lambda: [*run.robots],
                "quit": self._quit,
                "reset_objects": self._reset,
                "restore_dynamics": lambda: self._request("resume", "Physics is resumed"),
                "set_log_level": self._set_log_level,
                "set_object_position": self._set_position,
                "suspend_dynamics": lambda: self._request("pause", "Physics is suspended"),
                "terminate": self._quit,
            },
            "time": {
                "mode": lambda: "Fixed Simulation Step" if run.deployment.pace.kind == "fast" else "Best Effort",
                "now": lambda: run.time_s,
                "set_time_scale": self._set_time_scale,
                "sleep": self._sleep,
                "statistics": self._statistics,
            },
            "communication": {"distance_and_view": self._distance_and_view},
        }

    def advanced(self) -> None:
        """End the sleeps that are over."""
        over = [future for until_s, future in self._sleeps if until_s <= self._run.time_s]
        self._sleeps = [(until_s, future) for until_s, future in self._sleeps if until_s > self._run.time_s]
        for future in over:
            if not future.done():
                future.set_result(None)

    async def follow(self) -> None:
        """Renew the lease of frames until cancelled; a session that fails is made anew."""
        frames = Frames(asyncio.get_running_loop(), self._shown)
        known: Control | None = None
        while True:
            try:
                control = await self.in_thread(self._session)
                if control is not known:
                    control.view(frames)
                    known = control
                await self.in_thread(partial(control.request, "watch", ANSWER_S, hz=FRAMES_HZ))
            except Refused as refused:
                _LOG.warning("frames of %s: %s", self._run.name, refused)
            await asyncio.sleep(RENEW_S)

    def close(self) -> None:
        """End the session."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        if self._control is not None:
            self._control.close()

    # --- the session --------------------------------------------------------------------------------------------------

    def _session(self) -> Control:
        """In the thread: return the session, made anew after a failure."""
        if self._control is None:
            self._control = self._connect()
        return self._control

    async def in_thread(self, work: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(self._threads, work)

    async def _request(self, verb: str, answer: str = "", **arguments: Any) -> str:
        """Send a request and return the answer of the service."""
        await self.in_thread(lambda: self._session().request(verb, ANSWER_S, **arguments))
        return answer

    def _shown(self, payload: bytes) -> None:
        """Take a frame that is shown."""
        self._commit = decode(Commit, payload, channels.VIEW.bytes_max)
        self._run.arrived("", (), self._commit.tick)
        if self._run.has_jobs and (self._looking is None or self._looking.done()):
            self._looking = asyncio.ensure_future(self._fail_absent())

    async def _fail_absent(self) -> None:
        """End the jobs of robots that are absent, which report nothing."""
        with suppress(Refused):
            _, frame = await self._looked()
            self._run.fail([one.name for one in frame.layout.robots if one.is_absent(frame.numbers)])

    async def _looked(self) -> tuple[World, Frame]:
        """Return the world, made at the first look, and its newest frame."""
        if self._world is None:
            self._world = await self.in_thread(lambda: World(self._run, self._session()))
        world, commit = self._world, self._commit
        if commit is None:
            return world, world.start
        return world, frame_from_bytes(commit.tick, world.start.layout, commit.values, commit.outboxes)

    # --- simulation ---------------------------------------------------------------------------------------------------

    async def _switch(self, name: str, *, is_on: bool) -> None:
        component = self._run.components.get(name)
        if component is None:
            raise Refused(f"Component '{name}' not found. Can't {'activate' if is_on else 'deactivate'}")
        await self._request("set", name=component.robot, field=f"{component.channel}.active", value=is_on)

    async def _reset(self) -> str:
        world, frame = await self._looked()
        for entity in frame.layout.entities:
            is_present = entity.name != WORLD and not entity.is_absent(frame.numbers)
            if is_present and AT in settable(world.spec, frame.layout, entity):
                await self._put(entity, world.pose(entity, world.start))
        return "Objects restored to initial position"

    async def _put(self, entity: Entity, pose: Pose) -> None:
        _, (x, y, z), orientation = pose
        yaw, pitch, roll = euler(orientation)
        angles = {"yaw": yaw} if "heading" in entity.fields else {"roll": roll, "pitch": pitch, "yaw": yaw}
        place = {"x": f"{x} m", "y": f"{y} m", **({} if "heading" in entity.fields else {"z": f"{z} m"})}
        value = place | {key: f"{angle} rad" for key, angle in angles.items()}
        await self._request("set", name=entity.name, field=AT, value=value)

    async def _set_position(self, name: str, position: Vector, rotation: Vector | None = None) -> None:
        world, frame = await self._looked()
        entity = world.entity(name)
        _, _, orientation = world.pose(entity, frame)
        await self._put(entity, (name, position, orientation if rotation is None else from_rpy(*rotation)))

    async def _scene_objects(self) -> dict[str, Any]:
        world, frame = await self._looked()
        poses = {name: world.pose(entity, frame) for name, entity in world.entities.items()}
        return {name: [{}, [*position], [*orientation]] for name, (_, position, orientation) in poses.items()}

    def _quit(self) -> None:
        """End the run, once this is answered."""
        self._quitting = asyncio.ensure_future(self._request("down"))

    def _set_log_level(self, component: str, level: str) -> None:
        try:
            logging.getLogger(component).setLevel(level.upper())
        except ValueError:
            raise Refused(f"{level!r} is no level of a log (valid are DEBUG, INFO, WARNING, ERROR, CRITICAL)") from None

    # --- time and communication ---------------------------------------------------------------------------------------

    async def _sleep(self, seconds: float) -> None:
        if not 0.0 <= as_float(seconds) <= SLEEP_S_MAX:
            raise Refused(f"sleep takes 0 to {SLEEP_S_MAX:g} simulated seconds, not {seconds!r}")
        over: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._sleeps.append((self._run.time_s + seconds, over))
        await over

    async def _set_time_scale(self, scale: float) -> bool:
        parse_pace(text := f"{scale}x")
        await self._request("rate", pace=text)
        return True

    async def _statistics(self) -> dict[str, float]:
        status = await self.in_thread(lambda: self._session().status(ANSWER_S))
        period_s = self._run.deployment.tick_ns / 1e9 / (status["rtf"] or 1.0)
        return {"mean_time": period_s, "mean_frame_by_sec": 1.0 / period_s}

    async def _distance_and_view(self, robot: str, other: str) -> list[Any]:
        """The distance between two robots (m), and whether one ray from one to the other meets nothing else."""
        world, frame = await self._looked()
        pair = [world.entity(robot), world.entity(other)]
        start, end = (world.pose(entity, frame)[1] for entity in pair)
        way = [there - here for here, there in zip(start, end, strict=True)]
        distance = sqrt(sum(step * step for step in way))
        if distance == 0.0:
            return [0.0, True]
        hits = world.surroundings.caster.at(frame.numbers).cast(
            np.array([start]), np.array([way]) / distance, distance, pair[0].index
        )
        return [distance, bool(hits.things[0] in (NOTHING, pair[1].index))]
