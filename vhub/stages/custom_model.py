"""Custom link model: a user's code decides packets that have passed the stages before.

It gets the world of the newest frame, the packet's own draws and its memory of the packet before; its answer is
checked. A model that raises or gives an invalid answer is a failure of the run: the packet is lost (`model_failed`),
and the vHub ends the run in order. Neighbour: `network/custom_models` (the interface of a model, and its loading).
"""

from __future__ import annotations

from math import isfinite, sqrt
from typing import Any, Final

from msgspec import msgpack

from foosim.common import limits
from foosim.common.errors import show
from foosim.vhub.line_of_sight.occlusion import Trace
from foosim.vhub.network.custom_models import VERSION_KEY, End, Judged, LinkModel, Passage, Wall
from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.network.packet import Flight
from foosim.vhub.radio.propagation import crossing_db
from foosim.vhub.stages.explanation import Explanation, Seen
from foosim.vhub.stages.stage import Stage

MODEL: Final = "model"
MODEL_FAILED: Final = "model_failed"
MODEL_BLOCK: Final = 2
"""The block of a packet's draws for its link model, which no other stage uses."""
EXTRA_NS_MAX: Final = 60_000_000_000
SHOWN_MAX: Final = 300
"""Characters of a model's exception that are reported."""
DEPTH_MAX: Final = 16
"""Of lists and dicts in a memory."""


class CustomModel(Stage):
    """Calls the model of one link."""

    def __init__(self, setup: LinkSetup, model: LinkModel) -> None:
        self._setup, self._model = setup, model
        settings, world = setup.settings, setup.world
        x, y, z = settings.antenna.mount
        self._mount = x, y, z
        self._frequency_hz = settings.frequency_hz
        self._bodies = frozenset((world.body(setup.source), world.body(setup.destination)))
        self._trace = Trace()

    @classmethod
    def for_link(cls, setup: LinkSetup) -> CustomModel | None:
        return None if setup.model is None else cls(setup, setup.model)

    def at_sending(self, flight: Flight) -> str:
        memory = self._setup.memory
        try:
            judged = self._model.judge(self._passage(flight), msgpack.decode(memory.model) if memory.model else None)
            problem = problem_of(judged)
            kept = b"" if problem else _kept(judged.memory)
        except Exception as error:  # noqa: BLE001  # raised by a user's code
            problem = f"{type(error).__name__}: {show(str(error), SHOWN_MAX)}"
        if problem:
            self._report(flight, problem)
            return MODEL_FAILED
        memory.model = kept
        flight.model_ns = judged.extra_ns
        return MODEL if judged.is_dropped else ""

    def explain(self, seen: Seen, note: Explanation) -> None:
        model = self._setup.settings.model
        assert model is not None, "a link with a model of one's own"
        package = seen.evidence.versions.get(VERSION_KEY + model.name, "")
        note.add("{model} of {package}", model=model.name, parameters=dict(model.parameters), package=package)
        failed = ", which failed" if seen.row.cause == MODEL_FAILED else ""
        note.add("{}, {extra_ns} more delay", failed, extra_ns=seen.row.model_ns)

    def _passage(self, flight: Flight) -> Passage:
        source, destination = self._end(flight.source), self._end(flight.destination)
        a, b = sorted((source.position_m, destination.position_m))
        dx, dy, dz = a[0] - b[0], a[1] - b[1], a[2] - b[2]
        walls = tuple(
            Wall(crossing.name, crossing.chord_m, crossing_db(crossing, self._frequency_hz))
            for crossing in self._setup.world.crossings(a, b, self._bodies, self._trace)
        )
        return Passage(
            source,
            destination,
            flight.channel,
            flight.sequence,
            flight.copy,
            flight.sent_ns,
            flight.size,
            sqrt(dx * dx + dy * dy + dz * dz),
            walls,
            self._setup.words(flight, MODEL_BLOCK),
        )

    def _end(self, endpoint: str) -> End:
        world = self._setup.world
        return End(endpoint, world.antenna(endpoint, self._mount), world.velocity(endpoint))

    def _report(self, flight: Flight, problem: str) -> None:
        """End the run at the first failure: its network would not be the requested one."""
        model, faults = self._setup.settings.model, self._setup.faults
        if model is not None and not faults:
            packet = f"{flight.source}:{flight.sequence}:{flight.destination}" + (":1" if flight.copy else "")
            when = f"sent at {flight.sent_ns / 1e9:.9g} s on {flight.channel}"
            faults.append(f"link model {model.name} failed on packet {packet}, {when}: {problem}")


def problem_of(answer: object) -> str:
    """Return what is wrong with a model's answer; empty for a valid one."""
    if not isinstance(answer, Judged):
        return f"it returns {type(answer).__name__}, not Judged"
    fields: tuple[Any, ...] = answer  # a tuple holds values of any type
    is_dropped, extra_ns, memory = fields
    if not isinstance(is_dropped, bool):
        return f"is_dropped is {show(is_dropped)}, not True or False"
    if type(extra_ns) is not int or not 0 <= extra_ns <= EXTRA_NS_MAX:
        return f"extra_ns is {show(extra_ns)}, not a whole number from 0 to {EXTRA_NS_MAX}"
    return _unplain(memory, DEPTH_MAX)


def _unplain(value: Any, depth: int) -> str:
    """Return the first part of a memory without a plain type: a journal restores only plain values unchanged."""
    if isinstance(value, int):
        return "" if -(2**63) <= value < 2**64 else "memory has a whole number of more than 64 bits"
    if value is None or isinstance(value, str):
        return ""
    if isinstance(value, float):
        return "" if isfinite(value) else f"memory has {value}"
    if not isinstance(value, list | tuple | dict) or depth == 0:
        return f"memory has {type(value).__name__}" + ("" if depth else f", more than {DEPTH_MAX} deep")
    if isinstance(value, dict) and not all(isinstance(key, str) for key in value):
        return "memory has a dict whose keys are not all texts"
    inner = value.values() if isinstance(value, dict) else value
    return next((problem for problem in (_unplain(one, depth - 1) for one in inner) if problem), "")


def _kept(memory: Any) -> bytes:
    """Return a memory as bytes; raises ValueError when there are too many."""
    kept = b"" if memory is None else msgpack.encode(memory)
    if len(kept) > limits.MODEL_MEMORY_BYTES_MAX:
        raise ValueError(f"memory has {len(kept)} bytes, at most {limits.MODEL_MEMORY_BYTES_MAX} are kept")
    return kept
