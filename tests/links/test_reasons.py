"""What a captured packet's fate came from: for each cause the stage that dropped it, with the numbers that decided."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import msgspec
import pytest

from foosim.analysis.explain import PacketName, Step, explain_packet
from foosim.capture.reader import CaptureData, open_capture
from foosim.capture.rows import PACKETS, PacketRow
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from foosim.vhub.recording.model_hash import model_hash
from foosim.vhub.recording.rows_of_closing import DECIDING
from foosim.vhub.stages import STAGES as PIPELINE
from tests.links.offered import TABLE
from tests.turns import BY_PERIOD

NETWORK: Final = """network={
  radios: {
    lora: {preset: lora_eu868, duty_cycle: 100 %, bandwidth: 500 kHz},
    slow: {preset: lora_eu868, duty_cycle: 100 %, bandwidth: 500 kHz, spreading_factor: 8, air: lora},
    law: {preset: lora_eu868, duty_cycle: 0.01 %, duty_window: 20 s},
    zigbee: {preset: zigbee, tx_power: -40 dBm},
    near: {preset: range_only, path_loss: {range: 1 m}},
    far: {preset: dot11p, sensitivity: -10 dBm},
    wire: {preset: perfect}},
  robots: {"*": [lora, slow, law, zigbee, near, far, wire]},
  places: {camera: [0 m, 0 m, 2 m], "player*": [3 m, 0 m, 1 m]},
  links: [
    {id: law, from: red.goal, to: "*", via: law},
    {id: sf8, from: red.attack, to: "*", via: slow},
    {id: near, from: blue.defence, to: "*", via: near},
    {id: out, from: blue.midfield, to: "*", via: wire, outages: {mean_on: 50 ms, mean_off: 20 ms},
     corrupt: {bit_error_rate: 0.3 %}, duplicate: 50 %},
    {id: lora, from: "red.*", to: "*", via: lora},
    {id: zigbee, from: "blue.*", to: "*", via: zigbee},
    {id: back, from: player-blue, to: "*", via: zigbee},
    {id: far, from: player-red, to: "red.*", via: far},
    {id: full, from: camera, to: player-red, via: wire, rate: 10 kbit/s, queue: {packets: 2}},
    {id: camera, from: camera, to: player-blue, via: wire, delay: 30 ms, corrupt: {bit_error_rate: 0.3 %}},
    {id: end, from: "*", to: "*", via: wire}],
  events: [
    {at: 300 ms, partition: [[camera], [player-blue]], for: 40 ms},
    {at: 350 ms, set: {link: full, queue: {packets: 50, drop: codel, codel_target: 1 ms, codel_interval: 5 ms}}}]}"""


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> CaptureData:
    """A run in which packets are lost by nearly every cause."""
    return captured(NETWORK, tmp_path_factory.mktemp("reasons") / "run.mcap")


def captured(network: str, path: Path) -> CaptureData:
    text = apply_sets(TABLE.read_text(), "t.yaml", [*BY_PERIOD, network])
    rehearse(text, "t.yaml", 260, 1, ["engine=pure"], Settings(), capture=path)
    return open_capture(path)


Lost = dict[tuple[str, str, str], list[PacketRow]]
"""Rows of dropped packets by rule, cause and collision."""


@pytest.fixture(scope="module")
def lost(capture: CaptureData) -> Lost:
    found: Lost = {}
    for row in capture.rows(PACKETS):
        assert isinstance(row, PacketRow)
        if row.fate == "dropped":
            found.setdefault((row.rule, row.cause, row.decided_by.collision), []).append(row)
    return found


def steps(capture: CaptureData, row: PacketRow) -> dict[str, Step]:
    explained = explain_packet(capture, PacketName(row.source, row.sequence, row.destination, row.copy))
    assert explained.agrees
    return {step.stage: step for step in explained.steps}


STAGES: Final[dict[tuple[str, str, str], str]] = {
    ("back", "queue_full", ""): "queue",
    ("camera", "crc_fail", ""): "corruption",
    ("camera", "partition", ""): "policy",
    ("far", "out_of_range", ""): "channel",
    ("full", "queue_codel", ""): "queue",
    ("full", "queue_full", ""): "queue",
    ("law", "duty_cycle", ""): "duty",
    ("lora", "collision", "interference"): "channel",
    ("near", "out_of_range", ""): "channel",
    ("out", "burst_loss", ""): "residual",
    ("zigbee", "collision", "contention"): "medium",
    ("zigbee", "collision", "half_duplex"): "channel",
}


def test_the_stage_that_drops_is_named(capture: CaptureData, lost: Lost) -> None:
    assert lost.keys() >= STAGES.keys()
    for (rule, cause, collision), stage in STAGES.items():
        told = steps(capture, lost[rule, cause, collision][0])
        assert [name for name, step in told.items() if step.outcome == "dropped"] == [stage], (rule, cause, collision)
        assert told[stage].text.endswith(f": {cause}")


def facts_of(capture: CaptureData, rows: list[PacketRow]) -> list[dict[str, Any]]:
    """Return what the stage that dropped each found."""
    return [next(step.facts for step in steps(capture, row).values() if step.outcome == "dropped") for row in rows[:4]]


DECIDED: Final[dict[tuple[str, str, str], Callable[[dict[str, Any]], bool]]] = {
    ("back", "queue_full", ""): lambda f: f["packets"] == f["packets_max"] == 10,
    ("camera", "crc_fail", ""): lambda f: f["error_draw"] < f["error_rate"] == pytest.approx(1 - 0.997**192),
    ("camera", "partition", ""): lambda f: "event 0" in (f["cut_at_sending"], f.get("cut_at_arrival")),
    ("far", "out_of_range", ""): lambda f: f["received_dbm"] < f["sensitivity_dbm"] == -10.0,
    ("full", "queue_codel", ""): lambda f: f["above_ns"] >= f["interval_ns"] and f["drops"] > 0 < f["packets"],
    ("full", "queue_full", ""): lambda f: f["packets"] == f["packets_max"] == 2,
    ("law", "duty_cycle", ""): lambda f: f["left_ns"] < f["airtime_ns"] == 51_456_000 and f["left_ns"] > 0,
    ("near", "out_of_range", ""): lambda f: f["distance_m"] > f["range_m"] == 1.0,
    ("out", "burst_loss", ""): lambda f: f == {"outage": True},
    ("zigbee", "collision", "half_duplex"): lambda f: f["half_duplex"] and f["interference_dbm"] is None,
    ("zigbee", "collision", "contention"): lambda f: f["attempts"] in (["collision"], ["the channel was never free"]),
}


@pytest.mark.parametrize("key", DECIDED, ids=" ".join)
def test_the_numbers_that_decided_are_told(capture: CaptureData, lost: Lost, key: tuple[str, str, str]) -> None:
    for facts in facts_of(capture, lost[key]):
        assert DECIDED[key](facts), facts


def test_interference_of_stations_that_do_not_hear_one_another_is_told(tmp_path: Path) -> None:
    capture = captured(NETWORK.replace("tx_power: -40 dBm", "tx_power: -56 dBm"), tmp_path / "run.mcap")
    rows = [row for row in capture.rows(PACKETS) if isinstance(row, PacketRow)]
    spoiled = [row for row in rows if (row.rule, row.decided_by.collision) == ("zigbee", "interference")]
    assert {steps(capture, row)["channel"].outcome for row in spoiled} == {"dropped"}
    for facts in facts_of(capture, spoiled):
        assert facts["error_draw"] < facts["error_rate"] and facts["sinr_db"] < facts["snr_db"]


def test_interference_of_lora_is_told_by_spreading_factor(capture: CaptureData, lost: Lost) -> None:
    rows = lost["lora", "collision", "interference"]
    by_both = next(row for row in rows if row.decided_by.by_factor_cdbm[0] and row.decided_by.by_factor_cdbm[1])
    for facts in facts_of(capture, [by_both, *rows]):
        assert any(other["ratio_db"] < other["needed_db"] for other in facts["others"].values())
    others = facts_of(capture, [by_both])[0]["others"]
    assert (others[7]["needed_db"], others[8]["needed_db"]) == (6.0, -16.0)


def test_who_does_not_get_as_far_as_copying_has_no_copy(capture: CaptureData, lost: Lost) -> None:
    told = steps(capture, lost["out", "crc_fail", ""][0])
    assert "copy" not in told["corruption"].text and "is below" in told["corruption"].text


def test_fields_of_other_causes_are_left_out(capture: CaptureData) -> None:
    """A row of a packet that is delivered has nothing of them in the file."""
    for row in capture.rows(PACKETS):
        content = msgspec.json.decode(msgspec.json.encode(row))
        if content["fate"] == "dropped":
            names = {*DECIDING.get(content["cause"], ()), *(["collision"] if content["cause"] == "collision" else [])}
        else:
            names = set()
        assert content.get("decided_by", {}).keys() - {"by_factor_cdbm"} <= names, content
        assert "by_factor_cdbm" not in content.get("decided_by", {}) or content["rule"] in ("lora", "sf8")


def test_stages_are_told_in_their_order(capture: CaptureData, lost: Lost) -> None:
    assert list(steps(capture, lost["law", "duty_cycle", ""][0])) == [name for name, _, _ in PIPELINE]


def test_one_hash_is_that_of_a_model(capture: CaptureData) -> None:
    """Whatever else a deployment says; another network, or another seed, is another model."""
    text = capture.about.deployment_text

    def hashed(*sets: str) -> str:
        return model_hash(load_deployment(apply_sets(text, "t.yaml", list(sets)), "t.yaml"))

    assert capture.about.metadata["model_hash"] == hashed() == hashed("pace=fast") == hashed("scenery={}")
    assert len({hashed(), hashed("seed=2"), hashed("network.links.lora.loss=1 %"), hashed("network.events=[]")}) == 4
