"""Law 1 for rigid bodies that go from owner to owner, and for a stack that stands and falls: any number of nodes.

Then faults are planted, one at a time, and the same comparison must see each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import pytest

from foosim.common.errors import Malformed
from foosim.common.keyed_random import draw_key, draw_words
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import load_deployment
from foosim.simulation.failures import Stuck
from foosim.simulation.stepped_world import deal_robots
from foosim.world.assembly.rest import Rest, is_still
from foosim.world.assembly.volumes import BodyIsland, Volumes
from foosim.world.components.drives import Drives
from foosim.world.frame import Frame
from foosim.world.layout import Entity
from tests.forms.worlds import DEPLOY
from tests.frames import Frames
from tests.solid_yards import ARMS, ARMS_X_M, NAME, PUSHED, SIDE_M, STACK, Push, run, stack, three_arms

TICKS = 200


@cache
def pushed(nodes: int, *, is_shuffled: bool = False) -> tuple[list[bytes], list[Frame]]:
    frames = Frames()
    found = run(three_arms(), TICKS, nodes, PUSHED, on_commit=frames, is_shuffled=is_shuffled)
    return found.digests, frames.frames


def islands() -> list[list[BodyIsland]]:
    """The islands of each tick of the run past three arms."""
    text, files = pin_assets(three_arms(), NAME, DEPLOY)
    frames = pushed(1)[1]
    volumes = Volumes(load_deployment(text, NAME).with_assets(files), frames[0].layout)
    return [volumes.islands(frame.numbers) for frame in frames]


def test_a_box_that_is_pushed_past_three_owners_goes_the_same_way_on_any_number_of_nodes() -> None:
    digests, frames = pushed(1)
    assert digests == pushed(2)[0] == pushed(3)[0] == pushed(3, is_shuffled=True)[0]
    box = frames[0].layout["box"].index
    owners = [island.nearest for each in islands() for island in each if box in island.entities]
    assert [owner for owner in dict.fromkeys(owners) if owner] == list(ARMS)
    assert "" in owners, "between two arms it belongs to a node that follows from its name"
    ram = frames[0].layout["ram"].index
    touched = [frame for frame in frames if ram in [int(one) for one in frame.vector("box", "partners", 4)]]
    assert len(touched) >= 8 and frames[-1].vector("box", "position", 3)[0] > ARMS_X_M[-1] + 0.5


def test_a_base_of_one_node_drives_between_islands_of_two_others() -> None:
    """It is in the way of both in one tick, and a crate that falls on it is pushed away."""
    digests, frames = pushed(1)
    layout, dealt = frames[0].layout, deal_robots(load_deployment(three_arms(), NAME), 3)
    owner = {robot: node for node, robots in dealt.items() for robot in robots}
    base = layout["base"].index
    between = 0
    for each in islands():
        others = {owner[island.nearest] for island in each if base in island.movers and island.nearest}
        between += len(others - {owner["base"]}) >= 2
    assert between >= 50, between
    partners = {int(one) for frame in frames for one in frame.vector("fallen", "partners", 4)}
    assert base in partners and frames[-1].vector("fallen", "position", 3)[2] == pytest.approx(SIDE_M / 2, abs=0.02)
    assert digests == pushed(3)[0]


def test_what_is_kept_of_which_boxes_may_overlap_changes_no_island() -> None:
    """Frames in their order, and then in any: as found anew for each."""
    text, files = pin_assets(three_arms(), NAME, DEPLOY)
    deployment, frames = load_deployment(text, NAME).with_assets(files), pushed(1)[1]
    kept = Volumes(deployment, frames[0].layout)
    order = [*range(0, TICKS, 4), *[draw_words(draw_key(7, "order"), n)[0] % TICKS for n in range(30)]]
    for number in order:
        anew = Volumes(deployment, frames[0].layout)
        assert kept.islands(frames[number].numbers) == anew.islands(frames[number].numbers), number


def stands_and_falls(stands: int, falls: int) -> None:
    """A stack of ten stands for some ticks, then one of its lower boxes is pushed out: the same on 1, 2 and 3 nodes."""
    pushes: Sequence[Push] = ((stands, STACK[2], (5.8, 0.0, 0.0)),)
    last: list[Frame] = []

    def watch(frame: Frame) -> None:
        last[:] = [frame]
        if frame.tick > stands:
            return
        for number, name in enumerate(STACK):
            x, y, z = frame.vector(name, "position", 3)
            sunk = SIDE_M * (number + 0.5) - z
            assert 0.0 <= sunk <= 0.001 * (number + 1), (frame.tick, name)
            assert abs(x) < 0.02 and abs(y) < 0.02, (frame.tick, name)

    one = run(stack(), stands + falls, 1, pushes, on_commit=watch)
    assert last[0].tick == stands + falls and last[0].vector(STACK[-1], "position", 3)[2] < SIDE_M * 3
    assert max(abs(last[0].vector(name, "position", 3)[0]) for name in STACK) > SIDE_M
    for nodes in (2, 3):
        assert run(stack(), stands + falls, nodes, pushes).digests == one.digests, nodes
    assert run(stack(), stands + falls, 3, pushes, is_shuffled=True).digests == one.digests


def test_a_stack_of_ten_stands_and_falls_the_same_everywhere() -> None:
    stands_and_falls(120, 90)


@pytest.mark.campaign
def test_a_stack_of_ten_stands_for_a_minute_and_falls_the_same_everywhere() -> None:
    stands_and_falls(6_000, 300)


# --- mutations -------------------------------------------------------------------------------------------------------


def test_rest_that_is_not_in_the_frame_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """A node that counts in an object for how long bodies were slow has forgotten it when the object is made anew."""

    def stack_differs() -> bool:
        frames = Frames()
        one, last = run(stack(), 150, 1, on_commit=frames), frames.frames[-1]
        speeds = [speed for name in STACK for speed in last.vector(name, "linear_velocity", 3)]
        assert max(map(abs, speeds)) < 0.01, "it stands"
        return run(stack(), 150, 2, is_shuffled=True).digests != one.digests

    def count(self: Rest, bodies: Sequence[Entity], drives: Sequence[Drives], numbers: list[float]) -> None:
        memory = self.__dict__.setdefault("memory", {})
        for entity in bodies:
            at = entity.offsets["still_pose"]
            numbers[at : at + 7] = memory.get((entity.index, "pose"), [0.0] * 7)
            is_moved = not is_still(entity, numbers)
            memory[entity.index] = 0 if is_moved else memory.get(entity.index, 0) + 1
            if is_moved:
                place = entity.offsets["position"]
                memory[entity.index, "pose"] = numbers[place : place + 7]
            numbers[at : at + 7] = [0.0] * 7

    def may_rest(self: Rest, bodies: Sequence[Entity], *_: object) -> bool:
        memory = self.__dict__.setdefault("memory", {})
        return all(memory.get(entity.index, 0) >= self.ticks for entity in bodies)

    assert not stack_differs()
    monkeypatch.setattr(Rest, "count", count)
    monkeypatch.setattr(Rest, "may_rest", may_rest)
    assert stack_differs()


@pytest.mark.parametrize(("nodes", "caught"), [(1, Malformed), (3, Stuck)])
def test_a_body_that_anothers_island_holds_is_caught(
    nodes: int, caught: type[Exception], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The island of an arm has the pushed box, too, while that is far away: none of its numbers has two writers.

    A node does not say that it solved something twice, and parts of two nodes that hold one body make no frame.
    """
    honest = Volumes.islands

    def holding(self: Volumes, numbers: Sequence[float]) -> list[BodyIsland]:
        box = self._layout["box"].index
        return [
            replace(island, entities=tuple(sorted({*island.entities, box}))) if island.nearest == ARMS[0] else island
            for island in honest(self, numbers)
        ]

    monkeypatch.setattr(Volumes, "islands", holding)
    with pytest.raises(caught):
        run(three_arms(), 10, nodes, PUSHED)
