"""The page about a captured run's network: it says what the capture gives, for any capture."""

from __future__ import annotations

import json
import resource
import signal
from html import escape
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
from msgspec.structs import replace as replace_row

from foosim.capture.info import capture_info
from foosim.capture.reader import open_capture
from foosim.capture.rows import PACKETS, PacketRow
from foosim.cli.capture import report as report_command
from foosim.console.report.collect import Report, bin_width_ns, gather
from foosim.console.report.map import MapMaker
from foosim.console.report.page import page
from foosim.console.report.tallies import LinkAge, Times
from foosim.simulation.what_if import what_if
from foosim.world.frame import Frame
from tests.simulation.conftest import messages_of, packet, replay, rewritten, with_row
from tests.simulation.report_pages import Page

WWW: Final = Path(__file__).parents[2] / "console" / "www"


def test_the_report_has_the_numbers_that_the_capture_gives(radio_run: Path, found: Report) -> None:
    capture, info = open_capture(radio_run), capture_info(radio_run)
    packets = capture.packets
    assert (found["fates"], found["causes"]) == (info.packets, info.causes)
    assert {"partition", "random_loss"} <= found["causes"].keys() and found["causes"]["partition"] > 5
    assert (found["digest"], found["chain"], found["ticks"]) == (info.digest, info.chain, info.ticks)
    for cause, counts in found["causes_over_time"].items():
        sent = packets.sent_ns[packets.cause == cause]
        assert counts == np.bincount(sent // found["bin_ns"], minlength=len(counts)).tolist()
    for channel in found["channels"]:
        delivered = (packets.channel == channel["name"]) & (packets.fate == "delivered")
        for number, span in enumerate(channel["bins"]):
            mask = delivered & (packets.sent_ns // found["bin_ns"] == number)
            delays = (packets.due_ns - packets.sent_ns)[mask] / 1e6
            assert span["delivered"] == len(delays)
            if len(delays):
                assert [span["p50_ms"], span["p95_ms"]] == pytest.approx(np.quantile(delays, [0.5, 0.95]), abs=1e-5)
    assert sum(channel["packets"] for channel in found["channels"]) == len(packets)


def test_links_are_those_of_the_other_tools(radio_run: Path, found: Report) -> None:
    """The same delays and ages as what-if has, which keeps all packets; it ends ages with the last arrival."""
    links = {(link.source, link.destination): link for link in what_if(open_capture(radio_run)).links}
    assert len(found["links"]) == len(links) > 10
    for link in found["links"]:
        other = links[link["source"], link["destination"]]
        assert (link["offered"], link["delivered"]) == (other.offered, other.before.delivered)
        assert link["delay_mean_ms"] == pytest.approx(other.before.delay_mean_ms, abs=1e-3)
        assert link["delivered"] + link["dropped"] <= link["offered"]
        assert sum(link["causes"].values()) == link["dropped"]
        assert link["age_most_ms"] > link["age_mean_ms"] >= other.before.age_ms * 0.5


def test_ages_grow_until_something_newer_comes() -> None:
    """Sent every 10 with a delay of 2 the age goes from 2 to 12; what comes late or as a copy renews nothing."""
    age = LinkAge()
    for sent in range(0, 40, 10):
        age.add(sent, sent + 2)
    assert age.until(32) == (7.0, 12)
    age.add(5, 33)
    mean, worst = age.until(52) or (0.0, 0)
    assert worst == 22 and mean == pytest.approx((3 * 70 + 20 * 12) / 50)
    assert LinkAge().until(100) is None


def test_a_broadcast_is_on_air_once(radio_run: Path, found: Report) -> None:
    """All transmissions of the camera, which publishes to both players, by their distinct numbers."""
    rows = [row for row in open_capture(radio_run).rows(PACKETS) if isinstance(row, PacketRow)]
    airtimes: dict[int, int] = {}
    for row in rows:
        if row.source == "camera":
            airtimes[row.sequence] = max(row.airtime_ns, airtimes.get(row.sequence, 0))
    camera = next(sender for sender in found["senders"] if sender["source"] == "camera")
    assert sum(row.source == "camera" for row in rows) == 2 * camera["transmissions"] == 2 * len(airtimes)
    assert camera["airtime_share"] == pytest.approx(sum(airtimes.values()) / found["end_ns"], abs=1e-6)


def test_configured_is_beside_measured(run: Path) -> None:
    report = gather(open_capture(run), run.name)
    (rule,) = [rule for rule in report["measured"] if rule["rule"] == "everything"]
    assert rule["own_loss_configured"] == 0.005 and rule["own_delay_configured_ms"] == pytest.approx(1.3, abs=1e-3)
    assert rule["own_delay_ms"] == pytest.approx(1.3, abs=0.05) and 0.0 < rule["own_loss"] < 0.015
    assert not rule["is_changed"]
    assert rule["own_loss"] == pytest.approx(report["causes"]["random_loss"] / rule["packets"])


def test_spans_and_events_of_network_and_world(found: Report, radio_run: Path) -> None:
    bands = {band["kind"]: band for band in found["bands"]}
    cut, clog, settings = bands["partition"], bands["clog"], bands["settings"]
    assert (cut["start_ns"], cut["end_ns"]) == (100_000_000, 160_000_000) and "player-red" in cut["text"]
    assert clog["end_ns"] - clog["start_ns"] == 50_000_000 and clog["start_ns"] >= 120_000_000
    assert (settings["start_ns"], settings["end_ns"]) == (200_000_000, found["end_ns"])
    assert settings["text"] == "fast: loss 30 %"
    assert [rule["is_changed"] for rule in found["measured"] if rule["rule"] == "fast"] == [True]
    events = [(event["text"].split(" from ")[0], event["by"]) for event in found["events"]]
    assert ("partition player-red | rest, for 60 ms", "deployment") in events
    assert [text for text, by in events if by == "requested"] == [
        "push ball by 0.02, 0, -0.01 N s",
        "move red.goal",
        "clog",
        "ball-2 was added",
        "ball-2 was removed",
    ]
    capture = open_capture(radio_run)
    inputs = {tick.tick - 1: [type(edit).__name__ for edit in tick.edits] for tick in capture.captured_ticks()}
    at = {event["text"]: event["at_ns"] // found["tick_ns"] for event in found["events"]}
    assert inputs[at["push ball by 0.02, 0, -0.01 N s"]] == ["Push"] and inputs[at["ball-2 was added"]] == ["Add"]
    rows = Page(page(found)).rows
    assert all(any(row[1:] == [event["text"], event["by"]] for row in rows) for event in found["events"])


def test_the_page_is_whole_and_has_what_was_found(found: Report) -> None:
    content = page(found)
    read = Page(content)
    assert read.data == json.loads(json.dumps(found))
    assert [str(found["fates"]["offered"])] == [row[1] for row in read.rows if row[:1] == ["offered"]]
    causes = {row[0]: int(row[1]) for row in read.rows if row and row[0] in found["causes"] and len(row) == 3}
    assert causes == found["causes"]
    assert found["digest"] in read.texts and found["chain"] in read.texts
    for sender in found["senders"]:
        start = [sender["source"], sender["medium"], str(sender["transmissions"])]
        assert any(row[:3] == start for row in read.rows)
    channels = range(len(found["channels"]))
    charts = [f"{kind}-{number}" for number in channels for kind in ("delay", "loss")]
    assert read.places == ["events", "links", *charts, "causes", "map"]
    (radio,) = [row for row in read.rows if row[:2] == ["w", "wifi_5_indoor"]]
    assert {"loss 4 %", "frequency 5.25 GHz", "mtu 1500 B"} < set(radio[2].split(", ")) and "None" not in radio[2]
    assert all("http" not in text for text in read.texts)
    shipped = {name: (WWW / f"report.{end}").read_text() for name, end in (("script", "js"), ("style", "css"))}
    assert read.inlined == shipped
    assert "</script" not in shipped["script"].lower() and "</style" not in shipped["style"].lower()
    assert "Permission is hereby granted" in shipped["script"], "the licence of the library travels with it"
    assert len(content) < sum(map(len, shipped.values())) + 250_000


def with_texts(content: Any, text: str) -> Any:
    """A report with another text at each place that has one, but for keys and the kinds of what is drawn."""
    if isinstance(content, dict):
        kept = ("kind", "mark", "look", "cause")
        return {key: value if key in kept else with_texts(value, text) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [with_texts(value, text) for value in content]
    return text if isinstance(content, str) else content


def test_texts_are_escaped_at_each_place(found: Report) -> None:
    evil = '"></script><b onload=x>&<!--<script>'
    changed = with_texts(found, evil)
    changed |= {"metadata": {evil: evil}, "causes": {evil: 1}, "causes_over_time": {evil: [1]}}
    content = page(changed)
    read = Page(content)
    assert "b" not in read.open and evil not in content and content.count(escape(evil)) > 40
    assert content.count("<script") == content.count("</script") == 2 and "<!--" not in content
    assert read.data == json.loads(json.dumps(changed))


def test_the_map_has_the_scene_paths_and_places_of_losses(found: Report) -> None:
    where = found["map"]
    tracks = {track["name"]: track for track in where["tracks"]}
    assert tracks.keys() >= {"ball", "red.goal"} and len(tracks) == 10
    assert [name for name, track in tracks.items() if track["is_gone"]] == ["ball-2"]
    assert tuple(where["standing"]["player-red"]) == (-20.0, 3.0) and where["placeless"] == 0
    assert len(where["losses"]) == where["lost"] == found["fates"]["dropped"]
    assert sum(count for *_, count in where["links"]) <= where["lost"]
    middle = next(loss for loss in where["losses"] if {loss["source"], loss["destination"]} == {"camera", "player-red"})
    assert tuple(middle["at"]) == (-10.0, 1.5)
    placed = {
        link["body"] for link, pose in zip(found["scene"]["links"], found["poses"], strict=True) if pose[0] is not None
    }
    assert placed == tracks.keys() - {"ball-2"}
    (left, bottom, _), (right, top, _) = found["scene"]["bounds"]
    assert -20.0 < left < -0.6 < 0.6 < right < 20.0 and bottom < 0.0 < top, "a client 20 m away is beyond the field"


def test_a_path_is_cut_where_its_body_jumped_or_was_absent(radio_run: Path) -> None:
    """A ball rolls, is put elsewhere, rolls on, is removed, and comes back."""
    capture = open_capture(radio_run)
    frames = [*capture.each_frame()]
    with_two = next(frame for frame in frames if not frame.layout["ball-2"].is_absent(frame.numbers))
    maker = MapMaker(capture.deployment)

    def show(tick: int, x: float, base: Frame = with_two) -> None:
        values = base.values.copy()
        if base is with_two:
            start = base.layout["ball-2"].offsets["position"]
            values[start : start + 3] = x, 0.0, 0.1
        maker.take_frame(Frame(tick, base.layout, values))

    def track() -> Report:
        found: Report = next(one for one in maker.result()["tracks"] if one["name"] == "ball-2")
        return found

    for tick in range(10):  # 10 ms apart: 1 m/s
        show(5 * tick, 0.01 * tick)
    for tick in range(10, 20):  # 0.31 m away in 10 ms
        show(5 * tick, 0.4)
    show(100, 0.48)  # it was hit: 8 m/s
    show(105, 0.57)
    show(110, 0.0, frames[0])
    show(115, 0.57)
    show(120, 0.57)
    ends = [(piece[0][0], piece[-1][0]) for piece in track()["pieces"]]
    assert ends == [pytest.approx((0.0, 0.09)), pytest.approx((0.4, 0.57)), pytest.approx((0.57, 0.57))]
    assert (track()["at"], track()["is_gone"]) == ((0.57, 0.0), False)
    for tick in range(2000):  # further places are thinned, to the last one
        show(125 + tick, 0.57 + 1e-3 * tick)
    assert sum(map(len, track()["pieces"])) < 1010 and track()["pieces"][-1][-1] == (2.569, 0.0)
    show(3000, 0.0, frames[0])
    assert (track()["at"], track()["is_gone"]) == ((2.569, 0.0), True)


def test_a_packet_is_lost_where_its_sender_was_when_it_sent(radio_run: Path) -> None:
    """Not where the sender is when the loss is known; without a place of either end it is counted and not drawn."""
    capture = open_capture(radio_run)
    places = capture.poses("red.midfield").positions
    maker = MapMaker(capture.deployment)
    frames = [*capture.each_frame()]
    for frame in frames:
        maker.take_frame(frame)
    moved = max(range(len(frames)), key=lambda number: float(abs(places[number] - places[-1]).sum()))
    sent_ns = frames[moved].tick * capture.deployment.tick_ns
    maker.take_loss(replace_row(packet(sent_ns + 1, -1, "snr"), source="red.midfield"))
    maker.take_loss(packet(sent_ns, -1, "snr"))
    where = maker.result()
    (loss,) = where["losses"]
    assert loss["at"] == pytest.approx(places[moved][:2], abs=1e-4) != pytest.approx(places[-1][:2], abs=1e-4)
    assert (where["lost"], where["placeless"]) == (2, 1)


def test_the_command_writes_a_page_and_overwrites_none(radio_run: Path, tmp_path: Path, found: Report) -> None:
    out = tmp_path / "page.html"
    typed = replay("report", radio_run, "-o", out, "--json")
    assert (typed.code, out.read_text()) == (0, page(found))
    assert json.loads(typed.out) == Page(page(found)).data
    before = out.read_text()
    again = replay("report", radio_run, "-o", out)
    assert again.code == 3 and "exists already" in again.err and out.read_text() == before
    nowhere = replay("report", radio_run, "-o", tmp_path / "none" / "page.html")
    assert nowhere.code == 1 and "cannot be written" in nowhere.err
    for name in ("page.pdf", "-"):
        other = replay("report", radio_run, "-o", tmp_path / name)
        assert other.code == 2 and "--out: the name of the page ends with .html or .htm, " in other.err


def test_a_page_that_the_disk_does_not_take_leaves_no_file(
    radio_run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(report_command, "page", lambda found: "x" * 100_000)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, hard))
    try:
        full = replay("report", radio_run, "-o", tmp_path / "page.html")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, before)
    assert full.code == 1 and "page.html: cannot be written, File too large" in full.err
    assert not list(tmp_path.iterdir())


def test_an_event_that_is_none_is_refused_and_leaves_no_page(run: Path, tmp_path: Path) -> None:
    messages = messages_of(run)
    number = next(n for n, message in enumerate(messages) if message.topic == "/tick" and n > 20)
    messages[number] = with_row(messages[number], edits=[{"kind": "network", "event": '{"clog": 3}'}])
    typed = replay("report", rewritten(run, tmp_path / "bad.mcap", messages), "-o", tmp_path / "page.html")
    assert typed.code == 2 and "not an event of a network" in typed.err and not (tmp_path / "page.html").exists()


def test_empty_captures_have_a_page(radio_run: Path, tmp_path: Path) -> None:
    for kept in (("/tick", "/layout", "/frame"), ()):
        messages = [message for message in messages_of(radio_run) if message.topic in kept]
        name = tmp_path / f"empty{len(kept)}.mcap"
        silent = gather(open_capture(rewritten(radio_run, name, messages)), "silent")
        assert silent["fates"]["offered"] == 0 and silent["links"] == []
        assert "No packets." in Page(page(silent)).texts
        assert (silent["scene"] is None) == (not kept)


def test_memory_is_bounded_and_samples_are_fair() -> None:
    times = Times("test")
    for value in range(20_000):
        times.add(value)
    assert (times.count, times.mean, times.most) == (20_000, 9999.5, 19_999)
    assert times.quantile(0.5) == pytest.approx(10_000, rel=0.1) and times.quantile(1.0) < 19_999


def test_spans_are_round_and_few() -> None:
    assert bin_width_ns(10_000_000_000, 2_000_000) == 200_000_000
    assert bin_width_ns(0, 2_000_000) == 2_000_000
    for span in (1, 7_000_000, 3_600_000_000_000):
        assert span / bin_width_ns(span, 1) <= 60
