"""The handshake: who is let in, who is refused and why; over the real cores, and the roster by itself."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import msgspec
import pytest

from foosim.common import limits
from foosim.common.units import Pace
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.node.core import NodeCore
from foosim.protocol import channels
from foosim.protocol.codec import encode
from foosim.protocol.messages import Build, ComponentVersion, Heartbeat, Hello, Ready, Refusal
from foosim.supervisor import roster as roster_module
from foosim.supervisor.core import SupervisorCore
from foosim.supervisor.roster import SILENT_NS, Roster
from foosim.supervisor.settings import RunSettings
from foosim.vhub.core import HubCore
from foosim.world.layout import build_layout

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TEXT: Final = apply_sets(TABLE.read_text(), TABLE.name, ["engine=pure", "players={}"])
DEPLOYMENT: Final = load_deployment(TEXT, TABLE.name)
MIXED: Final = load_deployment(apply_sets(TEXT, TABLE.name, ["mixed_cpu=true"]), TABLE.name)
LAYOUT: Final = build_layout(DEPLOYMENT).digest
PRINT: Final = bytes(range(32))
OTHER: Final = bytes(32)
HELLO: Final = Hello("node", "red", "boot-1", limits.PROTOCOL_VERSION, "", PRINT)

REFUSED: Final[dict[str, tuple[dict[str, Any], str]]] = {
    "version": ({"version": 9}, f"protocol version 9, this is {limits.PROTOCOL_VERSION}"),
    "world": ({"world": "mars"}, "world mars, this is table"),
    "name": ({"name": "rde"}, "no node 'rde' is declared; declared are blue, red, nearest is red"),
    "no name like it": ({"name": "zzz"}, "no node 'zzz' is declared; declared are blue, red"),
    "the vHub's name": ({"name": "vhub"}, "no node 'vhub' is declared; declared are blue, red"),
    "a node's name": ({"role": "vhub", "name": "red"}, "no vhub 'red' is declared; declared are vhub"),
    "role": ({"role": "dragon"}, "role 'dragon', there are node, vhub"),
    "fingerprint": (
        {"fingerprint": OTHER},
        "arithmetic fingerprint 0000000000000000, this is 0001020304050607: its results would differ "
        "(the deployment may say mixed_cpu: true)",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_who_does_not_fit_is_refused_with_the_reason(what: str) -> None:
    changes, reason = REFUSED[what]
    roster = Roster(DEPLOYMENT, PRINT)
    assert roster.reason_against(msgspec.structs.replace(HELLO, **changes)) == reason
    assert roster.reason_against(HELLO) == "" and not roster.by_name


def test_a_name_is_free_until_somebody_has_it() -> None:
    roster = Roster(DEPLOYMENT, PRINT)
    roster.take(HELLO, 5)
    assert roster.reason_against(HELLO) == "", "the same process says hello again"
    twin = msgspec.structs.replace(HELLO, boot="boot-2")
    assert roster.reason_against(twin) == "a node red is already here"
    assert roster.reason_against(msgspec.structs.replace(twin, name="blue")) == ""
    assert roster.take(HELLO, 9) is roster.by_name["red"] and roster.by_name["red"].last_message_ns == 5


def test_who_has_the_name_of_a_process_that_is_silent_is_asked_to_wait() -> None:
    """It may be its successor: a refusal would be the last word."""
    roster, twin = Roster(DEPLOYMENT, PRINT), msgspec.structs.replace(HELLO, boot="boot-2")
    known = roster.take(HELLO, 0)
    assert not roster.has_silent_namesake(twin, SILENT_NS) and roster.has_silent_namesake(twin, SILENT_NS + 1)
    assert not roster.has_silent_namesake(HELLO, 10 * SILENT_NS), "the same process"
    known.lost = True
    assert not roster.has_silent_namesake(twin, 10 * SILENT_NS), "it is taken"


def test_a_deployment_may_allow_mixed_processors() -> None:
    roster = Roster(MIXED, PRINT)
    assert roster.reason_against(msgspec.structs.replace(HELLO, fingerprint=OTHER)) == ""
    one = roster.take(HELLO, 0)
    other = roster.take(msgspec.structs.replace(HELLO, name="blue"), 0)
    assert roster.note_ready(one, Ready("red", "boot-1", LAYOUT, PRINT, bytes(32)), LAYOUT) == ""
    assert roster.note_ready(other, Ready("blue", "boot-1", LAYOUT, OTHER, bytes(32)), LAYOUT) == ""
    assert roster.arithmetic == b"", "there are several"


@pytest.mark.parametrize(
    ("there", "here", "why"),
    [
        ({"sensor own:Gauge": "1.1 ab"}, {"sensor own:Gauge": "1.0 cd"}, "has version 1.1 ab there and 1.0 cd here"),
        ({}, {"sensor own:Gauge": "cd"}, "has version missing there and cd here"),
    ],
)
def test_nodes_with_another_version_of_a_form_are_refused(
    monkeypatch: pytest.MonkeyPatch, there: dict[str, str], here: dict[str, str], why: str
) -> None:
    """Also where processors may be mixed: another version is another world."""
    monkeypatch.setattr(roster_module, "foreign_versions", lambda deployment: here)
    for deployment in (DEPLOYMENT, MIXED):
        roster = Roster(deployment, PRINT)
        one, other = roster.take(HELLO, 0), roster.take(msgspec.structs.replace(HELLO, name="blue"), 0)
        same = [ComponentVersion(name, version) for name, version in here.items()]
        assert roster.note_ready(one, Ready("red", "boot-1", LAYOUT, PRINT, bytes(32), same), LAYOUT) == ""
        others = [ComponentVersion(name, version) for name, version in there.items()]
        reason = roster.note_ready(other, Ready("blue", "boot-1", LAYOUT, PRINT, bytes(32), others), LAYOUT)
        assert reason == f"sensor own:Gauge {why}: install the same on all machines"
        assert "blue" not in roster.by_name and "red" in roster.by_name


def test_engines_whose_small_run_differs_are_refused() -> None:
    roster = Roster(DEPLOYMENT, PRINT)
    one = roster.take(HELLO, 0)
    other = roster.take(msgspec.structs.replace(HELLO, name="blue"), 0)
    assert roster.note_ready(one, Ready("red", "boot-1", LAYOUT, PRINT, bytes(32)), LAYOUT) == ""
    reason = roster.note_ready(other, Ready("blue", "boot-1", LAYOUT, OTHER, bytes(32)), LAYOUT)
    assert reason.startswith(
        "a fixed small run of its engine has digest 0000000000000000, the first node's is 00010203"
    )
    assert roster.missing() == ["blue", "vhub"] and "blue" not in roster.by_name
    assert roster.arithmetic == PRINT


def test_nodes_that_read_other_meshes_are_refused() -> None:
    roster = Roster(DEPLOYMENT, PRINT)
    one = roster.take(HELLO, 0)
    other = roster.take(msgspec.structs.replace(HELLO, name="blue"), 0)
    assert roster.note_ready(one, Ready("red", "boot-1", LAYOUT, PRINT, PRINT), LAYOUT) == ""
    reason = roster.note_ready(other, Ready("blue", "boot-1", LAYOUT, OTHER, OTHER), LAYOUT)
    assert reason.startswith(
        "it has read other meshes or hulls from the same files, with digest 0000000000000000, the first node's is 0001"
    )
    assert "blue" not in roster.by_name and "red" in roster.by_name


def test_the_vhub_has_no_engine_to_compare() -> None:
    roster = Roster(DEPLOYMENT, PRINT)
    hub = roster.take(Hello("vhub", "vhub", "b", limits.PROTOCOL_VERSION, "table", PRINT), 0)
    assert roster.arithmetic == b"", "no node is here"
    roster.note_ready(roster.take(HELLO, 0), Ready("red", "boot-1", LAYOUT, PRINT, bytes(32)), LAYOUT)
    assert roster.note_ready(hub, Ready("vhub", "b", LAYOUT, OTHER, bytes(32)), LAYOUT) == ""
    assert roster.arithmetic == PRINT


def test_who_has_built_another_layout_cannot_take_part() -> None:
    roster = Roster(DEPLOYMENT, PRINT)
    reason = roster.note_ready(roster.take(HELLO, 0), Ready("red", "boot-1", bytes(32), PRINT, bytes(32)), LAYOUT)
    assert reason.startswith("its world has another layout than the supervisor's: install the same version on all")
    assert "red" in roster.missing() and "red" not in roster.by_name


# --- over the cores --------------------------------------------------------------------------------------------------


def node(name: str, fingerprint: bytes = PRINT, world: str = "") -> NodeCore:
    core = NodeCore(name, f"boot-{name}", fingerprint, 0, world)
    core.wake(0)
    return core


def test_a_refusal_for_another_start_of_the_name_is_not_taken() -> None:
    process = node("red")
    process.receive(channels.REFUSAL, "red", encode(Refusal("red", "another boot", "no")), 0)
    process.receive(channels.REFUSAL, "red", b"\xc1", 0)
    assert process.refused == 1
    assert process.member.refusal == ""


def test_a_build_that_cannot_be_is_refused_and_the_right_one_still_counts() -> None:
    processes: dict[str, NodeCore | HubCore] = {"red": node("red"), "vhub": HubCore("boot-red", PRINT, 0)}
    for name, process in processes.items():
        right = Build(name, "boot-red", "first", "run", "t", TEXT, "fast")
        not_valid = [
            msgspec.structs.replace(right, deployment="world: ["),
            msgspec.structs.replace(right, deployment=TEXT.replace("seed: 1", "seed: -1")),
        ]
        for build in not_valid:
            process.receive(channels.BUILD, name, encode(build), 0)
            assert process.member.problem.startswith(f"lost {name}: the deployment is not valid on its machine: t:")
        wrong = [
            msgspec.structs.replace(right, name="blue"),
        ]
        for build in wrong:
            process.receive(channels.BUILD, name, encode(build), 0)
        process.receive(channels.BUILD, name, encode(msgspec.structs.replace(right, boot="other")), 0)
        built = process.member.build
        assert built is None, built
        process.receive(channels.BUILD, name, encode(right), 0)
        assert process.deployment is not None and not process.member.problem
        refused = process.refused if isinstance(process, NodeCore) else process.malformed
        assert refused == len(wrong)


@pytest.mark.parametrize("case", ["built", "not built", "stopped", "others are here", "the run has ended"])
def test_the_last_node_that_was_lost_goes_on_when_it_is_heard_of_again(case: str) -> None:
    """But none whose arithmetic was never compared, and nobody once the run is over."""
    core = SupervisorCore(RunSettings("run", TABLE.name, TEXT, Pace("fast")), PRINT, 0)
    process = core.state.roster.take(HELLO, 0)
    if case != "not built":
        layout = core.state.frame.layout.digest
        core.state.roster.note_ready(process, Ready("red", HELLO.boot, layout, PRINT, bytes(32)), layout)
    core.state.roster.take(msgspec.structs.replace(HELLO, name="blue"), 0)
    core.open_epoch(core.state.owners, 0, ["blue", "red"])
    core.node_loss.lose("red", "silent", 0)
    if case == "stopped":
        core.state.roster.stopped.add("red")
    if case != "others are here":
        core.node_loss.lose("blue", "silent", 0)
    if case == "the run has ended":
        core.finish("enough", failed=False)
    epoch = core.state.epoch
    heartbeat = Heartbeat("red", 0, 1, "", "", 0.0, b"{}")
    core.receive(channels.HEARTBEAT, "red", encode(heartbeat), 0)
    taken = case == "built"
    assert (core.state.members == ("red",), process.lost, core.state.epoch - epoch) == (taken, not taken, int(taken))
    assert not taken or set(core.state.owners.values()) == {"red"}
