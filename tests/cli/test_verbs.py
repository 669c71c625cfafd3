"""The command `foosim` without a run: help, completion, what it refuses before anything starts, exit codes."""

import json
import re
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import typer

from foosim.cli import main
from foosim.cli.role import RoleVerbs
from foosim.cli.verbs import Foosim, summary
from foosim.deployment.loader import load_deployment
from foosim.deployment.text.files import read_deployment_text
from foosim.launcher import pki as certificates
from foosim.launcher import plan
from foosim.protocol.identity import identities_of
from foosim.runtime.command import summary_of
from foosim.runtime.run_folder import runs_folder
from tests.apart import apart
from tests.conftest import Command, Typed

TABLE = Path(__file__).parent.parent.parent / "deploy" / "table.yaml"


@pytest.fixture
def command(typed: Typed) -> Command:
    """Runs `foosim`."""
    return typed()


def groups() -> list[tuple[str, ...]]:
    """The words before the verbs of each group that imports its verbs when they are called."""
    return [(), ("role",)]


@pytest.mark.parametrize("group", groups(), ids=" ".join)
def test_help_shows_each_verb_with_the_whole_first_paragraph_of_its_own_help(
    typed: Typed, group: tuple[str, ...]
) -> None:
    table = RoleVerbs.table if group else Foosim.table
    done = typed(*group)("--help")
    assert done.code == 0
    shown = " ".join(done.out.split())
    for name, verb in [row for verbs in table.values() for row in verbs.items()]:
        own = typed(*group, *name.split())("--help")
        assert own.code == 0 and own.out.startswith(f"Usage: foosim {' '.join((*group, name))} ")
        command: Any = typer.main.get_command(import_module(f"foosim.{verb}").app)
        commands = getattr(command, "commands", {})
        command = commands.get(name, command)
        assert f"{name} {summary(name, verb)} " in f"{shown} "
        assert summary(name, verb) == summary_of(command)
        assert all(map(summary_of, [command, *commands.values()])), f"each command of {verb} has a help text"


@pytest.mark.parametrize("name", Foosim.plumbing)
def test_what_help_does_not_show_is_called_too(typed: Typed, name: str) -> None:
    done, hidden = typed(name)("--help"), typed()("--help")
    assert done.code == 0 and done.out.startswith(f"Usage: foosim {name} ") and f"\n  {name} " not in hidden.out


def test_no_word_prints_what_a_newcomer_can_do(typed: Typed, capsys: pytest.CaptureFixture[str]) -> None:
    """Four lines that parse."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["foosim"])
        main()
    lines = [line.split("  ")[1] for line in capsys.readouterr().out.splitlines() if line.startswith("  foosim ")]
    assert len(lines) == 4
    for line in lines:
        words = line.split()[1:]
        verb, arguments = Foosim(name="foosim").resolve_command(None, words)[1:]
        while hasattr(verb, "commands"):
            verb, arguments = verb.commands[arguments[0]], arguments[1:]
        assert verb.make_context("foosim", list(arguments)).params


def shell_words(typed: Typed, monkeypatch: pytest.MonkeyPatch, words: str) -> str:
    """What bash is offered for the last of some words."""
    monkeypatch.setenv("_FOOSIM_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(words.count(" ")))
    return typed()().out


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("foosim rec", ""),
        ("foosim reh", "rehearse"),
        ("foosim capture wh", "what-if"),
        ("foosim net par", "partition"),
        ("foosim role pl", "player"),
        ("foosim up --proc", "--processes"),
    ],
)
def test_shells_complete_verbs_and_options(
    typed: Typed, monkeypatch: pytest.MonkeyPatch, words: str, offered: str
) -> None:
    assert shell_words(typed, monkeypatch, words).split() == offered.split()


def test_a_valid_file_is_summed_up(command: Command) -> None:
    refused = command("check", TABLE, "--set", "table.ball.mass=20")
    assert refused.code == 2 and "--set:1:17: table.ball.mass: not a mass" in refused.err
    assert "seed: 77\n" in command("check", TABLE, "--set", "seed=77", "--expanded").out
    assert command("check", TABLE).out == f"{TABLE}: valid, world table, 9 robots on 2 nodes, 2 players\n"
    warehouse = TABLE.with_name("warehouse.yaml")
    written_out = load_deployment(command("check", warehouse, "--expanded").out, "expanded")
    assert written_out == load_deployment(warehouse.read_text(), "warehouse")
    assert json.loads(command("check", TABLE, "--json").out) == {
        "world": "table",
        "robots": 9,
        "nodes": ["blue", "red"],
        "players": ["player-blue", "player-red"],
    }


def test_all_problems_of_a_file_are_shown_with_their_places(command: Command, tmp_path: Path) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(TABLE.read_text().replace("seed: 1\n", "seed: -1\n").replace("engine: bullet", "engine: bulet"))
    done = command("check", path)
    assert done.code == 2
    lines = done.err.splitlines()
    assert [line.split(": ")[1] for line in lines] == ["seed", "engine"]
    assert all(line.startswith(f"{path}:") for line in lines)
    assert "nearest is 'bullet'" in lines[1]


def test_a_valid_file_whose_players_cannot_be_found_is_refused_but_for_those_on_other_machines(
    command: Command, tmp_path: Path
) -> None:
    path, text = tmp_path / "own.yaml", apart()
    assert text.count("class: foosim.library.table.players.football:Team") == 2
    path.write_text(text.replace("class: foosim.library.table.players.football:Team", "class: own_team:Team"))
    done = command("check", path)
    assert done.code == 2
    whose = [line.split(": ")[1] for line in done.err.splitlines()]
    assert whose == ["players.player-red.class", "players.player-blue.class"]
    lines = text.splitlines()
    number = next(at for at, line in enumerate(lines, 1) if "foosim.library.table.players.football:Team" in line)
    place = f"{path}:{number}:{lines[number - 1].index('foosim.') + 1}: "
    missing = "there is no module own_team (it is not beside the deployment or on PYTHONPATH), 'own_team:Team'"
    assert done.err.splitlines()[0] == f"{place}players.player-red.class: {missing}"
    away = path.read_text().replace("class: own_team:Team", "class: own_team:Team\n    host: arm")
    path.write_text(f"{away}\nhosts:\n  arm:\n    address: 192.0.2.7\n")
    assert command("check", path).code == 0


def test_a_file_that_is_not_there_is_bad_input(command: Command) -> None:
    done = command("up", "nowhere.yaml")
    assert (done.code, done.err) == (2, "nowhere.yaml: there is no such file\n")


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (("--set", "table.ball.mas=27 g"), 2, "--set:1:12: table.ball: unknown key, 'mas', nearest is 'mass'"),
        (("--set", "seed=2", "--set", "engine=bulet"), 2, "--set:2:8: engine: "),
        (("--engine", "bulet"), 2, "nearest is 'bullet'"),
        (
            ("--set", "players.player-red.class=foosim.library.table.players.football.Team"),
            2,
            "nearest is 'foosim.library.table.players.football:Team'",
        ),
        (
            ("--set", "players.player-red.class=foosim.library.table.players.football:Teem"),
            2,
            "nearest is 'foosim.library.table.players.football:Team'",
        ),
        (
            ("--set", "players.player-red.class=own:Acts"),
            2,
            "there is no module own (it is not beside the deployment or on PYTHONPATH), 'own:Acts'",
        ),
        (("--pace", "quick"), 2, "--pace: not a pace (realtime, fast or a factor such as 2x), 'quick'"),
        (("--for", "20"), 2, "--for: not a time (a number and one of ns, us, ms, s, min, h), '20', nearest is '20 s'"),
        (("--for", "0 s"), 2, "a run has at least one tick"),
        (("--seed", "-1"), 2, "seed: "),
        (("--listen", "nowhere:x"), 2, "not an address (HOST, HOST:PORT, tcp/HOST:PORT or tls/HOST:PORT), 'nowhere:x'"),
        (("--listen", "127.0.0.1:65535"), 2, "no room for 2 ports"),
        (("--listen", "0.0.0.0"), 3, "or --insecure to allow it"),
        (("--run", "Über"), 2, "--run: a name is a lower case letter, then"),
        (("--capture", "a.mcap", "--no-capture"), 2, "exclude each other"),
        (("--sed", "3"), 2, "foosim up: No such option: --sed (Possible options: --second, --seed, "),
        (("--seed", "x"), 2, "foosim up: Invalid value for '--seed': Input should be a valid integer"),
        (("--for",), 2, "foosim: Option '--for' requires an argument\n"),
        (("--json=1",), 2, "foosim: Option '--json' does not take a value\n"),
        (("more.yaml",), 2, "foosim up: Got unexpected extra argument(s) (more.yaml)\n"),
    ],
)
def test_what_is_wrong_with_a_run_is_said_before_anything_starts(
    command: Command, arguments: tuple[str, ...], code: int, text: str
) -> None:
    done = command("up", TABLE, *arguments)
    assert text in done.err
    assert done.code == code
    assert not runs_folder().exists() or list(runs_folder().iterdir()) == []


def test_an_existing_capture_is_refused_before_anything_starts(command: Command, tmp_path: Path) -> None:
    capture = tmp_path / "mine.mcap"
    capture.write_bytes(b"precious")
    done = command("up", TABLE, "--for", "1s", "--capture", capture)
    assert (done.code, done.err) == (3, f"{capture} exists, and a capture is never overwritten\n")
    assert capture.read_bytes() == b"precious"
    assert not runs_folder().exists()


def test_a_capture_that_cannot_be_created_is_refused_before_anything_starts(command: Command, tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"no folder")
    done = command("up", TABLE, "--for", "1s", "--capture", tmp_path / "file" / "mine.mcap")
    assert done.code == 3
    assert done.err.startswith(f"{tmp_path}/file/mine.mcap: cannot be created, ")
    assert not runs_folder().exists()


def test_a_disk_with_less_than_the_reserve_is_refused_before_anything_starts(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    reserve = "--set", "capture.reserve=1000 TiB"
    done = command("up", TABLE, "--for", "1s", *reserve, "--capture", "mine.mcap")
    assert done.code == 3 and not runs_folder().exists()
    what = r"TiB left on its disk, the reserve is 1000 TiB \(capture\.reserve\): make room, or lower the reserve; "
    assert re.match(rf"\.: [0-9.]+ {what}nothing was started\n$", done.err)
    done = command("up", TABLE, "--for", "1s", *reserve, "--set", "capture.on_full=continue_unlogged")
    assert done.code == 3 and re.match(rf"{runs_folder()}: [0-9.]+ {what}", done.err), "journals have to be written"
    done = command("run", TABLE, "--for", "1s", *reserve)
    assert done.code == 3 and re.match(rf"{runs_folder()}: [0-9.]+ {what}", done.err) and not runs_folder().exists()


def test_too_few_file_descriptors_are_refused_before_anything_starts(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plan, "getrlimit", lambda which: (55, 4096))
    done = command("up", TABLE, "--for", "1s", "--no-capture")
    what = "a process may have 55 file descriptors, 56 are needed: ulimit -n 56; nothing was started\n"
    assert (done.code, done.err) == (3, what) and not runs_folder().exists()


@pytest.mark.parametrize(
    "arguments",
    [
        *(("status",), ("pause",), ("step", "3"), ("push", "0", "0", "1"), ("move", "red.goal", "blue"), ("down",)),
        *(("net", "top"), ("net", "heal"), ("net", "set", "lan", "loss=5%"), ("net", "partition", "a", "b")),
        ("net", "clog", "a", "b"),
    ],
)
def test_without_a_live_run_there_is_nobody_to_control(command: Command, arguments: tuple[str, ...]) -> None:
    assert command(*arguments) == (1, "", "no run is live; foosim up FILE starts one\n")


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (
            ("rate", "quick"),
            "foosim rate PACE: not a pace (realtime, fast or a factor such as 2x), 'quick'",
        ),
        (("rate", "0x"), "foosim rate PACE: out of range 0.001x to 1000x, '0x'"),
        (("rate", "-1x"), "foosim rate PACE: out of range 0.001x to 1000x, '-1x'"),
        (
            ("push", "0", "nan", "0"),
            "impulse: three numbers are needed, X Y Z in N s; not all are finite numbers, '0 nan 0'",
        ),
        (("push", "0", "-1"), "impulse: three numbers are needed, X Y Z in N s; here are 2, '0 -1'"),
        (
            ("push", "0", "1", "x"),
            "impulse: three numbers are needed, X Y Z in N s; not all are finite numbers, '0 1 x'",
        ),
        (
            ("up", "a.yaml", "--resume", "mine", "--seed", "0", "--no-capture"),
            "--resume takes FILE and options from the run, it goes without FILE, --seed, --no-capture",
        ),
        (("up",), "a deployment FILE is needed, such as deploy/table.yaml, or --resume RUN"),
        (("add",), "foosim add: Missing argument 'ENTITY'"),
        (("add", "ball", "--at", "0", "1"), "foosim add: Got unexpected extra argument(s) (1)"),
        (("add", "ball", "--at", "1", "--yaw", "9 deg"), "no place: valid are X,Y or X,Y,Z, '1'"),
        (("move", "red.goal"), "foosim move: Missing argument 'NODE'"),
        (("puhs", "1"), "foosim: No such command 'puhs', nearest is push"),
    ],
)
def test_a_value_that_no_run_could_take_is_bad_input(command: Command, arguments: tuple[str, ...], text: str) -> None:
    assert command(*arguments) == (2, "", f"{text}\n")


def test_options_that_cannot_be_read_are_told_in_the_object_too(command: Command) -> None:
    done = command("up", TABLE, "--seed", "x", "--json")
    assert done.code == 2 and json.loads(done.out)["reason"] == done.err.strip()


@pytest.mark.parametrize("group", [("net",), ("capture",), ("pki",), ("role",)], ids=" ".join)
def test_a_group_without_words_shows_its_help(typed: Typed, group: tuple[str, ...]) -> None:
    done = typed(*group)()
    assert (done.code, done.out) == (2, "") and done.err.startswith(f"Usage: foosim {' '.join(group)} ")
    done = typed(*group)("--qqq")
    assert done.code == 2 and done.out == ""
    assert done.err.startswith(f"foosim {' '.join(group)}: No such option: --qqq")


@pytest.mark.parametrize(
    "words", [("status",), ("capture", "info", "no.mcap"), ("net", "clog", "a", "b"), ("pki", "show", "no")]
)
def test_a_command_that_is_refused_prints_its_object_too(typed: Typed, words: tuple[str, ...]) -> None:
    done = typed(*words)("--json")
    content = json.loads(done.out)
    assert done.code in (1, 2, 3) and content == {"failed": True, "reason": done.err.strip()}


def test_who_lacks_a_certificate_is_named_before_anything_starts(command: Command, tmp_path: Path) -> None:
    folder = tmp_path / "certs"
    certificates.init(folder)
    certificates.issue(folder, identities_of(load_deployment(read_deployment_text(TABLE), "table.yaml")))
    (folder / "node.blue.key").unlink()
    (folder / "client.player-red.pem").unlink()
    done = command("up", TABLE, "--pki", folder)
    assert done.code == 3 and "node.blue.key: cannot be read, No such file" in done.err
    (folder / "node.blue.pem").unlink()
    certificates.issue(folder, ["node.blue"])
    done = command("up", TABLE, "--pki", folder, "--processes", "each")
    assert done.code == 3 and f"{folder} has no certificate of client.player-red; it has: " in done.err
    done = command("up", TABLE, "--pki", folder, "--insecure")
    assert done.code == 2 and "--insecure and --pki exclude each other" in done.err
    done = command("up", TABLE, "--listen", "tls/127.0.0.1")
    assert done.code == 2 and "needs certificates: give their folder by --pki DIR" in done.err
    done = command("up", TABLE, "--listen", "tcp/127.0.0.1:7400", "--pki", folder)
    assert done.code == 2 and "nearest is tls/127.0.0.1:7400" in done.err
    assert not runs_folder().exists(), "nothing was started"
