"""What another network would have made of a capture: every fate again by its own, other fates by another one."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import open_capture
from foosim.capture.rows import PACKETS
from foosim.common.errors import DeploymentError
from foosim.deployment.loader import load_deployment, with_network
from foosim.simulation.run import rehearse
from foosim.simulation.what_if import WhatIf, _age_ms, what_if
from foosim.simulation.what_if_chart import draw
from tests.simulation.conftest import TABLE, Done, disturb, messages_of, replay, rewritten, with_row
from tests.turns import BY_PERIOD

NETWORKS: Final = {
    "wire": "links: [{id: w, from: '*', to: '*', delay: 1 ms, jitter: {shape: gamma, sd: 1 ms}, rate: 400 kbit/s,"
    " queue: {packets: 6, drop: codel}, burst: {loss: 5 %, mean_bad: 20 ms}, duplicate: 5 %,"
    " corrupt: {bit_error_rate: 0.0005 p, deliver: true}, reorder: {probability: 2 %, extra: 4 ms}}]",
    "chains": "links: [{id: in, from: 'player*', to: '*', burst: {loss: 10 %, mean_burst: 3}, order: free},"
    " {id: out, from: '*', to: 'player*', markov4: {p13: 5 %, p31: 30 %}, ttl: 3 ms, delay: 2 ms}]",
    "wifi": "radios: {w: {preset: wifi_5_indoor, fading: {kind: rician}, duplicate: 3 %}}, robots: {'*': [w]}",
    "zigbee": "radios: {z: {preset: zigbee}}, robots: {'*': [z]}",
    "lora": "radios: {l: {preset: lora_eu868, duty_cycle: 10 %}}, robots: {'*': [l]}",
    "lte": "radios: {m: {preset: lte}}, robots: {'*': [m]}",
    "events": "links: [{id: w, from: '*', to: '*', delay: 1 ms}], events: ["
    "{at: 40 ms, for: 60 ms, partition: [[player-red], [rest]]}, {at: 90 ms, for: {exponential: 30 ms},"
    " clog: {from: player-blue, to: '*'}}, {at: 100 ms, set: {link: w, loss: 30 %}}]",
}
PLACES: Final = "places: {player-red: [-20 m, 3 m, 1 m], player-blue: [3 m, 0 m, 1 m], camera: [0 m, 0 m, 2 m]}"


def captured(path: Path, network: str, *sets: str) -> Path:
    sets = ("engine=pure", f"network={{{NETWORKS[network]}, {PLACES}}}", *sets)
    rehearse(TABLE.read_text(), TABLE.name, 200, 2, list(sets), prepare=disturb, capture=path)
    return path


@pytest.mark.parametrize("network", NETWORKS)
def test_by_its_own_network_every_fate_is_the_captured_one(tmp_path: Path, network: str) -> None:
    """Every field of every row, whatever the stages remember; frames between captured ones are computed again."""
    found = what_if(open_capture(captured(tmp_path / "run.mcap", network)))
    assert (found.packets > 300, found.changed, found.inputs_changed) == (True, 0, 0)
    assert found.causes == found.new_causes
    assert all(link.before == link.after for link in found.links)
    assert sum(link.offered for link in found.links) <= found.packets


def test_a_packet_that_stands_too_late_or_twice_is_refused(run: Path, tmp_path: Path) -> None:
    messages = messages_of(run)
    packets = [number for number, message in enumerate(messages) if message.topic == PACKETS]
    last = messages[packets[-1]]
    late = [*messages[: packets[-1]], with_row(last, sent_ns=40_000_000), *messages[packets[-1] + 1 :]]
    with pytest.raises(CaptureError, match=r"sent at tick 20 follows later ones"):
        what_if(open_capture(rewritten(run, tmp_path / "late.mcap", late, chunk=100)))
    twice = [*messages[: packets[-1]], last, *messages[packets[-1] :]]
    with pytest.raises(CaptureError, match=r"packet \d+ of \S+ to \S+ has two fates"):
        what_if(open_capture(rewritten(run, tmp_path / "twice.mcap", twice)))


def test_robots_packets_are_judged_by_the_counts_of_their_rows(run: Path, tmp_path: Path) -> None:
    """Also where packets of a channel that nobody heard are not in the capture: they are counted."""
    messages, later = messages_of(run), 0
    for place, message in enumerate(messages):
        if message.topic == PACKETS and b'"source":"camera"' in message.data:
            messages[place], later = with_row(message, count=1), later + 1
    found = what_if(open_capture(rewritten(run, tmp_path / "counted.mcap", messages)))
    cameras = [change for change in found.changes if change.source == "camera"]
    assert later > 100 and len(cameras) > later * 0.9, "jitter is drawn anew for each of them"
    assert len(found.changes) < found.packets // 4, "of the others what a player takes with the camera's picture"


def changed_by(path: Path, *sets: str) -> WhatIf:
    capture = open_capture(path)
    about = capture.about
    text = with_network(about.deployment_text, about.deployment_name, None, sets)
    return what_if(capture, load_deployment(text, about.deployment_name))


def test_a_worse_network_loses_more_of_the_same_draws(run: Path) -> None:
    """Common random numbers: what a loss of 5 % takes, a loss of 10 % takes, too."""
    lost = []
    for loss in ("0 %", "5 %", "10 %"):
        found = changed_by(run, f"network.links.everything.loss={loss}")
        lost.append({(c.source, c.sequence, c.destination) for c in found.changes if c.new_cause == "random_loss"})
        assert found.new_causes.get("random_loss", 0) >= len(lost[-1])
    assert lost[0] < lost[1] < lost[2] and 20 < len(lost[1]) < len(lost[2])
    slower = changed_by(run, "network.links.everything.delay=21 ms")
    for link in slower.links:
        assert link.after.delay_mean_ms == pytest.approx(link.before.delay_mean_ms + 20.0, abs=0.2)
        assert link.after.age_ms > link.before.age_ms + 15.0


def test_a_network_with_walls_needs_the_world_and_has_it(run: Path, tmp_path: Path) -> None:
    other = tmp_path / "radio.yaml"
    other.write_text(f"network: {{{NETWORKS['wifi']}, {PLACES}}}\n")
    typed = replay("what-if", run, "--network", other, "--json", "--packets")
    found = json.loads(typed.out)
    assert found["changed"] > 100 and len(found["changes"]) == found["changed"]
    assert set(found["new_causes"]) & {"collision", "snr"}


def test_the_age_of_information_is_the_area_under_the_saw() -> None:
    """Sent every 10 ms with a delay of 2 ms the age goes from 2 to 12; one that comes late changes nothing."""
    sent = np.array([0, 10, 20, 30]) * 1_000_000
    assert _age_ms(sent, sent + 2_000_000) == pytest.approx(7.0)
    late = np.append(sent, 5_000_000), np.append(sent + 2_000_000, 25_000_000)
    assert _age_ms(*late) == pytest.approx(7.0)
    assert _age_ms(sent[:1], sent[:1] + 3_000_000) == 3.0


def test_the_command_shows_links_and_draws_them(run: Path, tmp_path: Path) -> None:
    drawing = tmp_path / "changed.svg"
    typed = replay("what-if", run, "--set", "network.links.everything.loss=50 %", "--picture", drawing)
    assert "changed" in typed.out and "random_loss" in typed.out and "red.goal" in typed.out
    assert "red.goal" in drawing.read_text()


def empty_figure() -> Any:
    """A picture; to import it takes each worker that collects 0.4 s."""
    from matplotlib.figure import Figure

    return Figure()


def test_a_picture_has_two_bars_for_each_link_and_figure(run: Path) -> None:
    found = what_if(open_capture(run))
    figure = empty_figure()
    draw(figure, found, "run")
    delivered, delay, _ = figure.axes
    for bars, sides in zip(
        delay.containers, ([one.before for one in found.links], [one.after for one in found.links]), strict=True
    ):
        assert [bar.get_width() for bar in bars] == [side.delay_mean_ms for side in sides]
    names = [label.get_text() for label in delivered.get_yticklabels()]
    assert names == [f"{link.source} \N{RIGHTWARDS ARROW} {link.destination}" for link in found.links]
    assert asdict(found)["changes"] == ()


def bad(run: Path, *arguments: str | Path) -> Done:
    typed = replay("what-if", run, *arguments)
    assert typed.code == 2, typed.out
    return typed


def test_bad_input_is_refused_with_its_place(run: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.yaml"
    other.write_text("network:\n  links:\n    - {id: a, from: '*', to: '*', loss: 12}\n")
    assert f"{other}:3:41: network.links[0].loss: not a probability" in bad(run, "--network", other).err
    other.write_text("links: []\n")
    assert "missing key, 'network'" in bad(run, "--network", other).err
    assert "there is no such file" in bad(run, "--network", tmp_path / "none.yaml").err
    assert "not a setting of the network" in bad(run, "--set", "tick=4 ms").err
    assert "nearest" in bad(run, "--set", "network.links.everything.los=4 %").err
    with pytest.raises(DeploymentError):
        with_network(TABLE.read_text(), TABLE.name, ("a: [", "x.yaml"), [])


def test_a_broadcast_whose_fate_is_behind_the_end_is_left_out(tmp_path: Path) -> None:
    """One receiver has it, the other one's link is slow: a faster network would deliver what nothing is known of."""
    whole, part = tmp_path / "run.mcap", tmp_path / "part.mcap"
    slow = "links: [{id: slow, from: '*', to: player-red, delay: 450 ms}, {id: rest, from: '*', to: '*', delay: 1 ms}]"
    rehearse(TABLE.read_text(), TABLE.name, 100, 1, ["engine=pure", f"network={{{slow}}}"], capture=whole)
    assert replay("cut", whole, "--to", "0.1 s", "-o", part).code == 0
    capture = open_capture(part)
    assert what_if(capture).changed == 0
    about = capture.about
    text = with_network(about.deployment_text, about.deployment_name, None, ["network.links.slow.delay=1 ms"])
    assert what_if(capture, load_deployment(text, about.deployment_name)).changed == 0


def test_a_part_is_judged_by_what_it_has(tmp_path: Path) -> None:
    """Who took part before it began takes part; what was sent before that is not judged."""
    whole, part = captured(tmp_path / "run.mcap", "wifi", *BY_PERIOD), tmp_path / "part.mcap"
    assert replay("cut", whole, "--from", "0.2 s", "-o", part).code == 0
    found, all_of_it = what_if(open_capture(part)), what_if(open_capture(whole))
    assert found.earlier > 0 and found.packets > all_of_it.packets * 2 // 5
    assert found.changed <= found.packets // 50, "what links remembered alone is missing"
    assert [caveat.partition(":")[0] for caveat in found.caveats] == [
        "it begins within its run",
        "it does not have the end of its run",
    ]
    assert all_of_it.caveats == ()
