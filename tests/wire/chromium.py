"""Chromium without a window, told what to do over its DevTools protocol: a WebSocket, for which foosim has a library.

A page is waited for by what it says of itself, never by time. Browser drivers do the same over the same protocol;
they bring a Node.js of their own (Playwright, 165 MB) or a second server in between (Selenium).
"""

from __future__ import annotations

import base64
import json
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from websockets.sync.client import ClientConnection, connect

NAMES: Final = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
LIMIT_S: Final = 180.0
"""Only a page that hangs takes as long."""
FLAGS: Final = (
    "--headless=new",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--remote-debugging-port=0",
    "--no-first-run",
    "--no-proxy-server",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-dev-shm-usage",
    "--disable-extensions",
    "--disable-features=OptimizationHints,MediaRouter,Translate",
    "--disable-sync",
    "--hide-scrollbars",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
    "--mute-audio",
)
KEYS: Final = {
    "Enter": ("\r", 13),
    "Escape": ("", 27),
    "ArrowLeft": ("", 37),
    "ArrowUp": ("", 38),
    "ArrowRight": ("", 39),
    " ": (" ", 32),
}
FOUND: Final = """(() => {
  const one = [...document.querySelectorAll(%s)].find((one) => one.textContent.includes(%s) && !one.disabled);
  one.scrollIntoView({block: "nearest"});
  const box = one.getBoundingClientRect();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  return one.contains(document.elementFromPoint(x, y)) && %s;
})()"""
"""What is done with an element once it is seen."""
SEEN: Final = """new Promise((done) => {
  const small = new OffscreenCanvas(64, 64).getContext("2d", {willReadFrequently: true});
  let frames = window.foosim.stat.frames;
  const look = () => {
    if (window.foosim.stat.frames === frames) return void requestAnimationFrame(look);
    frames = window.foosim.stat.frames;
    small.drawImage(document.querySelector("#view canvas"), 0, 0, 64, 64);
    done([...new Uint32Array(small.getImageData(0, 0, 64, 64).data.buffer)]);
  };
  requestAnimationFrame(look);
  window.dispatchEvent(new Event("resize"));
  document.querySelector("#show-labels").click();
  document.querySelector("#show-labels").click();
})"""
"""Reads the view within a frame in which it was drawn: afterwards its buffer is the browser's."""
SLOW_DISPLAY: Final = """(() => {
  const next = window.requestAnimationFrame.bind(window);
  const wanted = new Map();
  let asked = 0;
  const draw = (now) => {
    const all = [...wanted.values()];
    wanted.clear();
    for (const one of all) {
      try {
        one(now);
      } catch (error) {
        reportError(error);
      }
    }
  };
  window.requestAnimationFrame = (one) => {
    if (!wanted.size) setTimeout(() => next(draw), %s);
    wanted.set(++asked, one);
    return asked;
  };
  window.cancelAnimationFrame = (one) => void wanted.delete(one);
})()"""
"""Software draws a frame of the view in 25 to 80 ms of processor time: a display of 60 Hz takes more than a core."""


def find_chromium() -> str | None:
    """Where chromium is, None where it is not."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class Page:
    """A tab; what it complains of is kept. It reaches this machine alone, and complains where it wants more."""

    def __init__(self, connection: ClientConnection) -> None:
        self.complaints: list[str] = []
        self._connection = connection
        self._asked = 0
        self._session = ""
        self._loaded = 0
        (target,) = [one for one in self._call("Target.getTargets")["targetInfos"] if one["type"] == "page"]
        attached = self._call("Target.attachToTarget", targetId=target["targetId"], flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self._call(f"{domain}.enable")

    def size(self, width: int, height: int, dark: bool = False) -> None:
        """Have a window of this size, in px, and a theme."""
        self._call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        theme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self._call("Emulation.setEmulatedMedia", features=[theme])

    def refresh(self, hertz: float) -> None:
        """Have a display with this refresh rate, from the next page that is loaded on."""
        self._call("Page.addScriptToEvaluateOnNewDocument", source=SLOW_DISPLAY % (1000 / hertz))

    def open(self, address: str) -> None:
        """Load a page anew, also where only what stands behind its # differs."""
        for one in ("about:blank", address):
            loaded = self._loaded
            self._call("Page.navigate", url=one)
            deadline_s = time.monotonic() + LIMIT_S
            while self._loaded == loaded:
                self._hear(deadline_s)

    def get(self, expression: str) -> Any:
        """Return the value of an expression in the page; a promise is awaited."""
        answer = self._call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise AssertionError(f"{expression}: {answer['exceptionDetails']['exception'].get('description')}")
        return answer["result"].get("value")

    def until(self, expression: str) -> Any:
        """Wait until an expression is true, and return its value."""
        look = f"const value = (() => {{ try {{ return {expression}; }} catch {{ return null; }} }})();"
        wait = f"const look = () => {{ {look} if (value) done(value); else setTimeout(look, 50); }}; look();"
        try:
            return self.get(f"new Promise((done) => {{ {wait} }})")
        except TimeoutError:
            shown = self.get("document.body.innerText.slice(0, 2000) + JSON.stringify(window.foosim?.stat)")
            raise AssertionError(f"the page waits for {expression}: {self.complaints}\n{shown}") from None

    def text(self, selector: str) -> str:
        """The text of an element."""
        return str(self.get(f"document.querySelector({json.dumps(selector)}).textContent"))

    def place(self, selector: str, text: str = "") -> tuple[float, float]:
        """The middle of the element that has this text in it, once it can be clicked there."""
        x, y = self.until(FOUND % (json.dumps(selector), json.dumps(text), "[x, y]"))
        return x, y

    def click(self, selector: str, text: str = "") -> None:
        """Click what has this text in it, where nothing covers it; at once, since what comes meanwhile moves it."""
        self.until(FOUND % (json.dumps(selector), json.dumps(text), "(one.focus(), one.click(), true)"))

    def drag(self, start: tuple[float, float], *ends: tuple[float, float]) -> None:
        """Press the pointer at a place, take it to others, and let go there."""
        self.hold(start, *ends)
        self.let_go(ends[-1] if ends else start)

    def hold(self, start: tuple[float, float], *ends: tuple[float, float]) -> None:
        """The same, without letting go."""
        self._point("mouseMoved", start, 0)
        self._point("mousePressed", start, 1)
        for end in ends:
            self._point("mouseMoved", end, 1)

    def let_go(self, place: tuple[float, float]) -> None:
        """Let go of the pointer at a place."""
        self._point("mouseReleased", place, 0)

    def press(self, key: str) -> None:
        """Press a key."""
        text, code = KEYS.get(key, (key, ord(key[0].upper())))
        named: dict[str, Any] = {"key": key, "windowsVirtualKeyCode": code}
        if text:
            named["text"] = text
        self._call("Input.dispatchKeyEvent", type="keyDown", **named)
        self._call("Input.dispatchKeyEvent", type="keyUp", key=key, windowsVirtualKeyCode=code)

    def choose(self, selector: str, value: str) -> None:
        """Choose an option of a list."""
        one = f"document.querySelector({json.dumps(selector)})"
        self.get(f"({one}.value = {json.dumps(value)}, {one}.dispatchEvent(new Event('change')))")

    def fill(self, selector: str, text: str) -> None:
        """Write into a field, in the place of what is there."""
        self.until(f"document.querySelector({json.dumps(selector)})?.select() ?? true")
        self._call("Input.insertText", text=text)

    def origins(self) -> set[str]:
        """Whom this page asked for its parts."""
        return set(self.get("[...performance.getEntriesByType('resource')].map(({name}) => new URL(name).origin)"))

    def seen(self) -> list[int]:
        """The colours of the view, 64 by 64 of them."""
        return list(self.get(SEEN))

    def colours(self) -> int:
        """How many colours the view has."""
        return len(set(self.seen()))

    def picture(self, path: Path, quality: int = 80) -> None:
        """Write what is seen as WebP."""
        shot = self._call("Page.captureScreenshot", format="webp", quality=quality)
        path.write_bytes(base64.b64decode(shot["data"]))

    def _point(self, kind: str, place: tuple[float, float], buttons: int) -> None:
        pressed = {} if kind == "mouseMoved" and not buttons else {"button": "left", "clickCount": 1}
        self._call("Input.dispatchMouseEvent", type=kind, x=place[0], y=place[1], buttons=buttons, **pressed)

    def _call(self, method: str, **parameters: Any) -> dict[str, Any]:
        self._asked += 1
        session = {"sessionId": self._session} if self._session else {}
        message = {"id": self._asked, "method": method, "params": parameters, **session}
        self._connection.send(json.dumps(message))
        deadline_s = time.monotonic() + LIMIT_S
        while True:
            answer = self._hear(deadline_s)
            if answer.get("id") == self._asked:
                assert "error" not in answer, f"{method}: {answer['error']}"
                result: dict[str, Any] = answer["result"]
                return result

    def _hear(self, deadline_s: float) -> dict[str, Any]:
        """Return the next message, after keeping what it tells. Raises TimeoutError."""
        message: dict[str, Any] = json.loads(self._connection.recv(max(0.0, deadline_s - time.monotonic())))
        told = message.get("params", {})
        match message.get("method"):
            case "Runtime.exceptionThrown":
                thrown = told["exceptionDetails"]
                self.complaints.append(str(thrown.get("exception", {}).get("description", thrown["text"])))
            case "Runtime.consoleAPICalled" if told["type"] in ("error", "warning", "assert"):
                self.complaints.append(" ".join(str(one.get("value", one)) for one in told["args"]))
            case "Log.entryAdded" if told["entry"]["level"] in ("error", "warning"):
                self.complaints.append(f"{told['entry']['text']} {told['entry'].get('url', '')}")
            case "Page.loadEventFired":
                self._loaded += 1
        return message


@contextmanager
def chromium(path: str, folder: Path, *flags: str) -> Iterator[Page]:
    """Run chromium, its profile in a folder; it ends with the block, with all of its processes."""
    root = ("--no-sandbox",) if os.geteuid() == 0 else ()  # the sandbox takes a user that is not root
    with (folder / "chromium.log").open("w") as log:
        process = subprocess.Popen(
            [path, *FLAGS, *flags, *root, f"--user-data-dir={folder / 'profile'}", "about:blank"],
            stdout=log,
            stderr=log,
            stdin=subprocess.DEVNULL,
            process_group=0,
        )
    try:
        with connect(_listening(process, folder / "profile"), max_size=None, proxy=None) as connection:
            yield Page(connection)
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def _listening(process: subprocess.Popen[bytes], profile: Path) -> str:
    """The address that chromium writes into its profile once it listens."""
    path, deadline_s = profile / "DevToolsActivePort", time.monotonic() + LIMIT_S
    while time.monotonic() < deadline_s and process.poll() is None:
        port, _, where = path.read_text().partition("\n") if path.exists() else ("", "", "")
        if where:
            return f"ws://127.0.0.1:{port}{where.strip()}"
        time.sleep(0.05)
    raise AssertionError(f"chromium does not listen: {(profile.parent / 'chromium.log').read_text()}")
