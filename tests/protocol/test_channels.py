"""The table of channels: its keys are its own, its readers read what the cores take, and nobody else spells a key."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Final, get_args

import pytest

from foosim.client.core import ClientCore
from foosim.common import limits
from foosim.common.units import Pace
from foosim.node.core import NodeCore
from foosim.protocol import channels
from foosim.protocol.channels import CHANNELS, Channel, Plane
from foosim.runtime.roles.wire import channel_of
from foosim.supervisor.core import SupervisorCore
from foosim.supervisor.settings import RunSettings
from foosim.vhub.core import HubCore

ROOT: Final = Path(__file__).parents[2]
PACKAGES: Final = ("client", "console", "node", "protocol", "simulation", "supervisor", "vhub")
READS: Final[Mapping[str, Sequence[tuple[Channel, bool]]]] = {
    "node": channels.NODE_READS,
    "vhub": channels.VHUB_READS,
    "supervisor": channels.SUPERVISOR_READS,
    "client": channels.CLIENT_READS,
    "operator": channels.OPERATOR_READS,
    "replay": channels.REPLAY_READS,
    "listener": channels.LISTENER_READS,
    "view": channels.VIEW_READS,
}


def kinds(channel: Channel) -> set[str]:
    return {kind.__name__ for kind in get_args(channel.message) or (channel.message,)}


def test_keys_are_unique_and_no_key_matches_another() -> None:
    for one in CHANNELS:
        for other in CHANNELS:
            matches = fnmatchcase(other.key_for("n1"), one.key_for_all)
            assert matches == (one is other), (one.key, other.key)


def test_planes_share_no_key_and_keys_are_valid() -> None:
    for channel in CHANNELS:
        chunks = channel.key.split("/")
        assert chunks[:2] == ["foosim", channel.plane.name.lower()]
        assert "{" not in channel.key.removesuffix("/{name}")
        assert all(chunk and chunk.strip() == chunk and "*" not in chunk and "$" not in chunk for chunk in chunks)
        assert channel.key_for("red") == channel.key.replace("{name}", "red")
        assert channel.blocking is (channel.name not in {"view", "file_piece"}), "what is not requested again blocks"


def test_size_limits_are_those_of_the_planes() -> None:
    small = {"hello", "ready", "want", "request", "inquiry", "file_request"}
    for channel in CHANNELS:
        largest = limits.RADIO_MESSAGE_BYTES_MAX if channel.plane is Plane.RADIO else limits.MESSAGE_BYTES_MAX
        assert channel.bytes_max == (limits.SMALL_MESSAGE_BYTES_MAX if channel.name in small else largest), channel.name


@pytest.mark.parametrize("role", READS)
def test_readers_read_channels_of_the_table_once(role: str) -> None:
    read = [channel for channel, _ in READS[role]]
    assert all(channel in CHANNELS for channel in read)
    assert len(read) == len(set(read))
    for channel, own in READS[role]:
        assert not own or "{name}" in channel.key, "what is addressed has a name in its key"


def test_every_channel_has_a_reader_and_no_role_reads_over_the_other_plane() -> None:
    assert {channel for reads in READS.values() for channel, _ in reads} == set(CHANNELS)
    planes = {role: {channel.plane for channel, _ in reads} for role, reads in READS.items()}
    assert planes["vhub"] == {Plane.SIMULATION, Plane.RADIO}, "it alone is on both"
    assert planes["node"] == planes["supervisor"] == planes["operator"] == {Plane.SIMULATION}
    assert planes["client"] == {Plane.RADIO}
    assert planes["replay"] == planes["listener"] == {Plane.REPLAY}


def supervisor() -> SupervisorCore:
    path = ROOT / "deploy" / "table.yaml"
    return SupervisorCore(RunSettings("run", path.name, path.read_text(), Pace("fast")), bytes(32), 0)


def test_every_core_takes_what_its_role_reads() -> None:
    """A channel that a role reads has a handler; a handler that no channel leads to would never be called."""
    node = NodeCore("n1", "boot", bytes(32), 0)
    assert set(node._readers) | {channels.REFUSAL.name} == {channel.name for channel, _ in channels.NODE_READS}
    by_type: dict[str, Any] = {
        "vhub": HubCore("boot", bytes(32), 0),
        "supervisor": supervisor(),
        "client": ClientCore("c", "boot", 0),
    }
    for role, core in by_type.items():
        handled = {kind.__name__ for kind in core._readers} | ({"Refusal"} if role == "vhub" else set())
        assert handled == set().union(*(kinds(channel) for channel, _ in READS[role])), role


def test_who_waits_for_a_channel_itself_reads_it_and_every_tick_brings_it() -> None:
    waits = {
        "node": channels.NODE_WAITS,
        "supervisor": channels.SUPERVISOR_WAITS,
        "vhub": channels.VHUB_WAITS,
        "client": channels.CLIENT_WAITS,
    }
    for role, waited in waits.items():
        assert len(set(waited)) == len(waited)
        assert set(waited) <= {channel for channel, _ in READS[role]}
    of_ticks = {channel for channel in CHANNELS if channel.rate.startswith("tick")}
    dones_and_goes = {channels.UP, channels.DOWN}
    assert {channel for waited in waits.values() for channel in waited} == of_ticks | dones_and_goes


def test_a_key_leads_back_to_its_channel_and_name() -> None:
    for channel in CHANNELS:
        known = channel_of(channel.key_for("n1"))
        assert known == (channel, "n1" if "{name}" in channel.key else channel.writers)
    for key in ("", "foosim", "foosim/simulation/none", "foosim/simulation/order/n1", "foosim/radio/up", "x/y/z"):
        assert channel_of(key) is None


def test_presence_has_keys_of_its_own_on_either_plane() -> None:
    assert set(channels.ALIVE) == set(Plane)
    for plane, key in channels.ALIVE.items():
        assert key.startswith(f"foosim/{plane.name.lower()}/")
        assert channel_of(key.replace("{name}", "n1")) is None


def texts(path: Path) -> list[str]:
    """Every text constant of a file's code; docstrings and comments may speak of keys."""
    tree = ast.parse(path.read_text())
    documents = {
        id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    found = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    return [str(node.value) for node in found if id(node) not in documents]


def test_nobody_else_spells_a_key() -> None:
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            if path == ROOT / "protocol" / "channels.py":
                continue
            spelled = [text for text in texts(path) if "foosim/" in text and "://" not in text]
            assert not spelled, f"{path.relative_to(ROOT)} spells {spelled}"
    assert any("foosim/" in text for text in texts(ROOT / "protocol" / "channels.py")), "the search finds keys"
