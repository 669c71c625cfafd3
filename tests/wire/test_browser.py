"""The page in a real browser: one run, one tab. It is asked as people ask it, by pointer and keys."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from foosim.rehearsal.rehearse import rehearse
from foosim.rehearsal.view_command import open_sources
from tests.wire.chromium import Page, chromium, find_chromium
from tests.wire.served import served
from tests.wire.test_console import addresses_of
from tests.wire.test_run import last_json

if TYPE_CHECKING:
    from tests.wire.conftest import House

WAREHOUSE = Path(__file__).parent.parent.parent / "deploy" / "warehouse.yaml"
ROBOTS = {f"red.{line}": ["encoder"] for line in ("goal", "defence", "midfield", "attack")} | {"camera": ["ball"]}
PLAYER = {"class": "foosim.client.players:Team", "rate": "50 Hz", "robots": ROBOTS, "parameters": {"team": "red"}}
LINK = ("camera", "player-red")
STAT = "window.foosim.stat"
WINDOW = 860, 480
FRAMES_EVERY = 10
"""Ticks, as the table is captured; what is between them is computed."""
COMPARED = "[...document.querySelectorAll('#panel-compare th[scope=row]')].map((one) => one.textContent)"
SUMMARY = "document.querySelector('#panel-compare .summary').textContent"
PLOTTED = "command red.goal/position.slide"
LAYOUT = """[
  document.documentElement.dataset.theme,
  document.querySelector(".charts .lines")?.textContent ?? "",
  document.querySelector("[role=tab][aria-selected=true]").id,
  document.querySelector("#show-paths").ariaPressed,
  document.querySelector("#show-radio").ariaPressed,
  document.querySelector("#two").value,
  document.querySelector("#splitter").ariaValueNow,
]"""
"""What the browser keeps for the page."""
SHAPES = 60
"""Colours that no view without the world has."""


def send(page: Page) -> None:
    """Send the form of the dialog, which closes when it was accepted."""
    page.click("dialog [type=submit]")
    page.until("!document.querySelector('dialog')")


def state(page: Page, name: str) -> None:
    page.until(f"document.querySelector('#state').textContent.includes('{name}')")


def look_only(page: Page) -> None:
    """Who looks sees the world, and is refused whatever is asked."""
    page.until(f"{STAT}.drawn > 0 && {STAT}.role === 'viewer'")
    page.until("['play', 'step', 'pace'].every((id) => document.getElementById(id).disabled)")
    page.until("document.querySelector('#down').hidden && document.querySelector('#add').hidden")
    page.press(" ")
    assert "operate" in page.until("document.querySelector('.toast.error')?.textContent")
    tick = page.get(f"{STAT}.tick")
    page.until(f"{STAT}.tick > {tick} + 1")
    page.until("document.querySelector('#state').textContent.includes('running')")


def add_and_move(page: Page) -> None:
    """A ball more is another layout, whose poses are drawn; a robot is dragged to another node."""
    bodies, generation = page.get(f"[{STAT}.bodies, {STAT}.generation]")
    page.click("#tab-world")
    page.click("#add")
    send(page)
    page.until(f"{STAT}.bodies === {bodies + 1} && {STAT}.generation > {generation}")
    page.until("document.querySelector('.entities').textContent.includes('ball2')")
    assert page.colours() > SHAPES
    page.click("#tab-machines")
    chip, card = page.place("[data-node=red] .chip", "red.goal"), page.place("[data-node=blue] h3")
    page.drag(chip, (chip[0], chip[1] + 20), card)
    page.until("document.querySelector('[data-node=blue] .robots').textContent.includes('red.goal')")


def cut_and_heal(page: Page) -> None:
    """A link is chosen, cut off, its drops explained, and healed."""
    page.click("#tab-network")
    page.click("table.links tbody tr", "".join(LINK))
    page.click("#partition")
    page.until(f"document.querySelector('dialog input').value === '{LINK[0]}'")
    send(page)
    assert "partition" in page.until("document.querySelector('.drops details')?.textContent")
    page.until("document.querySelector('table.links tr[aria-selected=true]').textContent.includes('partition')")
    page.click("#heal")
    send(page)
    page.until("document.querySelector('.disturbances').textContent.includes('heal of all')")


def pause_and_step(page: Page) -> int:
    """Pause and step by key and by button; returns the tick."""
    page.get("document.activeElement.blur()")  # a button in focus has the space bar for itself
    page.press(" ")
    state(page, "paused")
    page.until(f"{STAT}.paused && {STAT}.drawn === {STAT}.tick")
    tick = int(page.get(f"{STAT}.tick"))
    page.click("#step")
    page.until(f"{STAT}.drawn === {tick + 1}")
    page.press(".")
    page.until(f"{STAT}.drawn === {tick + 2}")
    state(page, "paused")
    return tick + 2


def lose_the_supervisor(page: Page, house: House, tick: int) -> None:
    """The page keeps what it shows, and goes on with the next supervisor."""
    page.click("#tab-machines")
    house.kill("supervisor")
    page.until("document.querySelector('.recoveries').textContent.includes('the supervisor was started again')")
    state(page, "paused")
    assert page.get(f"{STAT}.tick") == tick
    page.click("#play")
    page.until(f"{STAT}.drawn > {tick}")


def end_the_run(page: Page) -> None:
    """The page says how the run has ended, also when its console has gone, and asks for nothing more."""
    page.click("#down")
    assert "ends for everybody" in page.text("dialog")
    assert page.complaints == []
    send(page)
    banner = page.until("!document.querySelector('#banner').hidden && document.querySelector('#banner').textContent")
    page.until(f"!{STAT}.connected")
    assert page.text("#banner") == banner
    assert "The run has ended at tick" in banner and "foosim-replay view" in banner
    state(page, "ended")
    page.until("['play', 'step', 'pace', 'down'].every((id) => document.getElementById(id).disabled)")


def as_two(page: Page, how: str) -> list[int]:
    """Choose how the second source is shown; returns what is seen."""
    chosen = f"document.querySelector('#two').value = '{how}'"
    page.get(f"({chosen}, document.querySelector('#two').dispatchEvent(new Event('change')))")
    return page.seen()


def ghost_and_beside(page: Page) -> None:
    """The second source is a ghost, or beside the first one, or not shown."""
    page.click("#show-radio")  # what flashes there fades with time
    ghost = as_two(page, "ghost")
    assert "ghost: " in page.text("#halves")
    alone = as_two(page, "single")
    assert page.get("document.querySelector('#halves').hidden")
    beside = as_two(page, "side")
    assert page.get("document.querySelectorAll('#halves:not([hidden]) span').length") == 2
    assert "ghost: " not in page.text("#halves")
    assert as_two(page, "single") == alone
    assert all(len(set(one)) > SHAPES for one in (ghost, alone, beside))
    assert [ghost != alone, beside != alone, ghost != beside] == [True, True, True]
    as_two(page, "side")


def slide(page: Page, last: int) -> None:
    """The slider seeks; a step is exact; the distance to the second capture is told where there is one."""
    page.until(f"{STAT}.drawn >= 0 && {STAT}.marks > 0")
    assert page.colours() > SHAPES
    bodies = page.get(f"{STAT}.bodies")
    page.press(" ")
    page.until(f"{STAT}.drawn === {last} && {STAT}.paused")
    page.drag(page.place("#slider"))
    page.until(f"Math.abs({STAT}.drawn - {last / 2}) < {last / 20}")
    tick = page.get(f"{STAT}.drawn")
    page.click("#frame-on")
    frame = page.until(f"{STAT}.drawn > {tick} && {STAT}.drawn % {FRAMES_EVERY} === 0 && {STAT}.drawn")
    page.press(".")
    page.until(f"{STAT}.drawn === {frame + 1}")
    page.click("#tab-compare")
    page.until(f"{COMPARED}.includes('ball') && !{SUMMARY}.includes('nothing here')")
    ghost_and_beside(page)
    x, y = page.place("#slider")
    page.drag((x, y), (x + 100, y), (WINDOW[0] - 2, y))
    page.until(f"{STAT}.drawn === {last} && {STAT}.bodies === {bodies + 1}")
    page.until(f"{COMPARED}.length === 0 && {SUMMARY}.includes('nothing here')")
    page.click("#branch")
    assert "--from" in page.until("document.querySelector('dialog code')?.textContent")
    page.click("dialog .primary")


def keep_the_layout(page: Page, address: str) -> None:
    """What is plotted and how the page is laid out are there again when it is loaded again."""
    page.press("t")
    page.click("#show-paths")
    x, y = page.place("#splitter")
    page.drag((x, y), (x - 40, y))
    page.click("#tab-plots")
    page.fill("#pick", PLOTTED)
    page.press("Enter")
    page.until(f"{LAYOUT}[1].startsWith('{PLOTTED}')")
    kept = page.get(LAYOUT)
    assert kept[0] == "light" and kept[2:] == ["tab-plots", "true", "false", "side", kept[-1]]
    page.open(address)
    page.until(
        f"JSON.stringify({LAYOUT}) === {json.dumps(json.dumps(kept, separators=(',', ':'), ensure_ascii=False))}"
    )
    page.until("document.querySelector('.charts canvas').width > 0")


def drawn_by_radio(page: Page) -> None:
    page.until(f"{STAT}.drawn >= 0 && {STAT}.radio > 0")
    assert page.colours() > SHAPES


def test_a_page_shows_a_run_and_its_capture_and_does_what_people_ask(house: House, tmp_path: Path) -> None:
    path = find_chromium()
    if path is None:
        pytest.skip("no chromium: apt-get install chromium")
    players = f"players={json.dumps({LINK[1]: PLAYER})}"
    up = house.up("--console", "--json", "--engine", "pure", "--set", players, players=True)
    addresses = addresses_of(house)
    with chromium(path, tmp_path) as page:
        page.size(*WINDOW)
        page.open(addresses["view"])
        look_only(page)
        page.open(addresses["operate"])
        page.until(f"{STAT}.drawn > 0 && {STAT}.role === 'operator'")
        assert page.colours() > SHAPES
        add_and_move(page)
        cut_and_heal(page)
        lose_the_supervisor(page, house, pause_and_step(page))
        end_the_run(page)
        code, out, err = house.end(up)
        assert code == 0, err
        ended = last_json(out)
        assert ended["capture"] in page.text("#banner")
        page.open("about:blank")  # a page of a console that has ended tries again, and the browser complains
        page.complaints.clear()
        capture = house.folder / ended["capture"]
        assert [entry["what"] for entry in ended["recoveries"]] == ["supervisor"] and ended["moves"] == 1
        with served(lambda: open_sources(capture, capture, 20_000_000)) as address:
            page.open(address)
            slide(page, ended["ticks"])
            keep_the_layout(page, address)
        radio = tmp_path / "warehouse.mcap"
        rehearse(WAREHOUSE.read_text(), WAREHOUSE.name, 100, 2, ["engine=pure"], capture=radio)
        with served(lambda: open_sources(radio)) as address:
            page.open(address)
            drawn_by_radio(page)
        assert page.complaints == []
