"""Teams that people play: keys of a terminal, a gamepad."""

from __future__ import annotations

import json
import os
import pty
import select
import struct
import sys
import termios
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.common.errors import BadValue, UnknownName
from foosim.library.table.players.by_hand import DRAWN_RAD, DRAWN_S, KICK_S, KICKED_RAD, LIFTED_RAD, SWING_RAD_MAX
from foosim.library.table.players.gamepad import AGAIN_TICKS, Gamepad
from foosim.library.table.players.keyboard import SLIDE_M, SWING_RAD, Keyboard
from foosim.library.table.rod_position import Command
from foosim.library.table.settings import table_of
from tests.deployed import DEPLOYMENT, TABLE

SECOND_TICKS: Final = 1_000_000_000 // DEPLOYMENT.tick_ns
HALF_STROKE: Final = table_of(DEPLOYMENT).lines["goal"].half_stroke
PLAYS: Final = f"""
import json, select, sys
from pathlib import Path
from foosim.deployment.loader import load_deployment
from foosim.library.table.players.keyboard import Keyboard
deployment = load_deployment(Path({str(TABLE)!r}).read_text(), "table.yaml")
player = Keyboard(deployment, {{"team": sys.argv[1]}})
for turn in range(int(sys.argv[2])):
    select.select([0], [], [], 60.0)
    commands = player.act(5 * turn, {{}})
    print("told", json.dumps({{name: [command.slide, command.spin] for name, command in commands.items()}}), flush=True)
"""


def act(player: Any, seconds: float = 0.0) -> dict[str, Command]:
    return dict(player.act(round(seconds * SECOND_TICKS), {}))


# --- the gamepad ------------------------------------------------------------------------------------------------------


class Pad:
    """A gamepad of the kernel's interface: events are written into a pipe."""

    def __init__(self, folder: Path) -> None:
        self.device = folder / "js7"
        os.mkfifo(self.device)
        self._reader = os.open(self.device, os.O_RDONLY | os.O_NONBLOCK)
        self._file = os.open(self.device, os.O_WRONLY)

    def tell(self, kind: int, number: int, value: int) -> None:
        os.write(self._file, struct.pack("=IhBB", 0, value, kind, number))

    def button(self, number: int, value: int = 1) -> None:
        self.tell(1, number, value)

    def axis(self, number: int, share: float) -> None:
        self.tell(2, number, round(share * 32767))

    def tell_a_part(self) -> None:
        os.write(self._file, b"\0\0\0")

    def unplug(self) -> None:
        self.device.unlink()

    def close(self) -> None:
        os.close(self._file)
        os.close(self._reader)


@pytest.fixture
def pad(tmp_path: Path) -> Any:
    pad = Pad(tmp_path)
    yield pad
    pad.close()


@pytest.mark.parametrize(("team", "right", "forward"), [("red", -1.0, -1.0), ("blue", 1.0, 1.0)])
def test_sticks_slide_and_turn_the_rod_that_is_held(pad: Pad, team: str, right: float, forward: float) -> None:
    """Red attacks along +x, so its right is -y, and a positive spin moves feet towards -x."""
    player = Gamepad(DEPLOYMENT, {"team": team, "device": str(pad.device)})
    assert act(player)[f"{team}.goal"] == Command(0.0, 0.0)
    pad.tell(0x82, 4, 0)  # the kernel tells each axis once at the beginning
    pad.axis(0, 1.0)
    pad.axis(4, -0.5)
    found = act(player)
    assert found[f"{team}.goal"].slide == pytest.approx(right * HALF_STROKE)
    assert found[f"{team}.goal"].spin == pytest.approx(forward * 0.5 * SWING_RAD_MAX, rel=1e-3)
    assert found[f"{team}.defence"] == Command(0.0, 0.0) and len(found) == 4
    pad.axis(0, 0.05)
    assert act(player)[f"{team}.goal"].slide == 0.0, "near the middle is the middle"


def test_buttons_change_the_rod_and_lift_and_shoot(pad: Pad) -> None:
    player = Gamepad(DEPLOYMENT, {"team": "blue", "device": str(pad.device)})
    pad.button(5)
    pad.button(1)
    assert act(player)["blue.defence"].spin == LIFTED_RAD
    pad.button(1, 0)
    assert act(player)["blue.defence"].spin == 0.0
    pad.button(4)
    pad.button(4)
    pad.button(0)
    assert act(player, 1.0)["blue.attack"].spin == DRAWN_RAD, "the rod before the first is the last"
    assert act(player, 1.0 + DRAWN_S + 0.01)["blue.attack"].spin == KICKED_RAD
    assert act(player, 1.0 + DRAWN_S + KICK_S + 0.01)["blue.attack"].spin == 0.0


def test_half_an_event_waits_for_its_rest(pad: Pad) -> None:
    player = Gamepad(DEPLOYMENT, {"team": "blue", "device": str(pad.device)})
    pad.tell_a_part()
    assert act(player)["blue.goal"].slide == 0.0
    os.write(pad._file, struct.pack("=IhBB", 0, 32767, 2, 0)[3:])
    assert act(player)["blue.goal"].slide == pytest.approx(HALF_STROKE)


def test_a_gamepad_that_is_not_there_is_refused_and_one_that_leaves_may_come_back(
    tmp_path: Path, pad: Pad, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(BadValue, match=r"unknown gamepad \(there are: .*\), '/"):
        Gamepad(DEPLOYMENT, {"team": "red", "device": str(tmp_path / "js8")})
    with pytest.raises(BadValue, match="parameter device is not the path of a device, 7"):
        Gamepad(DEPLOYMENT, {"team": "red", "device": 7})
    with pytest.raises(
        UnknownName, match=r"unknown parameter \(there are: device, team\), 'devise', nearest is 'device'"
    ):
        Gamepad(DEPLOYMENT, {"team": "red", "devise": "/dev/input/js1"})
    player = Gamepad(DEPLOYMENT, {"team": "blue", "device": str(pad.device)})
    pad.axis(0, 1.0)
    act(player)
    assert player._file is not None
    os.close(player._file)
    player._file = os.open(tmp_path, os.O_RDONLY)  # what cannot be read, as a device that is gone
    assert act(player)["blue.goal"].slide == pytest.approx(HALF_STROKE), "the rods stay"
    assert "rods stay until it is back" in capsys.readouterr().err
    pad.axis(0, -1.0)
    assert act(player)["blue.goal"].slide == pytest.approx(HALF_STROKE), "it is looked for once a second"
    again_s = AGAIN_TICKS / SECOND_TICKS
    assert act(player, again_s)["blue.goal"].slide == pytest.approx(-HALF_STROKE)


# --- the keyboard -----------------------------------------------------------------------------------------------------


class Terminal:
    """A terminal with a process in its foreground that plays."""

    def __init__(self, team: str, turns: int) -> None:
        self.process, self.file = pty.fork()
        if self.process == 0:
            os.execv(sys.executable, [sys.executable, "-c", PLAYS, team, str(turns)])
        self.mode = termios.tcgetattr(self.file)
        self._text = ""

    def line(self, start: str) -> str:
        """Return the next line with this start."""
        while True:
            line, end, rest = self._text.partition("\n")
            if end:
                self._text = rest
                if line.startswith(start):
                    return line
                continue
            assert select.select([self.file], [], [], 60.0)[0], self._text
            self._text += os.read(self.file, 4096).decode()

    def press(self, keys: str) -> dict[str, list[float]]:
        """Press keys, and return what the player told after them."""
        os.write(self.file, keys.encode())
        found: dict[str, list[float]] = json.loads(self.line("told ").removeprefix("told "))
        return found

    def end(self) -> int:
        """Wait for the end of the process; return its exit code."""
        return os.waitstatus_to_exitcode(os.waitpid(self.process, 0)[1])


def test_keys_play_and_the_terminal_gets_its_mode_back() -> None:
    terminal = Terminal("red", turns=6)
    assert "you play red. 1 2 3 4: hold goal" in terminal.line("you play")
    assert termios.tcgetattr(terminal.file)[3] != terminal.mode[3], "keys come without Enter"
    assert terminal.press("dd")["red.goal"] == [pytest.approx(-2 * SLIDE_M), 0.0]
    assert terminal.press("\x1b[D")["red.goal"] == [pytest.approx(-SLIDE_M), 0.0]
    assert terminal.press("4w")["red.attack"] == [0.0, pytest.approx(-SWING_RAD)]
    assert terminal.press("l")["red.attack"] == [0.0, pytest.approx(-LIFTED_RAD)]
    assert terminal.press("r\t ")["red.attack"] == [0.0, 0.0]
    told = terminal.press("x")
    assert told["red.goal"] == [pytest.approx(-SLIDE_M), pytest.approx(-DRAWN_RAD)], "after the last rod the first"
    assert terminal.end() == 0
    assert termios.tcgetattr(terminal.file) == terminal.mode


def test_without_a_terminal_the_message_names_the_setting(monkeypatch: pytest.MonkeyPatch) -> None:
    with open(os.devnull, encoding="utf-8") as nothing:
        monkeypatch.setattr(sys, "stdin", nothing)
        with pytest.raises(BadValue, match="the keyboard needs a terminal: declare the player with `launch: manual`"):
            Keyboard(DEPLOYMENT, {"team": "red"})
    inner, outer = pty.openpty()
    with open(outer, encoding="utf-8") as background:
        monkeypatch.setattr(sys, "stdin", background)
        with pytest.raises(BadValue, match="this process is in the background"):
            Keyboard(DEPLOYMENT, {"team": "red"})
    os.close(inner)
    with pytest.raises(BadValue, match="parameter team is not one of red, blue, 'green'"):
        Keyboard(DEPLOYMENT, {"team": "green"})
