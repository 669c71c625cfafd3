"""The command `foosim net` without a run of processes: what it prints, what it refuses, exit codes."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import pytest
import yaml

from foosim.analysis.explain import PacketName, explain_packet, parse_packet
from foosim.analysis.network_tables import link_line, links_shown, use_text
from foosim.capture.reader import CaptureData, open_capture
from foosim.capture.rows import PACKETS, PacketRow
from foosim.common.errors import DeploymentError
from foosim.deployment.loader import load_deployment
from foosim.deployment.network.presets import PRESETS
from foosim.deployment.overrides import nested
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings, System
from foosim.vhub.stages import STAGES
from tests.conftest import Command, Typed

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
NETWORK: Final[Mapping[str, Any]] = {
    "radios": {"wifi": {"preset": "wifi_5_indoor"}, "lora": {"preset": "lora_eu868"}, "wire": {"preset": "wired_1g"}},
    "robots": {"red.*": ["wifi"], "blue.*": ["lora"], "camera": ["wifi", "wire"], "player-red": ["wifi"],
               "player-blue": ["lora", "wire"]},
    "places": {"camera": ["0 m", "3 m", "2 m"], "player-*": ["4 m", "5 m", "1 m"]},
    "links": [{"id": "seen", "from": "camera", "to": "player-red", "loss": "5 %", "ttl": "3 ms", "duplicate": "10 %",
               "burst": {"loss": "30 %", "mean_bad": "40 ms", "bad_loss": "70 %", "bad_extra_delay": "5 ms"}}],
}  # fmt: skip
WALL: Final = {
    "shape": "box", "x": "2 m", "y": "2 m", "length": "0.2 m", "width": "8 m", "height": "3 m", "surface": "walls",
    "radio": "concrete",
}  # fmt: skip
TICKS: Final = 320


@pytest.fixture
def command(typed: Typed) -> Command:
    """Runs `foosim net`."""
    return typed("net")


def text_of(**network: Any) -> str:
    content = yaml.safe_load(TABLE.read_text())
    content["robots"]["camera"]["sensors"]["ball"]["modifiers"] = []  # it gives its first picture at tick 0
    content |= {"engine": "pure", "network": {**NETWORK, **network}, "scenery": {"wall": WALL}}
    return yaml.safe_dump(content)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A capture of radios and a wire, in which much went wrong; a clog and a heal were asked for."""
    path = tmp_path_factory.mktemp("capture") / "run.mcap"

    def prepare(system: System) -> None:
        event = {"clog": {"from": "camera", "to": "player-blue"}}
        system.at_tick(100, lambda: system.request("network", event=event))
        system.at_tick(130, lambda: system.request("network", event={"heal": "all"}))
        cut = {"partition": [["camera"], ["rest"]], "for": "80 ms"}
        system.at_tick(200, lambda: system.request("network", event=cut))

    rehearse(text_of(), "demo.yaml", TICKS, 1, (), Settings(), prepare=prepare, capture=path)
    return path


@pytest.fixture(scope="module")
def capture(path: Path) -> CaptureData:
    return open_capture(path)


# --- lint and presets ------------------------------------------------------------------------------------------------


def test_lint_prints_a_line_for_each_rule_and_radio(command: Command, tmp_path: Path) -> None:
    file = tmp_path / "demo.yaml"
    file.write_text(text_of())
    done = command("lint", file)
    assert done.code == 0 and done.err == ""
    names = [line.split(":")[0] for line in done.out.splitlines() if not line.startswith("  ")]
    assert names == ["seen via wifi", "lora", "no_radio", "wifi", "wire", "ranges"]
    content = json.loads(command("lint", file, "--json", "--set", "network.links.seen.loss='40 %'").out)
    seen = content["rules"][0]
    assert not content["alone"] and seen["loss"] == pytest.approx(1 - 0.7 * 0.6) and seen["links"] == 1


def test_lint_of_a_network_alone_says_what_it_cannot_know(command: Command, tmp_path: Path) -> None:
    file = tmp_path / "network.yaml"
    file.write_text(yaml.safe_dump({"network": {**NETWORK, "robots": {"anybody*": ["wifi"]}}}))
    done = command("lint", file)
    assert done.code == 0
    assert done.out.startswith("a network section without its deployment: the selectors match no endpoints")

    def problems_of(text: str) -> list[str]:
        file.write_text(text)
        done = command("lint", file)
        assert done.code == 2
        return [line.split(": ", 1)[1] for line in done.err.splitlines()]

    network = "network:\n  radios:\n    wifi: {preset: wifi_5, loss: 2}\n  links:\n  - {id: x, from: a, via: wif}\n"
    assert problems_of(network) == [
        "network.radios.wifi.preset: not one of perfect, range_only, acoustic, wifi_2_4_indoor, wifi_5_indoor,"
        " dot11p, lte, lora_eu868, zigbee, wired_1g, internet, 'wifi_5', nearest is 'wifi_5_indoor'",
        "network.radios.wifi.loss: not a probability (a number and one of p, %), 2",
    ]
    assert problems_of(network.replace("wifi_5, loss: 2", "wifi_5_indoor")) == [
        "network.links[0]: missing key, 'to'",
        "network.links[0].via: unknown radio, 'wif', nearest is 'wifi'",
    ]


def test_on_a_terminal_there_are_tables(command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "demo.yaml"
    file.write_text(text_of())
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "dumb")
    out = command("lint", file).out
    assert [title for title in ("links", "media", "radios") if f"{title} " in out] == ["links", "media", "radios"]
    assert "warning: lora: all together offer" in out


def test_presets_have_a_source_for_each_value(command: Command) -> None:
    assert len(json.loads(command("presets", "--json").out)) == len(PRESETS)
    out = command("presets", "lora_eu868").out
    assert "  spreading_factor: 7                               [J] write yours\n" in out
    assert "  isolation of SF7: 6, -16, -18, -19, -19, -20 dB   [S] signetlabdei/lorawan" in out
    wifi = command("presets", "wifi_5_indoor").out
    assert "  AIFSN, CW of voice: 2, 3 to 7             [S] ns-3 wifi-mac.cc\n" in wifi
    refused = command("presets", "lora_eu")
    assert refused.code == 2 and "nearest is 'lora_eu868'" in refused.err


@pytest.mark.parametrize(
    "arguments",
    [("lint", "nosuch.yaml"), ("explain", "nosuch.mcap", "a:1"), ("presets", "x"), ("partition", "a"), ("clog", "a"),
     ("partition", "a", "b", "--random"), ("set", "lan", "loss"), ("explain", "x.mcap", "camera")],
    ids=" ".join,
)  # fmt: skip
def test_bad_input_is_refused_without_a_traceback(command: Command, arguments: tuple[str, ...]) -> None:
    done = command(*arguments)
    assert done.code in (1, 2, 3) and done.err and "Traceback" not in done.err


def test_settings_are_nested() -> None:
    assert nested(["loss=5%", "burst.loss=1 %", "burst.mean_bad=20ms", "allow=false"]) == {
        "loss": "5%",
        "burst": {"loss": "1 %", "mean_bad": "20ms"},
        "allow": False,
    }
    for wrong, line in (
        (["loss"], "KEY=VALUE: not of the form key.key=VALUE, 'loss'"),
        (["=3"], "KEY=VALUE: not of the form key.key=VALUE, '=3'"),
        (["loss=1%", "loss.x=2"], "KEY=VALUE: set inside a value other than a mapping, 'loss', 'loss.x=2'"),
        (["loss=[1"], "KEY=VALUE: not valid YAML, expected ',' or ']', but got '<stream end>', .*, 'loss=\\[1'"),
        (["x=&a 1"], "KEY=VALUE: .*, 'x=&a 1'"),
    ):
        with pytest.raises(DeploymentError, match=f"^{line}$"):
            nested(wrong)


# --- explain ---------------------------------------------------------------------------------------------------------


def test_every_packet_is_explained_and_its_draws_agree(capture: CaptureData) -> None:
    """One of each rule, fate and cause; in a drop exactly one stage drops, and it names the cause."""
    seen: dict[tuple[str, str, str, bool, int], PacketRow] = {}
    for row in capture.rows(PACKETS):
        assert isinstance(row, PacketRow)
        seen.setdefault((row.rule, row.fate, row.cause, row.arrival_tick < 0, row.copy), row)
    fates = Counter(cause for _, _, cause, _, _ in seen)
    assert {"collision", "queue_full", "burst_loss", "partition", "expired"} <= fates.keys()
    for row in seen.values():
        explained = explain_packet(capture, PacketName(row.source, row.sequence, row.destination, row.copy))
        assert explained.agrees and (explained.fate, explained.cause) == (row.fate, row.cause)
        assert [step.stage for step in explained.steps] == [name for name, _, _ in STAGES]
        dropping = [step.text for step in explained.steps if step.outcome == "dropped"]
        assert len(dropping) == (row.fate == "dropped") and all(text.endswith(f": {row.cause}") for text in dropping)
        unreached = [step for step in explained.steps if step.outcome == "not reached"]
        assert not unreached or row.arrival_tick < 0
        if row.fate == "delivered":
            delay = next(step.facts for step in explained.steps if step.stage == "delay")
            assert sum(ns for what, ns in delay.items() if what != "due_ns") == row.due_ns - row.sent_ns


def first(capture: CaptureData, **fields: Any) -> PacketRow:
    return next(
        row
        for row in capture.rows(PACKETS)
        if isinstance(row, PacketRow) and all(getattr(row, name) == value for name, value in fields.items())
    )


def explain(capture: CaptureData, row: PacketRow) -> dict[str, str]:
    explained = explain_packet(capture, PacketName(row.source, row.sequence, row.destination, row.copy))
    return {step.stage: step.text for step in explained.steps} | {"verdict": explained.verdict, "head": explained.head}


def test_walls_are_named_with_what_they_take(capture: CaptureData) -> None:
    told = explain(capture, first(capture, rule="seen", fate="delivered", copy=0))
    assert "4.583 m, through wall 15.27 dB (15.27 dB in all), path loss 61.71 dB" in told["channel"]
    assert "over -93.99 dBm of noise" in told["channel"]
    assert told["head"].startswith("camera to player-red on ball: number ") and "24 B, published at " in told["head"]


def test_a_clog_that_was_asked_for_is_in_the_delay(capture: CaptureData) -> None:
    held = next(row for row in capture.rows(PACKETS) if isinstance(row, PacketRow) and row.held_ns > 0)
    told = explain(capture, held)
    assert held.destination == "player-blue" and " + clog " in told["delay"]
    assert told["verdict"].startswith("delivered at tick ")


def test_a_partition_that_was_asked_for_is_seen_at_sending(capture: CaptureData) -> None:
    told = explain(capture, first(capture, cause="partition", arrival_tick=-1))
    assert told["policy"] == "at sending cut by request 2, from 412 ms to 492 ms: partition"
    assert told["queue"] == "not reached"


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("camera", "not a packet, SOURCE:SEQUENCE"),
        ("camera:x", "not a packet, SOURCE:SEQUENCE"),
        ("camera:1:a:b", "not a packet, SOURCE:SEQUENCE"),
        ("camra:0", "no packet from this source, 'camra', nearest is 'camera'"),
        ("camera:1", "camera sent no packet of this number, 1"),
        ("camera:0", "name one of camera:0:player-blue, camera:0:player-red, 'camera:0'"),
        ("camera:0:red.goal", "name one of camera:0:player-blue, camera:0:player-red"),
        ("camera:0:player-red:7", "name one of"),
    ],
)
def test_a_packet_that_is_not_there_is_refused(command: Command, path: Path, text: str, problem: str) -> None:
    done = command("explain", path, text)
    assert done.code == 2 and problem in done.err


def test_explain_prints_a_line_a_stage(command: Command, path: Path) -> None:
    done = command("explain", path, "camera:0:player-blue")
    assert done.code == 0
    lines = done.out.splitlines()
    assert [line.split()[0] for line in lines[1:-1]] == [name for name, _, _ in STAGES]
    assert lines[-1].startswith("delivered at tick ")
    content = json.loads(command("explain", path, "camera:0:player-blue", "--json").out)
    assert content["agrees"] and content["steps"][4]["facts"]["airtime_ns"] == 496


def test_a_packet_is_parsed() -> None:
    assert parse_packet("red.goal:655360:player-red:1") == PacketName("red.goal", 655360, "player-red", 1)
    assert str(parse_packet("red.goal:7")) == "red.goal:7"


# --- top -------------------------------------------------------------------------------------------------------------


def test_links_are_told_with_their_causes_the_busiest_first() -> None:
    deployment = load_deployment(text_of(), "demo.yaml")
    assert deployment.tick_ns == 2_000_000
    link = ["camera", "player-red", 300, 250, 40, 1_500_000, "seen/wifi", 2_000, {"collision": 30, "snr": 10},
            [["ball", 250, 6_000_000, 8_000_000]]]  # fmt: skip
    quiet = ["a", "b", 900, 900, 0, 0, "perfect", 0, {}, []]
    status = {"run": "r", "ticks": 1000, "first_tick": 0, "tick_ns": 2_000_000, "links": [quiet, link]}
    before = {**status, "ticks": 500, "links": [quiet, [*link[:2], 100, *link[3:]]]}
    assert [(one["from"], one["offered_per_s"]) for one in links_shown(status)] == [("a", 450.0), ("camera", 150.0)]
    shown = links_shown(status, before)
    assert [(one["from"], one["offered_per_s"]) for one in shown] == [("camera", 200.0), ("a", 0.0)]
    assert link_line(shown[0]) == (
        "camera to player-red (seen/wifi): 200.0/s, offered 300, delivered 250, dropped 40, collision 30, snr 10,"
        " mean delay 1.5 ms, queue 2 us, age at use of ball 6 ms, p99 8 ms"
    )
    assert links_shown(status, {**before, "run": "other"}) == links_shown(status)
    assert use_text({**status, "links_in_all": 18}) == "18 links used"
