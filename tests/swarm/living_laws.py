"""The laws of what comes and goes, of jobs and of grasps, checked from one frame to the next."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from typing import NamedTuple

from foosim.deployment.schema import Deployment
from foosim.vhub.state.records import Closing
from foosim.world.assembly.event_times import events_by_tick
from foosim.world.assembly.grippers import Gripper, grippers_of
from foosim.world.assembly.volumes import Volumes
from foosim.world.component_types.jobs import CHANGED, NUMBERS, RUNNING, STATES, JobState
from foosim.world.component_types.per_field import codec_of
from foosim.world.component_types.registry import find_component
from foosim.world.edits import Disrupt, Set, counters, parked
from foosim.world.frame import Frame
from foosim.world.layout import Layout
from foosim.world.setting.settable import QUARANTINED
from tests.swarm.packet_invariants import hold


class Book(NamedTuple):
    """The jobs of an actuator of a robot: who may give it any, in the order of its rows."""

    robot: str
    actuator: str
    kind: str
    senders: tuple[str, ...]

    def rows(self, frame: Frame) -> list[tuple[int, JobState]]:
        """Return number and state of the last job of each sender."""
        numbers, states = (self.slot(frame, slot) for slot in (NUMBERS, STATES))
        return [(int(number), JobState(int(state))) for number, state in zip(numbers, states, strict=True)]

    def slot(self, frame: Frame, slot: str) -> Sequence[float]:
        """Return the numbers of a slot of the actuator."""
        field = f"{self.actuator}.{slot}"
        return frame.vector(self.robot, field, frame.layout[self.robot].counts[field])


class LivingLaws:
    """Checks each frame against the one before. Raises Broken."""

    def __init__(self, deployment: Deployment, layout: Layout) -> None:
        self._events = events_by_tick(deployment)
        self._books = [
            Book(robot.name, channel, settings.kind, deployment.senders_to(robot.name))
            for robot in layout.robots
            for channel, settings in sorted(deployment.robots[robot.name].actuators.items())
            if f"{channel}.{NUMBERS}" in robot.offsets
        ]
        self._grippers: tuple[Gripper, ...] = grippers_of(deployment, layout)
        self._volumes = Volumes(deployment, layout) if self._grippers else None
        self._leaving = [entity for entity in layout.entities if entity.can_leave]
        self._remembered = {
            at
            for entity in self._leaving
            for at in (
                *counters(entity),
                *chain.from_iterable(
                    range(at, at + entity.counts[field])
                    for field, at in entity.offsets.items()
                    if field.endswith((f".{NUMBERS}", f".{STATES}"))
                ),
            )
        }
        """What an absent entity keeps."""

    def check(self, closing: Closing, before: Frame) -> None:
        """Check the frame of a closing against the one before."""
        after = closing.frame
        self._absent(after)
        for book in self._books:
            self._jobs(book, before, closing)
        for gripper in self._grippers:
            self._grasp(gripper, before, closing)
        if any(after.numbers[one.held] >= 0.0 for one in self._grippers):
            self._islands(after)

    # --- what comes and goes -----------------------------------------------------------------------------------------

    def _absent(self, frame: Frame) -> None:
        """Who is absent is as anybody who is, and nobody refers to it."""
        numbers, entities = frame.numbers, frame.layout.entities
        for entity in self._leaving:
            if entity.is_absent(numbers):
                its = parked(frame.layout, entity)
                changed = [
                    at
                    for at, number in enumerate(its, entity.start)
                    if numbers[at] != number and at not in self._remembered
                ]
                hold(not changed, f"at tick {frame.tick} {entity.name} is absent, and has {changed}")
        for at in frame.layout.references:
            other = int(numbers[at])
            what = f"at tick {frame.tick} something refers to {entities[other].name}, which is absent"
            hold(other < 0 or not entities[other].is_absent(numbers), what)

    # --- jobs --------------------------------------------------------------------------------------------------------

    def _jobs(self, book: Book, before: Frame, closing: Closing) -> None:
        """A sender's numbers only grow, each by a packet of its own; what has ended stays so; what runs was begun."""
        after = closing.frame
        what = f"at tick {after.tick} {book.actuator} of {book.robot}"
        rows, entity = book.rows(after), after.layout[book.robot]
        given = dict(_given(book, closing))
        for sender, (old, was), (new, state) in zip(book.senders, book.rows(before), rows, strict=False):
            goes_on = new == old and (state == was or (was == JobState.RUNNING and state.has_ended))
            hold(new > old or goes_on, f"{what}: the jobs of {sender} go from {(old, was)} to {(new, state)}")
            hold(new == old or (sender, new) in given, f"{what}: {sender} never gave it job {new}")
        (running,) = map(int, book.slot(after, RUNNING))
        having = [row for row, (_, state) in enumerate(rows, 1) if state == JobState.RUNNING]
        hold(having == ([running] if running else []), f"{what}: {running} runs, by the states {having}")
        is_out = entity.is_absent(after.numbers) or after.at(book.robot, "down") > 0.0
        hold(not (running and is_out), f"{what}: it works, and is out of service")
        told = [book.slot(frame, CHANGED)[0] for frame in (before, after)]
        hold(told[1] in (0.0, 1.0), f"{what}: tells of a change as {told[1]}")
        if f"{book.actuator}.target" in entity.offsets:
            known = {sender: number for sender, (number, _) in zip(book.senders, book.rows(before), strict=False)}
            late = {place for (sender, number), place in given.items() if number <= known[sender]}
            fresh = {place for (sender, number), place in given.items() if number > known[sender]}
            was_sent, is_sent = (tuple(book.slot(frame, "target")[:2]) for frame in (before, after))
            again = was_sent != is_sent and is_sent in late - fresh
            hold(not again, f"{what}: a job that came again sends it to {is_sent}")

    # --- grasps ------------------------------------------------------------------------------------------------------

    def _grasp(self, gripper: Gripper, before: Frame, closing: Closing) -> None:
        """What is held is there; a grasp stays as it is; it begins by a command, and ends by one, or by what happens to
        one of the two."""
        after, entities = closing.frame, closing.frame.layout.entities
        was, held = (int(frame.numbers[gripper.held]) for frame in (before, after))
        both = [entities[gripper.robot], *([entities[held]] if held >= 0 else [])]
        what = f"at tick {after.tick} {both[0].name} holds {both[-1].name if held >= 0 else 'nothing'}"
        if held >= 0:
            gone = [one.name for one in both if one.is_absent(after.numbers)]
            spoilt = [one.name for one in both if after.numbers[one.offsets[QUARANTINED]] > 0.0]
            hold(not (gone or spoilt), f"{what}: absent are {gone}, in quarantine {spoilt}")
            hold(both[1].is_free and not both[1].is_robot, f"{what}, which is no object")
        channel = next(field for field, at in both[0].offsets.items() if at == gripper.held).rpartition(".")[0]
        if any((packet.destination, packet.channel) == (both[0].name, channel) for packet in closing.delivered):
            return  # told to open and to close in one tick, it may take the same again
        names = {entities[index].name for index in (gripper.robot, was) if index >= 0}
        edits = [edit for edit in closing.edits if not isinstance(edit, Disrupt) and edit.name in names]
        events = [event for event in self._events.get(before.tick, ()) if event.name in names]
        spoilt = [name for name in names if after.at(name, QUARANTINED) > 0.0]
        if was == held:
            grasps = [frame.numbers[gripper.grasp : gripper.grasp + 7] for frame in (before, after)]
            hold(held < 0 or grasps[0] == grasps[1], f"{what}, in another way than before")
            is_put = any(isinstance(edit, Set) and edit.field == "position" for edit in edits)
            hold(held < 0 or not is_put, f"{what}, and one of them was put elsewhere")
        else:
            hold(held < 0 and bool(edits or events or spoilt), f"{what} for no reason")

    def _islands(self, frame: Frame) -> None:
        """Who holds and what is held are solved together."""
        assert self._volumes is not None, "there are grippers"
        island_of = {
            index: number
            for number, island in enumerate(self._volumes.islands(frame.numbers))
            for index in island.entities
        }
        for gripper in self._grippers:
            held = int(frame.numbers[gripper.held])
            together = held < 0 or island_of[gripper.robot] == island_of[held]
            hold(together, f"at tick {frame.tick} entity {held} and who holds it are in two islands")


def _given(book: Book, closing: Closing) -> Iterator[tuple[tuple[str, int], tuple[float, ...]]]:
    """Yield sender, number and place of each job that a tick's deliveries give or cancel."""
    for packet in closing.delivered:
        if (packet.destination, packet.channel) == (book.robot, book.actuator):
            command = codec_of(find_component("actuator", book.kind)).decode(packet.payload)
            yield (packet.source, abs(int(command.job))), (getattr(command, "x", 0.0), getattr(command, "y", 0.0))
