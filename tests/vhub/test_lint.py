"""What a network means: the printed figures are those that packets then have."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from math import exp, inf
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.capture.reader import open_capture
from foosim.capture.rows import PACKETS, PacketRow
from foosim.common.keyed_random import draw_key, draw_words
from foosim.deployment.loader import apply_sets, expanded_text, load_deployment
from foosim.deployment.network.impairments import Impairments
from foosim.deployment.network.radios import Radio
from foosim.deployment.network.rules import Network
from foosim.deployment.schema import Deployment
from foosim.simulation.run import rehearse
from foosim.simulation.simulation import read_for_stepping
from foosim.vhub.links.offered_load import warnings_of
from foosim.vhub.links.summary import (
    SharedSettings,
    delay_of,
    ranges_of,
    reordered_of,
    residual_of,
    summaries,
    summary_of,
    uses_alone,
    uses_of,
)
from foosim.vhub.links.summary_text import LINES_MAX, start_lines, summary_line
from foosim.vhub.network.jitter import interpolate_ns, quantiles_ns
from tests.deployed import TEXT, deployed
from tests.turns import BY_PERIOD
from tests.waving import PLAYERS

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
APPROXIMATELY: Final = partial(pytest.approx, rel=1e-6)


def radio(**settings: Any) -> Radio:
    return Radio.model_validate(settings)


def deployment(network: str) -> Deployment:
    return load_deployment(apply_sets(TABLE.read_text(), TABLE.name, [f"network={network}"]), TABLE.name)


FOUR: Final = {"p13": "5 %", "p31": "30 %", "p32": "20 %", "p23": "40 %", "p14": "2 %"}


@pytest.mark.parametrize(
    ("settings", "loss", "packets", "bad_ns"),
    [
        ({}, 0.0, None, None),
        ({"loss": "2 %"}, 0.02, None, None),
        ({"burst": {"loss": "1 %", "mean_bad": "40 ms"}}, 0.01, None, 40_000_000),
        ({"burst": {"loss": "1 %", "mean_burst": 4.0}}, 0.01, 4.0, None),
        ({"burst": {"loss": "10 %", "mean_bad": "1 s", "bad_loss": "50 %"}, "loss": "10 %"}, 0.19, None, 10**9),
        ({"gilbert_elliott": {"p": "1 %", "r": "25 %"}}, 1 / 26, 4.0, None),
        # A quarter of all is bad, half of that is lost; of what is lost 70 % is followed by bad again.
        ({"gilbert_elliott": {"p": "10 %", "r": "30 %", "h": "50 %"}}, 0.125, 1 / (1 - 0.7 * 0.5), None),
        ({"markov4": {"p13": "10 %", "p31": "50 %"}}, 1 / 6, 2.0, None),
        # For each good one 0.02 single losses, 1/6 in bursts, of which half are followed by another, 1/12 amid bursts.
        ({"markov4": FOUR}, (1 / 6 + 0.02) / (1 + 1 / 6 + 1 / 12 + 0.02), (1 / 6 + 0.02) / (1 / 12 + 0.02), None),
        ({"markov4": {"p13": "0 %", "p31": "30 %", "p14": "25 %"}}, 0.2, 1.0, None),
        ({"markov4": {"p13": "5 %", "p31": "0 %"}}, 1.0, None, None),
        ({"markov4": {"p13": "5 %", "p31": "30 %", "p32": "10 %"}}, 0.0, None, None),
        ({"outages": {"mean_on": "3 s", "mean_off": "1 s"}}, 0.25, None, 10**9),
    ],
)
def test_mean_loss_and_bursts(
    settings: Mapping[str, Any], loss: float, packets: float | None, bad_ns: int | None
) -> None:
    mean, run, length_ns = residual_of(Impairments.model_validate(settings))
    assert mean == APPROXIMATELY(loss) and length_ns == bad_ns
    assert run == (None if packets is None else APPROXIMATELY(packets))


BURST: Final = {"loss": "5 %", "mean_bad": "20 ms", "bad_loss": "50 %", "bad_extra_delay": "9 ms"}


@pytest.mark.parametrize(
    ("settings", "mean_ns"),
    [
        ({"burst": BURST}, 9e6 * 0.1 * 0.5 / 0.95),
        ({"burst": {**BURST, "loss": "50 %"}}, 9e6),
        ({"jitter": {"shape": "gamma", "mean": "1 ms", "sd": "4 ms"}, "delay": "1 ms"}, 2e6),
        ({"reorder": {"probability": "10 %", "extra": "5 ms"}}, 0.5e6),
    ],
)
def test_mean_delay(settings: Mapping[str, Any], mean_ns: float) -> None:
    assert delay_of(Impairments.model_validate(settings), {})[0] == pytest.approx(mean_ns, rel=0.01)


@pytest.mark.parametrize(
    "jitter",
    [
        {"shape": "gamma", "sd": "2 ms", "mean": "3 ms"},
        {"shape": "pareto", "mean": "1 ms", "alpha": 2.5},
        {"shape": "mixture", "parts": [{"share": "90 %", "to": "1 ms"}, {"share": "10 %", "to": "50 ms"}]},
    ],
    ids=lambda jitter: jitter["shape"],
)
def test_the_delay_is_that_of_the_table_that_draws_come_from(jitter: Mapping[str, Any]) -> None:
    settings = Impairments.model_validate({"delay": "5 ms", "jitter": jitter})
    mean_ns, sd_ns, p99_ns = delay_of(settings, {})
    assert settings.jitter is not None
    table, key = quantiles_ns(settings.jitter), draw_key(1, "lint")
    drawn = sorted(
        5_000_000 + interpolate_ns(table, word) for number in range(12_500) for word in draw_words(key, number)
    )
    mean = sum(drawn) / len(drawn)
    sd = (sum((one - mean) ** 2 for one in drawn) / len(drawn)) ** 0.5
    assert mean_ns == pytest.approx(mean, abs=5 * sd / len(drawn) ** 0.5)
    assert sd_ns == pytest.approx(sd, rel=0.02 if jitter["shape"] != "pareto" else 0.2)
    assert p99_ns == pytest.approx(drawn[int(0.99 * len(drawn))], rel=0.05)


def test_ranges_are_where_the_formulas_say() -> None:
    wifi = radio(preset="wifi_2_4_indoor")
    los_m, nlos_m = ranges_of(wifi)
    # 20 dBm, -94 dBm of noise, 3.3 dB that 136 B need at 6 Mbit/s; behind walls 17.3 + 38.3 lg d + 24.9 lg 2.437
    assert nlos_m == pytest.approx(10 ** ((20 + 93.99 - 3.3 - 17.3 - 9.633) / 38.3), rel=0.02)
    assert los_m is not None and nlos_m is not None and los_m > nlos_m
    assert ranges_of(radio(preset="range_only", path_loss={"range": "7 m"})) == (7.0, None)
    assert ranges_of(radio(preset="range_only", path_loss={"strict_los": True})) == (10.0, 0.0)
    assert ranges_of(radio(preset="wired_1g")) == (None, None)
    assert ranges_of(radio(medium="radio", tx_power="100 dBm", sensitivity="-200 dBm"))[0] == inf
    lora_m, _ = ranges_of(radio(preset="lora_eu868", spreading_factor=7))
    assert lora_m == pytest.approx(10 ** ((14 + 124 - 7.7) / 37.6), rel=1e-6)


@pytest.mark.parametrize(
    ("settings", "warning"),
    [
        ({"loss": "60 %"}, "more than half of all packets is lost: 60.0 %"),
        ({"delay": "20 ms", "ttl": "10 ms"}, "the mean delay of 20 ms is above ttl, 10 ms"),
        ({"preset": "wifi_5_indoor", "tx_power": "-80 dBm"}, "it does not reach 1 m (0.00 m)"),
        ({"allow": False}, "nothing passes: allow is off"),
        ({"medium": "wired", "rate": "1 Mbit/s", "queue": {"bytes": "500 B"}},
         "a packet of 1500 B does not fit into the queue of 500 B"),
        ({"preset": "lora_eu868", "duty_cycle": "10 %"}, "duty_cycle is above the 1 % that the EU allows at 868.1 MHz"),
        ({"preset": "lora_eu868", "frequency": "869.5 MHz", "duty_cycle": "20 %"},
         "duty_cycle is above the 10 % that the EU allows at 869.5 MHz"),
        ({"preset": "zigbee", "rate": "1 kbit/s"},
         "rate has no effect over ieee802154: a radio's bit rate is 250 kbit/s"),
        ({"queue": {"packets": 3}}, "the queue has no effect: no rate, no medium"),
    ],
)  # fmt: skip
def test_what_looks_wrong_is_said(settings: Mapping[str, Any], warning: str) -> None:
    assert warning in summary_of(SharedSettings("one", "", radio(**settings)), {}).warnings


def test_how_many_packets_overtake() -> None:
    """Of exponential jitter with the mean m, d apart: P(J > d + J') = exp(-d / m) / 2."""
    spread = {"jitter": {"shape": "gamma", "mean": "15 ms", "sd": "15 ms"}}
    late = {"reorder": {"probability": "10 %", "extra": "20 ms"}}
    shares = [reordered_of(Impairments.model_validate(of), {}) for of in (
        {**spread, "order": "free"}, late, {**late, **spread, "order": "free"}, spread, {"order": "free"},
    )]  # fmt: skip
    # With the extra delay P(J' < J + 10 ms) = 1 - exp(-10 / 15) / 2, of one in ten.
    free, later = exp(-10 / 15) / 2, 1 - exp(-10 / 15) / 2
    expected = [free, 0.1, 0.9 * free + 0.1 * later, None, None]
    assert shares == [None if of is None else pytest.approx(of, rel=0.01) for of in expected]
    internet = summary_of(SharedSettings("one", "", radio(preset="internet")), {})
    assert "25.7 % overtaken at 100 packets/s" in summary_line(internet)


def test_ranges_are_from_where_the_ends_and_their_antennas_are() -> None:
    """A base station 25 m up is seen farther; so it is by a mount."""
    cell = radio(preset="lte", tx_power="46 dBm")
    low_m, behind_m = ranges_of(cell)
    high_m, _ = ranges_of(cell, (25.0, 1.5))
    assert low_m is not None and behind_m is not None and high_m is not None and high_m > 1.5 * low_m
    mounted = radio(preset="lte", tx_power="46 dBm", antenna={"mount": ["0 m", "0 m", "10 m"]})
    assert ranges_of(mounted) == ranges_of(cell, (11.5, 11.5))
    made = deployment(
        "{radios: {b: {preset: lte}}, robots: {player-*: [b]}, places: {player-red: [0 m, 0 m, 25 m],"
        " player-*: [90 m, 0 m, 2 m]}}"
    )
    assert {use.heights_m for use in uses_of(made) if use.radio == "b"} <= {(25.0, 2.0), (2.0, 25.0)}


def test_every_link_of_a_deployment_is_in_one_line() -> None:
    made = deployment(
        "{radios: {wifi: {preset: wifi_5_indoor}, idle: {preset: lora_eu868}}, robots: {'*.goal': [wifi],"
        " player-red: [wifi]}, places: {player-*: [1 m, 1 m, 1 m]}, links: [{id: seen, from: camera, to: 'player-*',"
        " channels: ball, loss: 5 %}]}"
    )
    uses = {(use.rule, use.radio): use for use in uses_of(made)}
    assert {key: use.links for key, use in uses.items()} == {
        ("seen", ""): 2,
        ("wifi", "wifi"): 6,
        ("perfect", ""): 11 * 10 - 6,
        ("idle", "idle"): 0,
    }
    assert {key: use.used for key, use in uses.items()} == {
        ("seen", ""): 2,  # the camera to both players
        ("wifi", "wifi"): 2,  # red's goal and its player, both ways
        ("perfect", ""): 18 - 2 - 2,
        ("idle", "idle"): 0,
    }
    assert uses["seen", ""].example == ("camera", "player-blue")
    assert uses["wifi", "wifi"].example == ("player-red", "red.goal"), "one that carries packets"
    assert [summary.warnings for summary in summaries(made) if summary.rule == "idle"] == [("no link uses it",)]


def test_who_offers_more_than_is_carried_is_warned_of() -> None:
    made = deployment("{links: [{id: thin, from: '*', to: '*', rate: 64 kbit/s}]}")
    (thin,) = summaries(made)
    assert thin.warnings == ("one sender offers 100 frames/s as declared; of 100 B it carries 80/s",)
    radios = "network={radios: {w: {preset: wifi_5_indoor%s}}, robots: {'*': [w]}, places: {'*': [1 m, 1 m, 1 m]}}"
    player = "players={p: {class: 'tests.waving:Waver', rate: 1 Hz, hears: {'*': [encoder]}}}"
    for rate_hz, unicast in ((250, ""), (500, ""), (500, ", published: unicast")):
        sets = [f"robots.{rod}.sensors.encoder.rate={rate_hz} Hz" for rod in RODS]
        (wifi,) = [one for one in summaries(deployed(*sets, player, radios % unicast)) if one.radio]
        warned = [text for text in wifi.warnings if text.startswith("all together offer 4000 frames/s as declared")]
        assert len(warned) == (rate_hz == 500 and not unicast), "of 100 B it broadcasts 3140/s, and unicasts 5040/s"


@pytest.mark.parametrize("limit", [16, 1023, 1024])
def test_packets_that_do_not_fit_into_a_queue_are_named(limit: int) -> None:
    """A distance of each of 128 rays is 8 bytes; a rover hears speeds of its two wheels, or a way, in 16."""
    path = TABLE.with_name("warehouse.yaml")
    text = expanded_text(path.read_text(), path.name)
    links = f"network.links=[{{id: thin, from: 'rover*', to: 'pilot*', rate: 1 Mbit/s, queue: {{bytes: {limit} B}}}}]"
    made = load_deployment(apply_sets(text, path.name, ["robots.rover01.sensors.proximity.rays=128", links]), path.name)
    warning, *_ = warnings_of(made) or [""]
    assert ("rover01 proximity (1024 B)" in warning) == (limit < 1024)
    assert ("rover02 proximity (128 B)" in warning) == (limit < 128) and " drive (" not in warning
    assert warning in "\n".join(start_lines(summaries(made), "some.yaml"))


@pytest.mark.parametrize(
    ("limits", "offset", "is_crowded"),
    [
        ("bytes: 1119 B", "0 s", True),
        ("bytes: 1120 B", "0 s", False),
        ("bytes: 1119 B", "4 ms", False),
        ("packets: 1", "0 s", True),
        ("packets: 2", "0 s", False),
    ],
)
def test_sensors_due_at_one_tick_that_overflow_a_queue_are_named(limits: str, offset: str, is_crowded: bool) -> None:
    """The warning is there where packets are dropped: two of 500 B in frames of 250 B, each with 30 B of overhead."""
    eye, slow = (f"kind: camera, rate: {rate}, width: 8, height: 8, size: 500 B" for rate in ("50 Hz", "1 Hz"))
    slow += ", offset: 1 ms"
    sets = [
        f"robots.camera.sensors={{ball: {{{eye}}}, other: {{{eye}, offset: {offset}}}, slow: {{{slow}}}}}",
        PLAYERS.replace("camera: [ball]", "camera: [ball, other, slow]"),
        "network.links=[{id: thin, from: camera, to: '*', rate: 5 Mbit/s, overhead: 30 B, mtu: 250 B}]",
        f"network.links.thin.queue={{{limits}}}",
    ]
    warned = [text for text in warnings_of(deployed(*sets)) if "packets of one tick that overflow" in text]
    named = "camera ball to waver (560 B), camera other to waver (560 B)"
    assert len(warned) == is_crowded and all(text.startswith("thin: ") and named in text for text in warned)
    run = rehearse(TEXT, TABLE.name, 25, 1, [*sets])
    assert not run.json["failed"] and bool(run.json["packets"]["dropped"]) == is_crowded


def test_commands_of_a_fixed_or_a_jointed_size_that_do_not_fit_into_a_queue_are_named() -> None:
    """Four rotors have 32 B, an arm of seven joints 56 B."""
    path = TABLE.with_name("yard.yaml")
    links = "network.links=[{id: thin, from: '*', to: [arm, eagle], rate: 1 Mbit/s, queue: {bytes: 31 B}}]"
    made = read_for_stepping(path, [links])
    (text,) = warnings_of(made)
    assert "arm joints (56 B)" in text and "eagle rotors (32 B)" in text


def test_a_network_alone_is_shown_over_its_radios() -> None:
    network = Network.model_validate(
        {
            "radios": {"wifi": {"preset": "wifi_5_indoor"}, "wire": {"preset": "wired_1g"}},
            "links": [
                {"id": "any", "from": "*", "to": "*", "loss": "1 %"},
                {"id": "far", "between": ["a", "b"], "via": "wire"},
            ],
        }
    )
    assert [(use.rule, use.radio, use.links) for use in uses_alone(network)] == [
        ("wifi", "wifi", None),
        ("wire", "wire", None),
        ("any", "wifi", None),
        ("any", "wire", None),
        ("far", "wire", None),
    ]
    assert [use.rule for use in uses_alone(Network())] == ["perfect"]


@pytest.mark.parametrize("published", ["broadcast", "unicast"])
def test_wifi_carries_sensors_at_the_rate_that_their_packets_then_have(published: str, tmp_path: Path) -> None:
    wifi = f"{{preset: wifi_5_indoor, published: {published}}}"
    sets = [
        "robots.camera.sensors={ball: {kind: camera, rate: 50 Hz, width: 8, height: 8, size: 1500 B}}",
        PLAYERS,
        f"network={{radios: {{w: {wifi}}}, robots: {{'*': [w]}}, places: {{'*': [1 m, 1 m, 1 m]}}}}",
    ]
    run = rehearse(TEXT, TABLE.name, 25, 1, sets, capture=tmp_path / "run.mcap")
    assert not run.json["failed"]
    (found,) = (one for one in summaries(deployed(*sets)) if one.radio)
    at = found.rate_bps if published == "unicast" else found.broadcast_bps
    large = (found.carried if published == "unicast" else found.broadcast)[-1]
    rows = [row for row in open_capture(tmp_path / "run.mcap").rows(PACKETS) if isinstance(row, PacketRow)]
    seen = {(row.rate_bps, row.airtime_ns) for row in rows if row.size == large.size}
    assert seen == {(at, large.airtime_ns)}
    assert ("broadcasts at 6 Mbit/s, 100 B: " in summary_line(found)) == (published == "broadcast")


def test_the_latency_of_a_camera_counts_as_delay() -> None:
    """With 8 ms it is 10 ms old at the next turn but one, as the delay explains."""
    link = "network.links=[{id: w, from: '*', to: '*', delay: 1300 us}]"
    player = "players={one: {class: 'tests.waving:Waver', rate: 100 Hz, robots: {camera: [eye]}}}"
    for latency, warned in (
        ("2 ms", ["one sees camera eye 10 ms old, of which the delay explains 4 ms"]),
        ("8 ms", []),
    ):
        eye = f"robots.camera.sensors={{eye: {{kind: camera, rate: 100 Hz, latency: {latency}}}}}"
        (summary,) = summaries(deployed(eye, player, link))
        assert [text.partition(":")[0] for text in summary.warnings] == warned


def test_lines_are_for_people() -> None:
    wifi = summary_of(SharedSettings("wifi", "wifi", radio(preset="wifi_5_indoor"), 2, 1, ("a", "b")), {})
    assert summary_line(wifi) == (
        "wifi: wifi, 1 of 2 links carry declared packets (as a to b), loss 0.05 %, bursts of 20 ms, delay 600 us, "
        "sd 301 us, p99 1.68 ms, at 54 Mbit/s, 100 B: 44 us, 4.03 Mbit/s, 10 stations 4.319 Mbit/s, 1500 B: 248 us, "
        "29.81 Mbit/s, 10 stations 26.76 Mbit/s, broadcasts at 6 Mbit/s, 100 B: 208 us, 1500 B: 2.07 ms, "
        "range 7.37 km in sight, behind walls 112 m, queue of 17.3 ms"
    )
    lines = start_lines([wifi] * 40, "some.yaml")
    assert len(lines) == LINES_MAX and lines[-1] == "and 29 more: foosim net lint some.yaml"
    assert start_lines([wifi], "some.yaml") == [f"network {summary_line(wifi)}"]


# --- sensors and players in step -------------------------------------------------------------------------------------

STEP: Final = "sensor and player are in step"
RODS: Final = [f"{team}.{line}" for team in ("red", "blue") for line in ("goal", "defence", "midfield", "attack")]
SENSED: Final = (("camera", "ball"), *((rod, "encoder") for rod in RODS))


@pytest.mark.parametrize(
    ("delay", "sets", "what"),
    [
        ("1300 us", (), f"10 ms old, of which the delay explains 2 ms: {STEP}; an offset of 2 ms"),
        ("7 ms", (), f"10 ms old, of which the delay explains 8 ms: {STEP}; an offset of 8 ms"),
        ("1300 us", ("players.player-red.offset=2 ms", "players.player-blue.offset=2 ms"), ""),
        ("10 ms", (), ""),
        ("1300 us", tuple(f"robots.{robot}.sensors.{name}.rate=30 Hz" for robot, name in SENSED), ""),
        ("1300 us", tuple(f"robots.{robot}.sensors.{name}.offset=7500 us" for robot, name in SENSED), ""),
        ("1300 us", ("players.player-red.rate=50 Hz", "players.player-blue.rate=50 Hz"), "10 ms old, of which"),
        ("1300 us", tuple(f"players.player-{team}.act=arrival" for team in ("red", "blue"))
         + tuple(f"players.player-{team}.arrivals={{camera: [ball]}}" for team in ("red", "blue")), ""),
    ],
)  # fmt: skip
def test_sensor_and_player_in_step_are_told(delay: str, sets: tuple[str, ...], what: str) -> None:
    """What tests/vhub/test_ages.py measures: 10 ms at 1.3 ms and at 7 ms of delay alike."""
    link = f"network.links=[{{id: w, from: '*', to: '*', delay: {delay}}}]"
    text = apply_sets(TABLE.read_text(), TABLE.name, [*BY_PERIOD, link, *sets])
    (summary,) = summaries(load_deployment(text, TABLE.name))
    assert len(summary.warnings) == bool(what)
    if what:
        (warning,) = summary.warnings
        assert warning.startswith("player-red and 1 more see camera ball and 8 more channels ") and what in warning


@pytest.mark.parametrize("name", ["table", "cluster", "warehouse"])
def test_of_what_is_shipped_nothing_is_warned(name: str) -> None:
    path = TABLE.with_stem(name)
    found = summaries(load_deployment(path.read_text(), path.name))
    assert found and [warning for summary in found for warning in summary.warnings] == []
