"""`python -m docs.pictures [names...]`: makes the pictures of the docs from real runs, as Chromium shows the console.

Seeds are fixed, and each picture is of a fixed tick: a live run is stepped to that tick, a capture is sought there.
Figures of the wall clock (lag, loads, the run's pace) differ from one set of pictures to the next.
Neighbours: `tests.wire.chromium` (the browser), `tests.wire.served` (captures served from this process).
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from bench.machine import children
from bench.runs import ROOT, TABLE, name_of
from foosim.cli.view import open_sources
from foosim.client import control
from foosim.common.errors import Refused
from foosim.runtime.run_folder import find_run
from foosim.simulation.run import rehearse
from tests.wire.chromium import Page, chromium, find_chromium
from tests.wire.served import served

TO: Final = ROOT / "docs" / "pictures"
WAREHOUSE: Final = ROOT / "deploy" / "warehouse.yaml"
SIZE_PX: Final = 1280, 800
LARGEST_BYTES: Final = 120_000
LIMIT_S: Final = 300.0
SEED: Final = 9
RUN: Final = "saturday"
SLOW: Final = "0.02x"
"""While processes start: the first tick to show must not be over."""
PACE: Final = "0.5x"
"""Two cores that others use as well keep up with it."""
TABLE_TICK: Final = 2500
KILL_TICK: Final = 2700
CUT_TICK: Final = 3000
END_TICK: Final = 3400
LINK: Final = "camera", "player-red"
CUT: Final = {"partition": [[LINK[0]], [LINK[1]]], "for": "60 ms"}
HALL_TICKS: Final = 1500
HALL_TICK: Final = 1250
PLAY_TICKS: Final = 3000
PLAY_TICK: Final = 2100
WORSE: Final = "network.links=[{id: worse, from: '*', to: '*', delay: 1 ms, loss: 20 %, order: fifo}]"
"""The second match's: it differs from the first one in this alone."""
STAT: Final = "window.foosim.stat"
PLOTTED: Final = (
    "ball position.x",
    "ball position.y",
    "command red.goal/position.slide",
    "command blue.goal/position.slide",
    "link camera → player-red: delay",
    "link camera → player-blue: delay",
)


@dataclass(frozen=True, slots=True)
class Album:
    """A browser and where its pictures go; `wanted` are their names."""

    page: Page
    wanted: Sequence[str]
    folder: Path

    def take(self, name: str) -> None:
        """Keep a picture of the page, once it is drawn and passing messages are gone."""
        if name not in self.wanted:
            return
        self.page.get("document.activeElement.blur()")
        self.page.until(f"!document.querySelector('.toast') && !{STAT}.flashing")
        self.page.get("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        path = self.folder / f"{name}.webp"
        self.page.picture(path)
        size = path.stat().st_size
        assert size < LARGEST_BYTES, f"{path}: {size} bytes are too many for the repository"
        print(f"{path}: {size / 1000:.0f} kB", flush=True)


def waited(what: str, found: Callable[[], Any]) -> Any:
    """Return the first true value of `found`."""
    deadline_s = time.monotonic() + LIMIT_S
    while time.monotonic() < deadline_s:
        with suppress(Refused):
            value = found()
            if value:
                return value
        time.sleep(0.1)
    raise TimeoutError(f"waited {LIMIT_S:.0f} s for {what}")


def step_to(page: Page, tick: int) -> None:
    """Step a paused run to a tick, and wait for the page to show it."""
    control.request("step", RUN, count=tick - int(control.status(RUN)["ticks"]))
    waited(f"tick {tick}", lambda: control.status(RUN)["ticks"] == tick)
    page.until(f"{STAT}.drawn === {tick} && {STAT}.paused")


@contextmanager
def running(folder: Path) -> Iterator[tuple[int, str]]:
    """Run the table with its console, paused; gives the launcher's process id and the address for who operates."""
    command = (
        *(Path(sys.executable).parent / "foosim", "up", TABLE, "--run", RUN, "--seed", str(SEED)),
        *("--pace", SLOW, "--console", "--no-capture", "--json"),
    )
    with (folder / "up.log").open("w") as log:
        up = subprocess.Popen(command, cwd=folder, stdout=log, stderr=log, process_group=0)
    try:
        path = waited("the run", lambda: find_run(RUN)).path / "console.json"
        waited("its first tick", lambda: control.status(RUN)["ticks"] > 0)
        control.request("pause", RUN)
        control.request("rate", RUN, pace=PACE)
        served = waited("the console", lambda: path.exists() and json.loads(path.read_text()))
        yield up.pid, str(served["operate"])
        control.request("down", RUN)
        up.wait(LIMIT_S)
    finally:
        if up.poll() is None:
            os.killpg(up.pid, signal.SIGINT)
            up.wait(LIMIT_S)


def live(album: Album, folder: Path) -> None:
    """The table live: its owners, a link that is cut off for a while, a node that is killed, plots."""
    page = album.page
    with running(folder) as (launcher, address):
        page.open(address)
        page.until(f"{STAT}.drawn >= 0 && {STAT}.role === 'operator'")
        page.click("#show-owners")
        page.click("#tab-plots")
        for name in PLOTTED[:4]:
            plot(page, name)
        page.click("#tab-network")
        step_to(page, TABLE_TICK)
        page.click("#tab-world")
        album.take("table")
        page.click("#tab-network")
        page.click("table.links tbody tr", "".join(LINK))
        step_to(page, KILL_TICK)
        (blue,) = (pid for pid, words in children(launcher).items() if name_of(words) == "blue")
        os.kill(blue, signal.SIGKILL)
        step_to(page, CUT_TICK)
        control.request("network", RUN, event=CUT)
        step_to(page, END_TICK)
        page.click(".drops summary", "partition")
        page.get("document.querySelector('.drops').scrollIntoView()")
        album.take("network")
        page.click("#tab-machines")
        page.until("document.querySelector('.recoveries').textContent.includes('node blue')")
        page.get("document.querySelector('.recoveries').scrollIntoView({block: 'end'})")
        album.take("machines")
        page.click("#tab-plots")
        for name in PLOTTED[4:]:
            plot(page, name)
        album.take("plots")


def plot(page: Page, name: str) -> None:
    """Pick a value by its name, as people do."""
    page.fill("#pick", name)
    page.click("#panel-plots [type=submit]")
    page.until("document.querySelector('#pick').value === ''")


def seek(page: Page, tick: int) -> None:
    """Put the slider to a tick, and wait until its frame is seen."""
    slider = "document.querySelector('#slider')"
    page.until(f"!{slider}.disabled")
    page.get("document.activeElement.blur()")  # a button in focus has the space bar for itself
    if not page.get(f"{STAT}.paused"):  # a short capture may be at its end
        page.press(" ")
        page.until(f"{STAT}.paused")
    page.get(f"{slider}.value = {tick}, {slider}.dispatchEvent(new Event('change'))")
    page.until(f"{STAT}.drawn === {tick} && {STAT}.marks > 0")


def hall(album: Album, folder: Path) -> None:
    """The warehouse, from its capture: radio links in the colour of their loss."""
    capture, page = folder / "warehouse.mcap", album.page
    sets = [f"seed={SEED}"]
    rehearse(WAREHOUSE.read_text(), WAREHOUSE.name, HALL_TICKS, 2, sets, capture=capture, folder=WAREHOUSE.parent)
    with served(lambda: open_sources(capture)) as address:
        page.open(address)
        page.click("#tab-network")
        page.click("table.links thead button", "Loss")
        seek(page, HALL_TICK)
        page.until(f"{STAT}.radio > 0")
        album.take("warehouse")


def ghost(album: Album, folder: Path) -> None:
    """Two matches with one seed, of which one has a worse network."""
    first, second = folder / "match.mcap", folder / "worse.mcap"
    for path, sets in ((first, []), (second, [WORSE])):
        rehearse(TABLE.read_text(), TABLE.name, PLAY_TICKS, 2, [f"seed={SEED}", *sets], capture=path)
    page = album.page
    page.size(*SIZE_PX, dark=True)
    with served(lambda: open_sources(first, second)) as address:
        page.open(address)
        page.click("#tab-compare")
        flashed = page.get(f"{STAT}.flashes")
        seek(page, PLAY_TICK)
        page.until(f"{STAT}.flashes > {flashed}")
        page.until("document.querySelector('#panel-compare td')")
        album.take("ghost")


SETS: Final = (
    (("table", "network", "machines", "plots"), live),
    (("warehouse",), hall),
    (("ghost",), ghost),
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Make the pictures that are named, or all of them; return the exit code."""
    names = [name for made, _ in SETS for name in made]
    parser = argparse.ArgumentParser(prog="python -m docs.pictures", description="Make the pictures of the docs.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(names)}; all by default")
    parser.add_argument("--to", type=Path, default=TO, help="the folder that they are written to")
    chosen = parser.parse_args(arguments)
    unknown = sorted(set(chosen.names) - set(names))
    if unknown:
        parser.error(f"no picture {', '.join(unknown)}; there are {', '.join(names)}")
    path = find_chromium()
    if path is None:
        print("there is no chromium here: apt-get install chromium", file=sys.stderr)
        return 1
    wanted = chosen.names or names
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that the run and the browser end, too
    chosen.to.mkdir(parents=True, exist_ok=True)
    for made, make in SETS:
        if not set(made) & set(wanted):
            continue
        with tempfile.TemporaryDirectory() as state:
            os.environ["XDG_STATE_HOME"] = state  # the user's own runs keep their folders
            folder = Path(state)
            with chromium(path, folder) as page:
                page.size(*SIZE_PX)
                make(Album(page, wanted, chosen.to), folder)
                assert page.complaints == [], page.complaints
    return 0


if __name__ == "__main__":
    sys.exit(main())
