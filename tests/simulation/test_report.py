"""The page about a captured run's network: what it says is what the capture gives, whatever the capture holds."""

from __future__ import annotations

import json
import resource
import signal
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from foosim.capture.info import capture_info
from foosim.capture.reader import open_capture
from foosim.capture.rows import PACKETS, EpochRow, OwnerRow, PacketRow
from foosim.cli.capture import report as report_command
from foosim.console.report.charts import drawings
from foosim.console.report.collect import Band, BinReport, Mark, Report, _Gathered, bin_width_ns, gather
from foosim.console.report.page import page
from foosim.console.report.tallies import SAMPLES, LinkTally, Sample
from foosim.console.shown.asked import moves
from foosim.simulation.what_if import what_if
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.frame import Frame
from foosim.world.kits.table import BALL
from foosim.world.layout import WORLD
from foosim.world.rules.football import kickoff_ticks
from tests.simulation.conftest import damaged, messages_of, packet, replay, rewritten, with_row
from tests.simulation.report_pages import Page

WWW: Final = Path(__file__).parents[2] / "console" / "www"


def test_the_report_has_the_numbers_that_the_capture_gives(radio_run: Path, found: Report) -> None:
    capture, info = open_capture(radio_run), capture_info(radio_run)
    packets = capture.packets
    assert (found.fates, found.causes) == (info.packets, info.causes)
    assert {"partition", "random_loss"} <= found.causes.keys() and found.causes["partition"] > 5
    assert (found.digest, found.chain, found.ticks) == (info.digest, info.chain, info.ticks)
    for cause, counts in found.causes_over_time.items():
        sent = packets.sent_ns[packets.cause == cause]
        assert list(counts) == np.bincount(sent // found.bin_ns, minlength=len(counts)).tolist()
    for channel in found.channels:
        delivered = (packets.channel == channel.name) & (packets.fate == "delivered")
        for number, span in enumerate(channel.bins):
            mask = delivered & (packets.sent_ns // found.bin_ns == number)
            delays = (packets.due_ns - packets.sent_ns)[mask] / 1e6
            assert span.delivered == len(delays)
            if len(delays):
                assert [span.p50_ms, span.p95_ms] == pytest.approx(np.quantile(delays, [0.5, 0.95]), abs=1e-5)
    assert sum(channel.packets for channel in found.channels) == len(packets)


def test_links_are_those_of_the_other_tools(radio_run: Path, found: Report) -> None:
    """The same delays and ages as what-if has, which keeps all packets; it ends ages with the last arrival."""
    links = {(link.source, link.destination): link for link in what_if(open_capture(radio_run)).links}
    assert len(found.links) == len(links) > 10
    for link in found.links:
        other = links[link.source, link.destination]
        assert (link.offered, link.delivered) == (other.offered, other.before.delivered)
        assert link.delay_mean_ms == pytest.approx(other.before.delay_mean_ms, abs=1e-3)
        assert link.delivered + link.dropped <= link.offered and sum(link.causes.values()) == link.dropped
        assert link.age_most_ms is not None and link.age_mean_ms is not None
        assert link.age_most_ms > link.age_mean_ms >= other.before.age_ms * 0.5


def test_ages_grow_until_something_newer_comes() -> None:
    """Sent every 10 with a delay of 2 the age goes from 2 to 12; what comes late or as a copy renews nothing."""
    link = LinkTally()
    for sent in range(0, 40, 10):
        link.add(packet(sent, sent + 2))
    assert link.age_ns(32) == (7.0, 12)
    link.add(packet(5, 33, copy=1))
    link.add(packet(40, -1, cause="snr"))
    assert (link.offered, link.delivered, link.dropped) == (5, 4, 1)
    mean, worst = link.age_ns(52) or (0.0, 0)
    assert worst == 22 and mean == pytest.approx((3 * 70 + 20 * 12) / 50)
    assert LinkTally().age_ns(100) is None


def test_a_broadcast_is_on_air_once(radio_run: Path, found: Report) -> None:
    """All transmissions of the camera, which publishes to both players, by their distinct numbers."""
    rows = [row for row in open_capture(radio_run).rows(PACKETS) if isinstance(row, PacketRow)]
    airtimes: dict[int, int] = {}
    for row in rows:
        if row.source == "camera":
            airtimes[row.sequence] = max(row.airtime_ns, airtimes.get(row.sequence, 0))
    camera = next(sender for sender in found.senders if sender.source == "camera")
    assert sum(row.source == "camera" for row in rows) == 2 * camera.transmissions == 2 * len(airtimes)
    assert camera.airtime_share == pytest.approx(sum(airtimes.values()) / found.end_ns, abs=1e-6)


def test_configured_stands_beside_measured(run: Path) -> None:
    report = gather(open_capture(run), run.name)
    (rule,) = [rule for rule in report.measured if rule.rule == "everything"]
    assert rule.own_loss_configured == 0.005 and rule.own_delay_configured_ms == pytest.approx(1.3, abs=1e-3)
    assert rule.own_delay_ms == pytest.approx(1.3, abs=0.05) and 0.0 < rule.own_loss < 0.015
    assert not rule.is_changed and rule.own_loss == pytest.approx(report.causes["random_loss"] / rule.packets)


def test_events_are_bands_and_are_told(found: Report) -> None:
    bands = {band.kind: band for band in found.bands}
    cut, clog, settings = bands["partition"], bands["clog"], bands["settings"]
    assert (cut.start_ns, cut.end_ns) == (100_000_000, 160_000_000) and "player-red" in cut.text
    assert clog.end_ns - clog.start_ns == 50_000_000 and clog.start_ns >= 120_000_000
    assert (settings.start_ns, settings.end_ns, settings.text) == (200_000_000, found.end_ns, "fast: loss 30 %")
    told = [(event.text, event.is_asked) for event in found.happenings]
    assert ("partition player-red | rest, for 60 ms", False) in told
    assert ("clog from player-blue to *, for 50 ms", True) in told
    assert [rule.is_changed for rule in found.measured if rule.rule == "fast"] == [True]


def test_what_was_asked_of_the_world_is_among_the_events(found: Report, radio_run: Path) -> None:
    told = {event.text: event.at_ns for event in found.happenings if event.is_asked}
    world = [text for text in told if text.startswith(("push", "move", "ball-2"))]
    assert [text.split(" from ")[0] for text in world] == [
        "push ball by 0.02, 0, -0.01 N s",
        "move red.goal",
        "ball-2 was added",
        "ball-2 was removed",
    ]
    capture = open_capture(radio_run)
    pushed, _, added, _ = (told[text] // capture.deployment.tick_ns for text in world)
    inputs = {tick.tick - 1: [type(edit).__name__ for edit in tick.edits] for tick in capture.captured_ticks()}
    assert inputs[pushed] == ["Push"] and inputs[added] == ["Add"]
    (moved,) = [epoch for epoch in capture.epochs if epoch.tick * capture.deployment.tick_ns == told[world[1]]]
    assert world[1] == "move red.goal from n1 to n2" and dict_of(moved)["red.goal"] == "n2"
    rows = Page(page(found)).rows
    assert all(any(row[1:] == [text, "asked for"] for row in rows) for text in world)


def test_what_the_rules_did_is_among_the_events_as_on_the_time_line_of_the_console(run: Path) -> None:
    capture = open_capture(run)
    gathered, frame, wait = _Gathered(capture), initial_frame(capture.deployment), kickoff_ticks(capture.deployment)
    gathered.take_frame(frame)
    goal = {(BALL, "football.wait_ticks"): wait - 3, (WORLD, "football.score"): 1}
    for tick, written in ((wait + 6, {(WORLD, "football.kickoffs"): 1}), (1000, goal)):
        values = np.array(frame.values)
        for (entity, field), value in {(BALL, "football.wait_ticks"): 0, **written}.items():
            values[frame.layout[entity].offsets[field]] = value
        frame = Frame(tick, frame.layout, values)
        gathered.take_frame(frame)
    report = gathered.result("run")
    told = [(event.at_ns // report.tick_ns, event.kind, event.text) for event in report.happenings if event.kind]
    assert told == [(wait, "kickoff", "kick-off of ball"), (997, "goal", "goal of red, 1 : 0")]
    drawn = Page(page(report))
    lanes = {lane["name"]: lane for lane in drawn.drawings["events"]["lanes"]}
    assert lanes["goal"]["mark"] == "goal" and lanes["goal"]["entries"][0]["text"] == "1.994 s: goal of red, 1 : 0"
    assert ["1.994 s", "goal of red, 1 : 0", "rules"] in [row[:3] for row in drawn.rows]


def test_what_another_node_adopts_is_no_move() -> None:
    def epoch(number: int, roster: list[str], owner: str) -> EpochRow:
        return EpochRow(10 * number, number, "0" * 64, roster, [OwnerRow("red.goal", owner)], "")

    both = ["n1", "n2"]
    epochs = [epoch(1, both, "n1"), epoch(2, ["n2"], "n2"), epoch(3, both, "n1"), epoch(4, both, "n2")]
    assert list(moves(epochs)) == [(40, "move red.goal from n1 to n2")]


def dict_of(epoch: EpochRow) -> dict[str, str]:
    return {owner.robot: owner.node for owner in epoch.owners}


def test_the_page_is_whole_and_says_what_was_found(found: Report) -> None:
    read = Page(page(found))
    assert [str(found.fates["offered"])] == [row[1] for row in read.rows if row[:1] == ["offered"]]
    assert {
        row[0]: int(row[1]) for row in read.rows if row and row[0] in found.causes and len(row) == 3
    } == found.causes
    assert found.digest in read.texts and found.chain in read.texts
    for sender in found.senders:
        assert any(row[:3] == [sender.source, sender.medium, str(sender.transmissions)] for row in read.rows)
    channels = len(found.channels)
    assert len(read.drawings) == 2 + 2 * channels + 1 + 1 == len(read.places)
    (radio,) = [row for row in read.rows if row[:2] == ["w", "wifi_5_indoor"]]
    assert {"loss 4 %", "frequency 5.25 GHz", "mtu 1500 B"} < set(radio[2].split(", ")) and "None" not in radio[2]
    assert all("http" not in text for text in read.texts)


def test_the_page_is_small_and_draws_with_the_modules_of_the_console(found: Report) -> None:
    content = page(found)
    read = Page(content)
    shipped = {name: (WWW / f"report.{end}").read_text() for name, end in (("script", "js"), ("style", "css"))}
    assert read.inlined == shipped
    assert "</script" not in shipped["script"].lower() and "</style" not in shipped["style"].lower()
    assert "Permission is hereby granted" in shipped["script"], "the licence of the library travels with it"
    assert len(content) < sum(map(len, shipped.values())) + 150_000


def test_each_chart_has_its_series(found: Report) -> None:
    drawn = Page(page(found)).drawings
    span = [found.start_ns / 1e9, found.end_ns / 1e9]
    for number, channel in enumerate(found.channels):
        delay, loss = drawn[f"delay-{number}"], drawn[f"loss-{number}"]
        for line, values in zip(delay["series"], ("p95_ms", "p50_ms"), strict=True):
            told = [value for _, value in line["points"] if value is not None]
            assert told == [getattr(content, values) for content in channel.bins if content.delivered]
        (lost,) = loss["series"]
        shares = [content.dropped / max(1, content.dropped + content.delivered) for content in channel.bins]
        assert [value for _, value in lost["points"]] == pytest.approx([100.0 * share for share in shares])
        assert delay["range"] == loss["range"] == span and loss["stacked"]
        assert [shade["text"].split(":")[0] for shade in delay["shades"]] == ["partition", "clog"]
    causes = drawn["causes"]["series"]
    assert {one["name"]: [value for _, value in one["points"]] for one in causes} == {
        cause: [*counts] for cause, counts in found.causes_over_time.items()
    }
    times = [time for time, _ in causes[0]["points"]]
    assert times == sorted(times) and span[0] < times[0] and times[-1] < span[1]


def test_links_and_events_are_drawn_with_what_they_are(found: Report) -> None:
    drawn = Page(page(found)).drawings
    names, cells = drawn["links"]["names"], drawn["links"]["cells"]
    links = {(link.source, link.destination): link for link in found.links}
    assert len(cells) == len(links)
    for cell in cells:
        link = links[names[cell["from"]], names[cell["to"]]]
        judged = link.delivered + link.dropped
        assert cell["loss"] == (pytest.approx(link.dropped / judged, abs=1e-6) if judged else None)
        assert cell["text"].startswith(f"{link.source} to {link.destination}: {link.delivered} of {link.offered} ")
    lanes = {lane["name"]: lane["entries"] for lane in drawn["events"]["lanes"]}
    assert list(lanes) == ["partition", "clog", "settings", "asked for"]
    assert (lanes["partition"][0]["from"], lanes["partition"][0]["to"]) == (0.1, 0.16)
    asked = [entry["text"].split(" s: ")[1] for entry in lanes["asked for"]]
    assert [text.split()[0] for text in asked[:3]] == ["push", "move", "clog"]
    assert asked[3:] == ["ball-2 was added", "ball-2 was removed"]


def test_lines_break_where_all_was_lost_and_pass_over_silence(found: Report) -> None:
    bins = tuple(BinReport(got, lost, 5.0, 7.0) for got, lost in ((1, 0), (0, 0), (1, 1), (0, 1), (1, 0)))
    channel = replace(found.channels[0], bins=bins)
    drawn = drawings(replace(found, channels=(channel,), start_ns=0, end_ns=50, bin_ns=10), [])["delay-0"]
    points = [(round(time * 1e9), value) for time, value in drawn["series"][1]["points"]]
    assert points == [(5, 5.0), (25, 5.0), (35, None), (45, 5.0)]


def test_names_are_escaped_wherever_they_stand(found: Report) -> None:
    evil = '"></script><b onload=x>&<!--<script>'
    links = tuple(replace(link, source=evil, causes={evil: 1}) for link in found.links[:2])
    losses = tuple(replace(loss, source=evil) for loss in found.map.losses)
    where = replace(found.map, losses=losses, standing={evil: (0.0, 0.0)}, links=((evil, evil, evil, 1),))
    tracks = tuple(replace(track, name=evil) for track in where.tracks)
    content = page(
        replace(
            found,
            name=evil,
            metadata={evil: evil, "world": evil},
            links=links,
            causes={**found.causes, evil: 1},
            causes_over_time={evil: (1,) * len(found.channels[0].bins)},
            channels=tuple(replace(channel, name=evil) for channel in found.channels),
            senders=tuple(replace(sender, source=evil, medium=evil) for sender in found.senders),
            measured=tuple(replace(rule, rule=evil, radio=evil) for rule in found.measured),
            bands=(Band("clog", 0, 10_000_000, evil),),
            marks=(Mark(5_000_000, evil),),
            happenings=tuple(replace(event, text=evil) for event in found.happenings),
            radios=tuple(replace(radio, name=evil, settings=evil) for radio in found.radios),
            rules=tuple(replace(rule, name=evil, ends=evil, settings=evil) for rule in found.rules),
            map=replace(where, tracks=tracks),
        )
    )
    read = Page(content)
    assert "b" not in read.open and evil not in content and content.count(escape(evil)) > 40
    assert content.count("<script") == content.count("</script") == 2 and "<!--" not in content
    drawn = read.drawings
    assert evil in drawn["links"]["names"] and evil in drawn["events"]["lanes"][0]["entries"][0]["text"]
    assert {body["name"] for body in drawn["map"]["map"]["bodies"]} == {evil}
    assert drawn["causes"]["series"][-1]["name"] == evil and drawn["map"]["legend"][-1]["text"] == evil


def test_the_command_writes_a_page_and_overwrites_none(radio_run: Path, tmp_path: Path, found: Report) -> None:
    out = tmp_path / "page.html"
    typed = replay("report", radio_run, "-o", out, "--json")
    assert (typed.code, Page(out.read_text()).drawings) == (0, Page(page(found)).drawings)
    assert json.loads(typed.out)["causes"] == found.causes
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


def test_bad_files_are_refused_and_leave_no_page(bad_files: list[Path], run: Path, tmp_path: Path) -> None:
    out = tmp_path / "page.html"
    for path in (*bad_files, damaged(run, tmp_path / "damaged.mcap")):
        typed = replay("report", path, "-o", out)
        assert (typed.code, str(path) in typed.err, out.exists()) == (2, True, False)


def test_an_event_that_is_none_is_named(run: Path, tmp_path: Path) -> None:
    messages = messages_of(run)
    number = next(n for n, message in enumerate(messages) if message.topic == "/tick" and n > 20)
    messages[number] = with_row(messages[number], edits=[{"kind": "network", "event": '{"clog": 3}'}])
    typed = replay("report", rewritten(run, tmp_path / "bad.mcap", messages), "-o", tmp_path / "page.html")
    assert typed.code == 2 and "no event of a network" in typed.err


def test_unfinished_and_empty_captures_have_a_page(radio_run: Path, run: Path, tmp_path: Path) -> None:
    torn = tmp_path / "torn.mcap"
    torn.write_bytes(run.read_bytes()[: run.stat().st_size * 2 // 3])
    part = gather(open_capture(torn), "torn")
    assert not part.finished and part.fates["offered"] > 0 and part.fates["in_flight"] == 0
    assert "not finished" in " ".join(Page(page(part)).texts)
    for kept in (("/tick", "/layout", "/frame"), ()):
        messages = [message for message in messages_of(radio_run) if message.topic in kept]
        name = tmp_path / f"empty{len(kept)}.mcap"
        silent = gather(open_capture(rewritten(radio_run, name, messages)), "silent")
        assert silent.fates["offered"] == 0 and silent.links == ()
        assert "No packets." in Page(page(silent)).texts


def test_memory_is_bounded_and_samples_are_fair() -> None:
    sample = Sample("test")
    for value in range(20_000):
        sample.add(value)
    assert (sample.count, sample.mean, sample.most) == (20_000, 9999.5, 19_999)
    assert len(sample.kept) == SAMPLES
    assert sample.quantile(0.5) == pytest.approx(10_000, rel=0.1)


def test_spans_are_round_and_few() -> None:
    assert bin_width_ns(10_000_000_000, 2_000_000) == 200_000_000
    assert bin_width_ns(0, 2_000_000) == 2_000_000
    for span in (1, 7_000_000, 3_600_000_000_000):
        assert span / bin_width_ns(span, 1) <= 60
