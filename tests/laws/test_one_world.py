"""Laws 1 and 3 over whole worlds: nodes, owners, moves, engines made anew, losses and a bad bus change nothing.

The four deployments, the workshop, the swarm's living world, and worlds with every component type. A run on one node is
compared with a run on three whose processes die; that one's capture with the world simulated again, from its start and
from frames within, and with its packets judged again; and the run with a `Simulation`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any, Final, NamedTuple

import numpy as np
import pytest
import yaml

from foosim.capture.reader import open_capture
from foosim.cli.rehearse import elsewhere
from foosim.common.batched.noise import NoiseKeys
from foosim.common.errors import Malformed
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.node.physics.mujoco_islands import CompositionEngine
from foosim.protocol.channels import SUPERVISOR
from foosim.runtime.roles.bus import CALM, Weather
from foosim.simulation.check import component_check
from foosim.simulation.check.component_check import ComponentCheck
from foosim.simulation.check.component_check import _shuffle as shuffle
from foosim.simulation.failures import Stuck
from foosim.simulation.journals import ENDINGS
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.simulation import Simulation
from foosim.simulation.system import Settings, System
from foosim.simulation.verify import Between, verify_capture
from foosim.simulation.what_if import what_if
from foosim.vhub.state.records import Closing
from foosim.world.assembly.islands import Assignment, Share
from foosim.world.assembly.rest import Rest
from foosim.world.assembly.versions import component_types_of
from foosim.world.assembly.volumes import BodyIsland, Volumes
from foosim.world.component_types.descriptions import NO_ENTITY
from foosim.world.components.reach import Island
from foosim.world.edits import counters, parked
from foosim.world.frame import Frame
from foosim.world.layout import Entity
from tests.components.test_components import ALONE, own
from tests.components.worlds import DEPLOY, still
from tests.frames import Frames
from tests.simulation.test_verify import messages_of
from tests.swarm.world_bounds import strays
from tests.whole_worlds import NAME, assets, mixed, written, yard

TABLE: Final = DEPLOY / "table.yaml"
SWARM: Final = Path(__file__).parents[1] / "swarm"
BACK_NS: Final = 5_000_000
OF_THE_WORLD: Final = ("/tick", "/frame", "/packets", "/clients", "/ages", "/tf", "/scene", "/layout")
"""Topics that do not name nodes."""
PATIENT: Final = tuple(
    f"deadlines.{name}=1 h" for name in ("heartbeat", "tick_named", "tick_lost", "lockstep_fast", "client_back")
)
PLAY: Final = ("table.rules.kickoff_delay=20 ms", "table.rules.kickoff_speed=2 m/s")


@dataclass(frozen=True)
class World:
    """A deployment's text, the folder of its files, and for how many ticks it is looked at."""

    text: str
    folder: Path = DEPLOY
    ticks: int = 120
    happens: tuple[str, ...] = ()
    """Slots of which some entity's is not zero at some time: without that a world proves nothing."""


class Ran(NamedTuple):
    """A run: its result, its frames, the fates of all packets, and what its capture has of the world."""

    result: Rehearsed
    frames: list[Frame]
    fates: list[Any]
    captured: dict[str, list[tuple[int, int, bytes]]]

    @property
    def digests(self) -> list[bytes]:
        return self.result.digests


def deployed(name: str, ticks: int, *happens: str, sets: Sequence[str] = (), folder: Path = DEPLOY) -> World:
    return World(apply_sets((folder / name).read_text(), str(folder / name), sets), folder, ticks, happens)


@cache
def world_of(name: str) -> World:
    match name:
        case "mixed":
            return World(mixed(), happens=("contacts", "drive.delay.ticks", "skin.inside_ticks"))
        case "everything":
            return World(yard(), assets(), 120, ("contacts", "blocked", "go.failure", "absent", "down", "middle.count"))
        case "living":
            return deployed("living.yaml", 120, "contacts", "absent", "go.jobs_running", folder=SWARM)
        case "table" | "table_sensors":
            return deployed(f"{name}.yaml", 250, "contacts", sets=PLAY)
        case "table in the pure engine":
            return deployed("table.yaml", 250, "contacts", sets=(*PLAY, "engine=pure"))
        case "warehouse":
            return deployed("warehouse.yaml", 60, "wheel_speeds")
        case _:
            return deployed(f"{name}.yaml", 150, "contacts")


WORLDS: Final = (
    *("table", "table_sensors", "table in the pure engine", "warehouse", "yard", "workshop"),
    *("mixed", "everything", "living"),
)


def run(world: World, nodes: int, sets: Sequence[str] = (), capture: Path | None = None, **how: Any) -> Ran:
    """Rehearse a world; return the result with all frames, the fates of all packets, and what was captured."""
    frames, fates = Frames(), list[Any]()

    def close(closing: Closing) -> None:
        fates.extend(
            (one.source, one.destination, one.channel, one.sequence, one.copy, one.cause, one.due_ns, one.payload)
            for one in closing.fates
        )

    settings = Settings(on_commit=frames, on_closing=close, weather=how.pop("weather", CALM), keeps_journals=True)
    found = rehearse(world.text, NAME, world.ticks, nodes, sets, settings, capture=capture, folder=world.folder, **how)
    assert not found.json["failed"] and found.json["ticks"] == world.ticks, found.json["reason"]
    captured = messages_of(capture) if capture is not None else {}
    return Ran(found, frames.frames, fates, {topic: captured[topic] for topic in OF_THE_WORLD if topic in captured})


@cache
def alone(name: str) -> Ran:
    """Return a world on one node, where nothing is lost; enough happens in it."""
    with TemporaryDirectory() as folder:
        found = run(world_of(name), 1, PATIENT, Path(folder) / "alone.mcap")
    frames = found.frames
    for slot in world_of(name).happens:
        places = [entity.offsets[slot] for entity in frames[0].layout.entities if slot in entity.offsets]
        assert any(frame.numbers[at] for frame in frames for at in places), f"{name}: {slot}"
    return found


def loaded(name: str) -> Deployment:
    """Return a world's deployment with its files."""
    text, files = pin_assets(world_of(name).text, NAME, world_of(name).folder)
    return load_deployment(text, NAME).with_assets(files)


def disturb(system: System, seed: int, ticks: int) -> None:
    """Move robots and make engines anew, lose nodes, supervisor and vHub and bring them back, at drawn ticks."""
    shuffle(system, seed=seed, ticks=ticks)
    draw = Random(seed)

    def lose(node: str) -> None:
        if node not in system.processes:
            system.start(node)
        elif len(system.supervisor.state.members) > 1:
            system.kill(node)

    def lose_supervisor() -> None:
        system.kill(SUPERVISOR)
        system.later(BACK_NS, partial(system.start, SUPERVISOR))

    system.at_tick(draw.randrange(4, ticks - 20), lose_supervisor)
    for number in range(9):
        system.at_tick(draw.randrange(4, ticks - 20), partial(lose, f"n{1 + number % 3}"))
    for ending in ENDINGS:
        system.at_tick(draw.randrange(4, ticks - 20), partial(system.kill_hub, ending, BACK_NS))


@pytest.mark.parametrize("name", WORLDS)
@pytest.mark.parametrize("seed", [7, *(pytest.param(seed, marks=pytest.mark.campaign) for seed in range(1, 9))])
def test_nodes_moves_losses_and_a_bad_bus_give_the_same_world(name: str, seed: int, tmp_path: Path) -> None:
    """To the last bit, packet and row."""
    world, usual, deployment = world_of(name), alone(name), loaded(name)
    path, weather = tmp_path / "run.mcap", Weather(seed, delay_ns=100_000, spread_ns=2_000_000, loss=0.01, repeat=0.05)
    prepare = partial(disturb, seed=seed, ticks=world.ticks)
    many = run(world, 3, PATIENT, path, weather=weather, prepare=prepare)
    where = next((at + 1 for at, (a, b) in enumerate(zip(usual.digests, many.digests, strict=True)) if a != b), None)
    assert where is None, f"seed {seed}"
    assert many.fates == usual.fates and len(usual.fates) > 100
    result = many.result.json
    for key in ("packets", "summary", "digest"):
        assert result[key] == usual.result.json[key], key
    assert result["handovers"] + result["moves"] > 0
    assert {entry["what"] for entry in result["recoveries"]} >= {"node", "join", "vhub", "supervisor"}
    assert many.captured == usual.captured and {"/tick", "/frame", "/packets"} <= many.captured.keys()
    assert_repeats(path, Random(seed), usual)
    assert [wrong for frame in usual.frames[::4] for wrong in strays(deployment, frame)] == [], "out of bounds"
    with Simulation(deployment, agents=[], network=True) as simulation:
        for digest in usual.digests:
            simulation.step()
            assert simulation.frame.digest == digest, f"stepped, at tick {simulation.tick}"


def assert_repeats(path: Path, draw: Random, usual: Ran) -> None:
    """Hold that a capture is simulated again, from its start and from frames within, and its packets judged again."""
    verified, capture, ticks = verify_capture(path, 1), open_capture(path), len(usual.digests)
    assert verified.equal and verified.ticks == ticks and verified.other_arithmetic == ()
    assert verified.chain.hex() == usual.result.json["digest"]["chain"]
    judged = what_if(capture)
    assert (judged.changed, judged.inputs_changed) == (0, 0) and judged.packets == len(capture.packets)
    frames, inputs, between = list(capture.each_frame()), list(capture.captured_ticks()), Between(capture.about)
    for start in (*draw.choices(frames[:-1], k=2), frames[0]):
        until = draw.randrange(start.tick + 1, ticks + 1)
        found = between(start, inputs[start.tick + 1 : until + 1])
        assert found is not None and found.digest == usual.digests[until - 1], f"from {start.tick} to {until}"
    between.close()


def test_on_many_nodes_without_losses() -> None:
    """Engines that are never rebuilt have other pasts than rebuilt ones."""
    for name in ("table", "everything"):
        assert run(world_of(name), 5, PATIENT).digests == alone(name).digests, name


# --- every component type ------------------------------------------------------------------------------------------

WHOLE: Final = ("mixed", "everything")


def test_every_form_is_in_a_world_of_all_or_has_its_laws_tested_alone() -> None:
    used: set[tuple[str, str]] = set()
    for name in WHOLE:
        used |= {(one.type_name, one.name) for one in component_types_of(loaded(name))}
    assert set(own()) - used == {*ALONE}


@pytest.mark.parametrize("name", WHOLE)
def test_all_of_it_moves_measures_and_obeys_the_laws(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Other names, further robots, what comes and goes, readings alone and together. More nodes are above."""
    monkeypatch.setattr(component_check, "NODES", (2,))
    world = world_of(name)
    assert still(loaded(name), alone(name).frames) == set()
    text, files = pin_assets(world.text, NAME, world.folder)
    check = ComponentCheck(text, NAME, world.ticks, files=files, run=partial(rehearse, folder=world.folder))
    assert list(check.broken()) == []
    assert name != "mixed" or list(elsewhere(text, NAME, world.ticks, check.first)) == []


def test_who_is_absent_is_nowhere_and_remembers_nothing() -> None:
    """Its slots are those of any absent entity, but for the counters of its samples, which never go back."""
    seen = 0
    for name in ("everything", "living"):
        frames = alone(name).frames
        layout = frames[0].layout
        counted = dict.fromkeys((at for entity in layout.entities for at in counters(entity)), 0.0)
        for frame in frames:
            for at in counted:
                assert frame.numbers[at] >= counted[at]
                counted[at] = frame.numbers[at]
            for entity in layout.entities:
                if entity.is_absent(frame.numbers):
                    seen += 1
                    of_absent = parked(layout, entity)
                    for at in sorted({*range(entity.start, entity.stop)} - {*counters(entity)}):
                        assert frame.numbers[at] == of_absent[at - entity.start], (frame.tick, entity.name)
                    refers = [at for at in layout.references if entity.start <= at < entity.stop]
                    assert [frame.numbers[at] for at in refers] == [NO_ENTITY] * len(refers)
                    assert entity.index not in frame.outboxes
    assert seen > 500


def test_a_kit_changes_nothing_of_another() -> None:
    """The ball rolls, and rods move, beside rovers as without them; what refers to an entity refers to the same one."""
    data = yaml.safe_load(mixed())
    for name in ("rover-1", "rover-2", "charger"):
        del data["robots"][name]
        data["players"].pop(f"{name}-driver", None)
    del data["hall"]
    data["nodes"] = {"all": {"robots": sorted(data["robots"])}}
    frames = run(World(written(data)), 1).frames
    assert of_table(frames) == of_table(alone("mixed").frames)


def of_table(frames: Sequence[Frame]) -> list[list[float | str]]:
    """Return what each frame has of some entities, with the names of those to which it refers."""
    found = []
    for frame in frames:
        layout = frame.layout
        numbers: list[float | str] = [float(number) for number in frame.numbers]
        for place in layout.references:
            number = float(frame.numbers[place])
            numbers[place] = layout.entities[int(number)].name if number >= 0.0 else ""
        names = ("ball", "red.goal", "blue.attack", "world")
        found.append([n for name in names for n in numbers[layout[name].start : layout[name].stop]])
    return found


def holders(frame: Frame) -> str:
    """Return the numbers of the cranes that hold the load."""
    load = frame.layout["load"].index
    return "".join(number for number in "12" if frame.at(f"crane-{number}", "gripper.held") == load)


def test_what_is_held_is_in_the_island_of_its_holders_and_is_handed_over() -> None:
    frames = alone("everything").frames
    assert list(dict.fromkeys(map(holders, frames))) == ["", "1", "12", "2"] and holders(frames[-1]) == ""
    deployment, layout = loaded("everything"), frames[0].layout
    kept, nearest = Volumes(deployment, layout), set[str]()
    for frame in [*frames[::3], *Random(7).sample(frames, 9)]:
        islands = kept.islands(frame.numbers)
        assert islands == Volumes(deployment, layout).islands(frame.numbers), "what is kept of boxes changes no island"
        (island,) = [one for one in islands if layout["load"].index in one.entities]
        assert {layout[f"crane-{holder}"].index for holder in holders(frame)} <= {*island.entities}
        nearest.add(island.nearest)
    assert nearest == {"crane-1", "crane-2"}


# --- planted faults --------------------------------------------------------------------------------------------------
# Faults of the engines are planted in `test_engine_partition.py`, of speaking and committing in `tests/gate/`.


def rebuild_all(system: System) -> None:
    """Make the engines of all nodes anew every 20 ticks, so that some are made amid each grasp."""
    for tick in range(10, 110, 20):
        for solver in system.solvers.values():
            system.at_tick(tick, solver.rebuild)


def differs(name: str) -> bool:
    """Return whether a world on two nodes whose engines are made anew differs from the one on one node."""
    return run(world_of(name), 2, PATIENT, prepare=rebuild_all).digests != alone(name).digests


def test_without_a_fault_nothing_differs() -> None:
    assert not differs("everything") and not differs("table in the pure engine")


def test_a_draw_from_a_running_generator_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    dice = np.random.default_rng(1)
    monkeypatch.setattr(NoiseKeys, "normal", lambda self, counter, width, slot=0: dice.normal(size=(len(self), width)))
    assert differs("table in the pure engine")


def test_an_island_split_between_two_solvers_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    divide = Assignment._divide

    def split(self: Assignment, islands: tuple[Island, ...]) -> dict[str, Share]:
        """Give the ball to the last node, its rods to their owners."""
        parts: list[Island] = []
        for island in islands:
            names = {index: self.layout.entities[index].name for index in island.entities}
            parts += [Island((index,), name if name in self.owners else "") for index, name in names.items()]
        return divide(self, tuple(parts))

    monkeypatch.setattr(Assignment, "_divide", split)
    assert differs("table in the pure engine")


def test_an_engine_that_remembers_a_grasp_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    honest, remembered = CompositionEngine._weld, dict[CompositionEngine, list[float]]()

    def weld(self: CompositionEngine, number: int, at: Any, turned: Any, grasp: Sequence[float]) -> None:
        honest(self, number, at, turned, remembered.setdefault(self, [*grasp]))

    def remember(self: CompositionEngine, seats: Any, drives: Any, numbers: list[float], start: Any) -> None:
        """Take another pose of the grasp with each new engine."""
        for at in seats.grasps if self not in seen else ():
            numbers[at] += 1e-6
        seen.add(self)
        load(self, seats, drives, numbers, start)

    seen, load = set[CompositionEngine](), CompositionEngine.load
    monkeypatch.setattr(CompositionEngine, "_weld", weld)
    monkeypatch.setattr(CompositionEngine, "load", remember)
    assert differs("everything")


def test_rest_that_is_not_in_the_frame_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """A node that counts in an object for how long bodies were slow forgets it when the object is made anew."""

    def may_rest(self: Rest, bodies: Sequence[Entity], *_: object) -> bool:
        for entity in bodies:
            slow[self, entity.index] = slow.get((self, entity.index), 0) + 1
        return all(slow[self, entity.index] >= self.ticks for entity in bodies)

    slow: dict[tuple[Rest, int], int] = {}
    monkeypatch.setattr(Rest, "may_rest", may_rest)
    one = run(world_of("yard"), 1, PATIENT).digests
    assert run(world_of("yard"), 2, PATIENT, prepare=rebuild_all).digests != one


@pytest.mark.parametrize(("nodes", "caught"), [(1, Malformed), (3, Stuck)])
def test_a_body_that_anothers_island_holds_is_caught(
    nodes: int, caught: type[Exception], monkeypatch: pytest.MonkeyPatch
) -> None:
    """None of its numbers has two writers: parts of two nodes that hold one body make no frame."""
    honest = Volumes.islands

    def holding(self: Volumes, numbers: Sequence[float]) -> list[BodyIsland]:
        box = self._layout["load"].index
        return [
            replace(island, entities=tuple(sorted({*island.entities, box}))) if island.nearest == "arm" else island
            for island in honest(self, numbers)
        ]

    monkeypatch.setattr(Volumes, "islands", holding)
    with pytest.raises(caught):
        run(world_of("everything"), nodes)
