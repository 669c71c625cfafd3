"""Processes that are killed between a request's answer and the tick at which it takes effect, in a run of real ones."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Any, Final

from foosim.capture.reader import open_capture
from foosim.client.client import connect
from foosim.client.control import Control
from foosim.simulation.verify import verify_capture
from tests.kinematic_yard import yard_text
from tests.wire.conftest import LIMIT_S, LONG, in_process
from tests.wire.test_run import last_json

if TYPE_CHECKING:
    from foosim.client.client import CalledJob
    from tests.wire.conftest import House

VICTIMS: Final = {5: "b", 15: "supervisor", 25: "vhub"}
"""Who is killed while the run waits for its client at a tick."""
TICKS: Final = 40
BASE: Final = {"model": "holonomic", "radius": "20 cm"}
GO: Final = {
    "actuators": {"go": {"kind": "go_to"}},
    "sensors": {"jobs": {"kind": "job", "actuator": "go", "rate": "50 Hz"}},
}


def yard() -> str:
    """A base with jobs, carts that come and go, a fire that is set, two nodes, a client that holds each tick."""
    return yard_text(
        {
            "base": {**BASE, **GO, "at": {"x": "-3 m"}},
            "cart": {**BASE, "count": 3, "spare": 3, "spacing": {"y": "1 m"}, "at": {"x": "3 m"}},
        },
        objects={"fire": {"model": "fire", "radius": "0 m", "radius_max": "9 m", "at": {"y": "9 m"}}},
        clients={"hand": {"lockstep": True, "rate": "100 Hz"}},
        nodes={"a": {"robots": ["base"]}, "b": {"robots": ["cart-*"]}},
        capture={"frames_every": "1 tick"},
    )


def requests(number: int) -> tuple[tuple[str, dict[str, Any], str, tuple[float, float]], ...]:
    """Verbs and arguments, the field that each changes, and what it is before and after."""
    return (
        ("add", {"name": f"cart-{3 + number}"}, "absent", (1.0, 0.0)),
        ("remove", {"name": f"cart-{number}"}, "absent", (0.0, 1.0)),
        ("set", {"name": "fire", "field": "radius", "value": f"{number} m"}, "radius", (number - 1.0, float(number))),
    )


def test_what_was_answered_takes_effect_at_its_tick_whoever_is_killed_before(house: House) -> None:
    """An addition, a removal and a setting are requested and a job is called while the run waits for the client, and a
    process is killed before it goes on."""
    file = house.folder / "yard.yaml"
    file.write_text(yard())
    apart = *in_process("null", "supervisor", "vhub"), *in_process("main", "nodes.a")
    run = "--pace", "fast", "--for", f"{10 * TICKS} ms", "--json", "--capture", "run.mcap"
    up = house.start("foosim", "up", file, "--set", LONG, *run, *apart)
    effects: list[tuple[int, str, str, tuple[float, float]]] = []
    jobs: list[CalledJob] = []
    info = house.info()
    with Control(info.simulation) as control, connect(info.radio, "hand", timeout_s=LIMIT_S) as client:
        client.subscribe("base", "jobs")
        for tick in client.lockstep():
            if tick not in VICTIMS:
                continue
            number = len(jobs) + 1
            for verb, arguments, field, values in requests(number):
                answer = control.request(verb, LIMIT_S, **arguments)
                assert answer.tick >= tick, "the run waits"
                effects.append((answer.tick, arguments["name"], field, values))
            jobs.append(client.robots["base"].actuators["go"].call(x=float(number), y=1.0))
            house.kill(VICTIMS[tick])
    code, out, err = house.end(up)
    assert code == 0, err
    assert {entry["what"] for entry in last_json(out)["recoveries"]} >= {"node", "supervisor", "vhub"}
    path = house.folder / "run.mcap"
    frames = list(open_capture(path).each_frame())
    assert [frame.tick for frame in frames] == list(range(TICKS + 1))
    for tick, name, field, values in effects:
        assert [frames[at].at(name, field) for at in (tick, tick + 1)] == list(values), (tick, name)
    begun = [int(frame.at("base", "go.jobs_numbers")) for frame in frames]
    assert [number for number, _ in groupby(begun)] == [0, *[job.number for job in jobs]], "each job begins once"
    assert verify_capture(path, 2).equal
