"""The console's page in a real browser, live and over captures, asked as people ask it: by pointer and keys."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import pytest

from foosim.cli.view import open_sources
from foosim.simulation.run import rehearse
from tests.simulation.conftest import SPARE, TICKS, capture_to
from tests.wire.chromium import Page, chromium, find_chromium
from tests.wire.conftest import in_process
from tests.wire.served import served
from tests.wire.test_run import NODES, last_json

if TYPE_CHECKING:
    from tests.wire.conftest import House

WAREHOUSE = Path(__file__).parent.parent.parent / "deploy" / "warehouse.yaml"
ROBOTS = {f"red.{line}": ["encoder"] for line in ("goal", "defence", "midfield", "attack")} | {"camera": ["ball"]}
PLAYER = {
    "class": "foosim.library.table.players.football:Team",
    "rate": "50 Hz",
    "robots": ROBOTS,
    "parameters": {"team": "red"},
}
BELOW = ("#camera", ".signs")
LINK = ("camera", "player-red")
STAT = "window.foosim.stat"
WINDOW = 860, 480
REFRESH_HZ = 3.0
CHEAP = "--disable-gpu-compositing"
"""Where a GPU is software, the page around the view costs less without it."""
DRIVER = "GL Driver Message (OpenGL, Performance"
"""What the browser then says of how it gets at the view: the page has no part in it."""
FRAMES_EVERY = 10
"""Ticks, as the table is captured; what is between them is computed."""
OFFSET_NS = 20_000_000
OFFSET_TICKS = 10
TICK_S = 0.002
ROWS = "[...document.querySelectorAll('#panel-%s tr:not(.u-series):has(td)')].map((row) => row.textContent)"
"""The rows of a panel's tables, without those of the charts' legends."""
COMPARED = ROWS % "compare"
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
CARRIED = """[
  document.querySelector(".chip.dragged")?.textContent, document.querySelector(".node.target")?.dataset.node,
]"""
WIDER = "(one) => one.scrollWidth > one.clientWidth"
CAUSES = "table.links td:last-child", "#panel-network .bar > span"
JOB = "(document.querySelector('.jobs li')?.textContent ?? '')"
NOWHERE = 2.0, 2.0
TRIES = 50
"""What comes meanwhile may move a thing from below the pointer; that often in a row it does not."""
INK = """[...document.querySelectorAll("%s canvas")].filter((one) => one.width > 0 && one.height > 0).map((one) => {
  const copy = new OffscreenCanvas(one.width, one.height).getContext("2d", {willReadFrequently: true});
  copy.drawImage(one, 0, 0);
  const {data} = copy.getImageData(0, 0, one.width, one.height);
  const grey = (at) => Math.max(data[at], data[at + 1], data[at + 2]) - Math.min(data[at], data[at + 1], data[at + 2]);
  return Array.from({length: data.length / 4}, (_, pixel) => 4 * pixel).filter((at) => grey(at) > 80).length;
})"""
"""How many pixels of each chart have a colour: those of lines, not of axes."""
TOASTS = """(window.toasts = [], new MutationObserver((all) => all.forEach(({addedNodes}) =>
  addedNodes.forEach((one) => window.toasts.push(`${one.className}: ${one.textContent}`)))
).observe(document.querySelector("#toasts"), {childList: true}), true)"""
"""Keeps what the page says for some seconds."""


PORTER = (
    "--set", "robots.porter={model: holonomic, at: {x: 3 m}, actuators: {drive: {kind: go_to}}, "
    "sensors: {jobs: {kind: job, actuator: drive, rate: 5 Hz}}}",
    "--set", "robots.cart={model: differential_drive, at: {x: 5 m}}",
    "--set", "nodes.blue.robots=[rest]", "--set", "clients={desk: {console: true}}",
)  # fmt: skip
"""Robots beside the table that the console can send and drive."""


def addresses_of(house: House) -> dict[str, str]:
    """The addresses of the live run's page, once its console serves it."""
    path = house.live().path / "console.json"

    def told() -> dict[str, str] | None:
        return json.loads(path.read_text()) if path.exists() else None

    return house.wait_for("the console's addresses", told)


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """One tab of one browser. Who runs the tests for others has to have it."""
    path = find_chromium()
    if path is None:
        missing = "no chromium: apt-get install chromium"
        if os.environ.get("CI"):
            pytest.fail(missing)
        pytest.skip(missing)
    with chromium(path, tmp_path_factory.mktemp("chromium"), CHEAP) as page:
        page.refresh(REFRESH_HZ)
        page.size(*WINDOW)
        yield page


@contextmanager
def looking(page: Page, address: str) -> Iterator[None]:
    """Look at an address. Nothing is to be complained of, but that a console which has gone is tried again."""
    page.complaints.clear()
    page.open(address)
    page.get(TOASTS)
    try:
        yield
        ended = page.get(f"!{STAT}.connected")
    finally:
        page.get("localStorage.clear()")
        page.open("about:blank")
    tries = f"WebSocket connection to 'ws://{urlsplit(address).netloc}/ws' failed"
    assert [one for one in page.complaints if DRIVER not in one and not (ended and one.startswith(tries))] == []


def told(page: Page, kind: str, text: str) -> str:
    """What the page says for some seconds: of which kind, with which text."""
    return str(page.until(f"window.toasts.find((one) => one.startsWith('toast {kind}:') && one.includes('{text}'))"))


def send(page: Page) -> None:
    """Send the form of the dialog, which closes when it was accepted."""
    page.click("dialog [type=submit]")
    page.until("!document.querySelector('dialog')")


def state(page: Page, name: str) -> None:
    page.until(f"document.querySelector('#state').textContent.includes('{name}')")


def world_is_drawn(page: Page) -> None:
    page.until(f"{STAT}.drawn >= 0 && {STAT}.links > 0 && {STAT}.view === '3d'")
    assert page.colours() > SHAPES
    assert page.text("#banner") == "" or page.get("document.querySelector('#banner').hidden")


def look_only(page: Page) -> None:
    """Who looks sees the world go on, and is refused whatever is asked."""
    world_is_drawn(page)
    page.until(f"{STAT}.role === 'viewer'")
    page.until("['play', 'step', 'pace'].every((id) => document.getElementById(id).disabled)")
    page.until("document.querySelector('#down').hidden && document.querySelector('#add').hidden")
    page.press(" ")
    assert "operate" in told(page, "error", "")
    tick = page.get(f"{STAT}.drawn")
    page.until(f"{STAT}.drawn > {tick} + 1")
    state(page, "running")


def tabs_are_filled(page: Page) -> None:
    """The tabs say what there is: robots, links with packets, nodes with what they own."""
    page.click("#tab-world")
    page.until("document.querySelector('.entities').textContent.includes('red.goal')")
    assert page.text("#panel-world .heads") == "EntityModelComputed by"
    page.click("#tab-network")
    page.until("document.querySelectorAll('table.links tbody tr').length > 1")
    page.click("#tab-machines")
    for node in ("red", "blue"):
        page.until(f"document.querySelector('[data-node={node}] .robots').textContent.includes('{node}.goal')")
    page.until(f"{ROWS % 'machines'}.some((row) => row.startsWith('vhubvhubmain'))")
    page.click("#tab-log")
    page.until(f"{ROWS % 'log'}[0].startsWith('None so far. A first experiment: push ')")


def add_and_move(page: Page) -> None:
    """A spare ball is added where it is wanted, and removed, in the same scene; a robot is dragged to another node."""
    page.until(f"{STAT}.absent === 1")
    generation = page.get(f"{STAT}.generation")
    page.click("#tab-world")
    page.click(".entities .absent button", "ball-2")
    page.click("#add-selected")
    page.until(
        "document.querySelector('#add-which').value === 'ball-2' && !document.querySelector('#add-node').offsetParent"
    )
    page.fill("#add-x", "9")
    page.click("dialog [type=submit]")
    page.until("document.querySelector('dialog .wrong').textContent.includes('outside of the table')")
    page.fill("#add-x", "0.5")
    page.fill("#add-y", "0.2")  # where no figure comes
    send(page)
    page.until(f"{STAT}.absent === 0 && !document.querySelector('.entities .absent')")
    assert page.colours() > SHAPES
    page.click("#remove")
    send(page)
    page.until(f"{STAT}.absent === 1 && document.querySelector('.entities .absent').textContent.includes('ball-2')")
    assert page.get(f"{STAT}.generation") == generation
    page.click("#tab-machines")
    for _ in range(TRIES):
        (x, y), card = page.place("[data-node=red] .chip", "red.goal"), page.place("[data-node=blue]")
        page.hold((x, y), (x, y + 20), card)
        if page.get(CARRIED) == ["red.goal", "blue"]:
            break
        page.let_go(NOWHERE)
    else:
        raise AssertionError(f"a robot cannot be dragged to a node: {page.get(CARRIED)}")
    page.let_go(card)
    page.until("document.querySelector('[data-node=blue] .robots').textContent.includes('red.goal')")


def send_a_robot(page: Page) -> None:
    """A robot is sent where one clicks, and called off."""
    page.click("#tab-world")
    page.click(".entities button", "porter")
    page.click("#send")
    page.until("document.querySelector('#view').classList.contains('aiming')")
    page.drag(page.place("#view canvas"))
    page.until(f"{JOB}.includes(': running')")
    assert not page.get("document.querySelector('#view').classList.contains('aiming')")
    assert page.get("document.querySelector('.entities [aria-pressed=true]').textContent").startswith("porter")
    page.click(".jobs .cancel")
    page.until(f"{JOB}.includes(': cancelled')")
    page.until("!document.querySelector('.jobs .cancel').offsetParent")


def drive_a_robot(page: Page) -> None:
    """A pressed arrow key moves the robot, the released one stops it."""
    page.click(".entities button", "cart")
    page.click("#drive")
    page.click("#tab-log")
    page.press("ArrowUp")
    for number in (1, 0):
        page.until(f"document.querySelector('#panel-log').textContent.includes('cart/motion: linear {number}')")
    page.click("#tab-world")
    page.click("#drive")


def cut_and_heal(page: Page) -> None:
    """A link is chosen, plotted, cut off, its drops explained, and healed."""
    page.click("#tab-network")
    page.click("table.links tbody tr", "".join(LINK))
    page.until(f"{INK % '#panel-network .charts'}[0] > 0")
    page.click("button", "Plot delay")
    page.until(f"document.querySelector('#panel-plots .lines').textContent.includes('{LINK[0]} → {LINK[1]}: delay')")
    page.until(f"{INK % '#panel-plots .charts'}[0] > 0")
    page.click("#tab-network")
    page.click("#partition")
    page.until(f"document.querySelector('dialog input').value === '{LINK[0]}'")
    send(page)
    assert "partition" in page.until("document.querySelector('.drops details')?.textContent")
    page.until("document.querySelector('table.links tr[aria-selected=true]').textContent.includes('partition')")
    for cut in CAUSES:
        assert page.get(f"[...document.querySelectorAll({cut!r})].filter((one) => one.textContent).length")
        assert page.get(f"[...document.querySelectorAll({cut!r})].filter({WIDER}).map((one) => one.textContent)") == []
    page.click("#heal")
    send(page)
    page.until("document.querySelector('.disturbances').textContent.includes('heal all')")


def pause_and_step(page: Page) -> int:
    """Pause and step by key and by button; each answer is shown, and kept with who asked. Returns the tick."""
    page.get("document.activeElement.blur()")  # a button in focus has the space bar for itself
    page.press(" ")
    told(page, "answer", "paused")
    state(page, "paused")
    page.until(f"{STAT}.paused && {STAT}.drawn === {STAT}.tick")
    tick = int(page.get(f"{STAT}.tick"))
    page.click("#step")
    page.until(f"{STAT}.drawn === {tick + 1}")
    page.press(".")
    page.until(f"{STAT}.drawn === {tick + 2}")
    state(page, "paused")
    page.click("#tab-log")
    asked = "[...document.querySelectorAll('#panel-log tbody tr')].map((row) => row.children[2].textContent)"
    page.until(f"{asked}.slice(0, 3).join() === 'step,step,pause'")
    assert "browser" in page.text("#panel-log tbody tr td:nth-child(2)")
    return tick + 2


def lose_the_supervisor(page: Page, house: House, tick: int) -> None:
    """The page keeps what it shows, and goes on with the next supervisor."""
    page.click("#tab-machines")
    house.kill("supervisor")
    page.until("document.querySelector('.recoveries').textContent.includes('the supervisor was started again')")
    state(page, "paused")
    assert page.get(f"{STAT}.tick") == tick
    page.click("#play")
    state(page, "running")
    page.until(f"{STAT}.drawn > {tick}")


def end_the_run(page: Page) -> str:
    """The page says how the run has ended, also when its console has gone. Returns what the banner says."""
    page.click("#down")
    assert "ends for everybody" in page.text("dialog")
    send(page)
    page.until("!document.querySelector('#banner').hidden")
    banner = page.text("#banner")
    page.until(f"!{STAT}.connected")
    assert page.text("#banner") == banner
    assert "The run has ended at tick" in banner and "foosim view" in banner
    state(page, "ended")
    page.until("['play', 'step', 'pace', 'down'].every((id) => document.getElementById(id).disabled)")
    return banner


def test_a_page_shows_a_run_and_does_what_people_ask(browser: Page, house: House) -> None:
    page, player = browser, {**PLAYER, "process": "main"}
    players = f"players={json.dumps({LINK[1]: player})}"
    alone = *in_process("null", "supervisor"), *in_process("main", *NODES)  # it is killed without the vHub
    up = house.up(
        "--console", "--json", "--engine", "pure", "--set", players, "--set", SPARE, *PORTER, *alone, players=True
    )
    addresses = addresses_of(house)
    with looking(page, addresses["view"]):
        look_only(page)
    with looking(page, addresses["operate"]):
        world_is_drawn(page)
        page.until(f"{STAT}.role === 'operator'")
        tabs_are_filled(page)
        add_and_move(page)
        send_a_robot(page)
        drive_a_robot(page)
        cut_and_heal(page)
        lose_the_supervisor(page, house, pause_and_step(page))
        banner = end_the_run(page)
    code, out, err = house.end(up)
    assert code == 0, err
    ended = last_json(out)
    assert ended["capture"] in banner and f"at tick {ended['ticks']}" in banner
    assert ended["moves"] == 1 and "supervisor" in [entry["what"] for entry in ended["recoveries"]]


def play_and_seek(page: Page, last: int) -> None:
    """A capture plays to its end; the slider seeks; a step is exact, and the poses are drawn as they were."""
    page.until(f"{STAT}.marks > 0")
    state(page, "recording, paused")
    assert page.text("#play") == "Play"
    page.press(" ")
    page.until(f"{STAT}.drawn === {last} && {STAT}.paused")
    page.click("#show-radio")  # what flashes there fades with time
    as_two(page, "single")
    at_end = page.seen()
    slider = page.place("#slider")
    page.drag(slider)
    page.until(f"Math.abs({STAT}.drawn - {last / 2}) < {last / 20}")
    tick = page.get(f"{STAT}.drawn")
    halfway = page.seen()
    assert halfway != at_end
    page.click("#frame-on")
    frame = page.until(f"{STAT}.drawn > {tick} && {STAT}.drawn % {FRAMES_EVERY} === 0 && {STAT}.drawn")
    page.press(".")
    page.until(f"{STAT}.drawn === {frame + 1}")
    page.drag(slider, (WINDOW[0] - 2, slider[1]))
    page.until(f"{STAT}.drawn === {last}")
    assert page.seen() == at_end
    page.drag(slider)
    page.until(f"{STAT}.drawn === {tick}")
    assert page.seen() == halfway


def as_two(page: Page, how: str) -> list[int]:
    """Choose how the second source is shown; returns what is seen."""
    page.choose("#two", how)
    return page.seen()


def ghost_and_beside(page: Page) -> None:
    """The second source is a ghost, or beside the first one, or not shown."""
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


def compare(page: Page, last: int) -> None:
    """The distance to the second capture is told where there is one, and where there is none it is said where it is."""
    page.click("#tab-compare")
    for entity in ("ball", "ball-2"):
        page.until(f"{COMPARED}.some((row) => /^{entity}0[.][0-9]+ m$/.test(row))")
    assert "nothing here" not in page.get(SUMMARY)
    page.until(f"{INK % '#panel-compare'}[0] > 0")
    ghost_and_beside(page)
    x, y = page.place("#slider")
    page.drag((x, y), (WINDOW[0] - 2, y))
    page.until(f"{STAT}.drawn === {last} && {COMPARED}.length === 0 && {SUMMARY}.includes('nothing here')")
    has = re.search(r" has (-?[0-9.]+) s to ([0-9.]+) s of this clock, and nothing here$", page.get(SUMMARY))
    assert has is not None, page.get(SUMMARY)
    assert [float(has[1]), float(has[2])] == [-OFFSET_TICKS * TICK_S, (last - OFFSET_TICKS) * TICK_S]
    page.drag((x, y))
    page.until(f"{COMPARED}.length > 0 && !{SUMMARY}.includes('nothing here')")


def branch(page: Page) -> None:
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
    again = json.dumps(json.dumps(kept, separators=(",", ":"), ensure_ascii=False))
    page.until(f"JSON.stringify({LAYOUT}) === {again}")
    page.until(f"{STAT}.drawn > 0 && {INK % '#panel-plots .charts'}[0] > 0")


def test_a_page_shows_captures_two_in_one_view_and_keeps_its_layout(browser: Page, tmp_path: Path) -> None:
    page, capture = browser, capture_to(tmp_path / "run.mcap")
    with served(lambda: open_sources(capture, capture, OFFSET_NS)) as address, looking(page, address):
        world_is_drawn(page)
        play_and_seek(page, TICKS)
        compare(page, TICKS)
        branch(page)
        keep_the_layout(page, address)
    radio = tmp_path / "warehouse.mcap"
    sets = ["engine=pure", "robots.rover01.sensors.eye={kind: camera, rate: 5 Hz}"]
    rehearse(WAREHOUSE.read_text(), WAREHOUSE.name, 50, 2, sets, capture=radio)
    with served(lambda: open_sources(radio)) as address, looking(page, address):
        world_is_drawn(page)
        page.until(f"{STAT}.radio > 0")
        menu, legend = (page.get(f"document.querySelector('{one}').getBoundingClientRect().toJSON()") for one in BELOW)
        assert 0 < menu["top"] < menu["bottom"] <= legend["top"] < legend["bottom"], "the menu covers no legend"
