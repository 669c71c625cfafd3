"""Shared by all tests: hypothesis' choice of examples, the distribution over pytest-xdist's workers, commands as typed.

Examples are the same in every run, so that a failure is a failure of the code and not of the day; what hypothesis
measures in wall time is off, because the machines that run the tests are shared. To search new ground:
`make test ARGS='--hypothesis-profile=search tests/laws'`; what it finds becomes an `@example`.
"""

import gc
import os
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any, Final, NamedTuple

import msgspec
import pytest
from hypothesis import HealthCheck, settings
from xdist.scheduler import LoadScopeScheduling

import foosim.protocol.hub_messages
import foosim.protocol.messages
import foosim.protocol.replay_messages  # noqa: F401  # all messages
from foosim.cli import main
from foosim.common.errors import Refused
from foosim.common.struct_types import Message
from foosim.deployment.loader import apply_sets, expanded_text
from foosim.deployment.text.yaml import locate_in, plain, read_tree, write_yaml
from foosim.runtime import GC_THRESHOLDS
from foosim.world.component_types import registry
from foosim.world.component_types.descriptions import ENGINES
from tests.meter import Burden, Meter, measured_seconds, scope_of

settings.register_profile(
    "foosim",
    derandomize=True,
    deadline=None,
    print_blob=True,
    max_examples=50,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile("search", settings.get_profile("foosim"), derandomize=False, max_examples=2000)
settings.load_profile("foosim")


def pytest_addoption(parser: pytest.Parser) -> None:
    """What `make fuzz`, `make stats` and `make slow` choose; by default the share of them that `make test` has."""
    parser.addoption("--links-seed", type=int, default=1, help="of the networks and packets of tests/links")
    parser.addoption("--links-full", action="store_true", help="tests/links at full size, one failure in a million")
    parser.addoption("--fuzz-payloads", type=int, default=100, help="payloads for each target of the fuzz tests")
    parser.addoption("--fuzz-seed", type=int, default=17, help="what the payloads are drawn from")
    parser.addoption("--fuzz-block", type=int, default=-1, help="bring the payloads of this block alone")
    parser.addoption("--record-seconds", action="store_true", help="write tests/seconds.json, which orders the tests")
    parser.addoption("--slow-start", type=float, default=0.0, help="seconds that each process's start takes longer")
    parser.addoption("--load", type=int, default=0, help="processes beside the tests that keep as many cores busy")


def pytest_configure(config: pytest.Config) -> None:
    """What tests cost is measured; `make slow` makes the machine a slow one."""
    config.pluginmanager.register(Meter(records=config.getoption("--record-seconds")), "meter")
    config.pluginmanager.register(Burden(config), "burden")


@pytest.hookimpl(wrapper=True)
def pytest_collection(session: pytest.Session) -> Generator[None, object, object]:
    """What is collected stays: no garbage collection looks at it, while it is collected or while tests run.

    Then collections are as rare as in the processes of a run. Each worker begins with other folders, since what one has
    compiled the others load: pytest's way of compiling tests takes three times as long as all else of collecting.

    hypothesis would draw also numbers and words of the modules that are loaded, which are others on another worker:
    examples would not be the same in every run, and to read the modules takes each worker seconds.
    """
    config = session.config
    if settings().derandomize:
        nowhere = "hypothesis.internal.conjecture.providers.is_local_module_file"
        pytest.MonkeyPatch().setattr(nowhere, lambda path: False)
    if hasattr(config, "workerinput") and config.args == config.getini("testpaths"):
        folder = sorted(Path(__file__).parent.iterdir())
        places = [str(path) for path in folder if path.is_dir() or path.name.startswith("test_")]
        begin = len(places) * int(config.workerinput["workerid"][2:]) // config.workerinput["workercount"]
        config.args = places[begin:] + places[:begin]
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(*GC_THRESHOLDS)
        gc.enable()


NO_BULLET: Final = ENGINES["bullet"].lack
"""What the engine of tables lacks where the tests run, if anything: on a Python after 3.11 a module."""


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup() -> Generator[None, object, object]:
    """A test that needs the engine of tables is skipped where there is none, with the reason."""
    try:
        return (yield)
    except Refused as error:
        if not NO_BULLET or NO_BULLET not in str(error):
            raise
        pytest.skip(NO_BULLET)


pytest_runtest_call = pytest_runtest_setup


@pytest.fixture(autouse=True, scope="session")
def _bounds_of_messages_are_read() -> None:
    """msgspec reads a message's bounds with its first decoder: before any test lowers a limit."""
    for kind in Message.__subclasses__():
        msgspec.msgpack.Decoder(kind)


@pytest.fixture(autouse=True)
def _own_components_are_forgotten(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What a test registers, imports from its folder and installs there is unknown to the others."""
    modules, known, loaded = set(sys.modules), set(registry._known), dict(registry._loaded)
    yield
    folder = str(tmp_path_factory.getbasetemp())
    for name in sys.modules.keys() - modules:
        if (getattr(sys.modules[name], "__file__", None) or "").startswith(folder):
            del sys.modules[name]
    theirs = [key for key in registry._known.keys() - known if not registry._known[key].module.startswith("foosim.")]
    for key in theirs:
        del registry._known[key]
    if registry._loaded != loaded:
        registry._loaded.clear()
        registry._loaded.update(loaded)
        registry._entry_points.cache_clear()


def pytest_report_header(config: pytest.Config) -> str:
    """The settings under which hypothesis runs, and the fuzz tests' seed, in the first lines of the output."""
    current = settings()
    seed, payloads = config.getoption("--fuzz-seed"), config.getoption("--fuzz-payloads")
    links = f"links: seed={config.getoption('--links-seed')}, full={config.getoption('--links-full')}"
    hypothesis = f"hypothesis: derandomize={current.derandomize}, deadline={current.deadline}"
    return f"{hypothesis}; fuzz: {seed=}, {payloads=}; {links}"


WAREHOUSE = Path(__file__).parent.parent / "deploy" / "warehouse.yaml"


@pytest.fixture(scope="session")
def fleet_text() -> Callable[..., str]:
    """The text of a small hall: so many of the warehouse's rovers, with their controllers, and settings."""

    tree, _ = read_tree(expanded_text(WAREHOUSE.read_text(), WAREHOUSE.name), locate_in(WAREHOUSE.name))
    assert tree is not None
    whole: Any = plain(tree)

    def text(rovers: int, *sets: str) -> str:
        data = deepcopy(whole)
        del data["clients"]
        gone = {f"{kind}{number:02d}" for kind in ("rover", "pilot") for number in range(rovers + 1, 22)} | {"porter"}
        for section in ("robots", "players"):
            data[section] = {name: about for name, about in data[section].items() if name not in gone}
        if rovers == 1:
            del data["players"]["pilot01"]["hears"]["pilot*"]  # there is no other one
        for node in data["nodes"].values():
            node["robots"] = [robot for robot in node["robots"] if robot not in gone]
        return apply_sets(write_yaml(data), WAREHOUSE.name, sets)

    return text


class Together(LoadScopeScheduling):  # type: ignore[misc]  # xdist has no types
    """Gives each scope to one worker, in the order of collection."""

    def _split_scope(self, nodeid: str) -> str:
        return scope_of(nodeid)


@pytest.hookimpl(optionalhook=True)  # optional, so that pytest also runs with `-p no:xdist`
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> Together:
    """The distribution over workers. (xdist 3.8's own groups have no effect with pytest 9.2.)"""
    config.option.loadscopereorder = False
    return Together(config, log)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> Generator[None, object, object]:
    """The longest scopes begin first, so that no worker has a long one left when the others have ended.

    All workers have one order, whatever they have collected first: that of paths.
    """
    items.sort(key=lambda item: item.path.parts)
    result = yield
    seconds = measured_seconds()
    items.sort(key=lambda item: -seconds.get(scope_of(item.nodeid), 0.0))
    return result


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Callable[[int], Path]]:
    """Mounts file systems of so many KiB."""
    if os.geteuid() != 0:
        pytest.skip("mounting a file system takes root")
    mounted: list[Path] = []

    def mount(kib: int) -> Path:
        place = tmp_path / f"disk-{kib}"
        place.mkdir()
        command = ["mount", "-t", "tmpfs", "-o", f"size={kib}k", "foosim-test", str(place)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            pytest.skip(f"no tmpfs can be mounted here: {done.stderr.strip()}")
        mounted.append(place)
        return place

    yield mount
    for place in mounted:
        subprocess.run(["umount", "-l", str(place)], check=True)


class Done(NamedTuple):
    """Exit code and output of a command."""

    code: object
    out: str
    err: str


Command = Callable[..., Done]
Typed = Callable[..., Command]


@pytest.fixture
def typed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Typed:
    """Return a function that makes a command of foosim, by its verb; it runs in an empty folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setattr("foosim.cli.note_signals", lambda: None)  # this process goes on after the command
    monkeypatch.chdir(tmp_path)

    def make(*verb: str) -> Command:
        def run(*arguments: str | Path) -> Done:
            monkeypatch.setattr(sys, "argv", ["foosim", *verb, *map(str, arguments)])
            with pytest.raises(SystemExit) as ended:
                main()
            printed = capsys.readouterr()
            return Done(ended.value.code, printed.out, printed.err)

        return run

    return make
