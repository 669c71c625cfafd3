"""Files that travel with the handshake: piece by piece, asked for until they are there, and taken by their digest."""

from __future__ import annotations

from hashlib import blake2b
from pathlib import Path
from typing import Final

import pytest
from msgspec.structs import replace

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.actions import Action, Publish
from foosim.protocol.asset_transfer import Fetching, piece_of
from foosim.protocol.codec import decode
from foosim.protocol.handshake import AGAIN_NS, Member
from foosim.protocol.messages import Build, Fetch, Heartbeat, Piece

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
SHARD: Final = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n"
FILES: Final = {"a.obj": SHARD, "b.obj": SHARD + b"# another\n"}
THINGS: Final = ", ".join(f"{name[0]}: {{shape: mesh, file: {name}, surface: walls}}" for name in FILES)
BEAT: Final = Heartbeat("n1", 0, 0, "", "", 0.0, b"{}")


@pytest.fixture
def pinned(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The text of a deployment with two meshes; pieces have 20 bytes."""
    monkeypatch.setattr(limits, "ASSET_PIECE_BYTES", 20)
    for name, content in FILES.items():
        (tmp_path / name).write_bytes(content)
    return pin_assets(apply_sets(TABLE.read_text(), "t", [f"scenery={{{THINGS}}}"]), "t", tmp_path)[0]


def whole(text: str) -> Deployment:
    return load_deployment(text, "t").with_assets(FILES)


def fetch_of(fetching: Fetching) -> Fetch:
    assert fetching.lacking is not None
    digest, offset = fetching.lacking
    return Fetch("n1", "boot", bytes.fromhex(digest), offset)


def test_a_file_comes_piece_by_piece(pinned: str) -> None:
    fetching = Fetching(load_deployment(pinned, "t").files(), {})
    asked = []
    while fetching.lacking is not None:
        fetch = fetch_of(fetching)
        asked.append(fetch.offset)
        piece = piece_of(whole(pinned), fetch)
        assert len(piece.content) <= 20
        assert fetching.take(piece)
        assert not fetching.take(piece), "a repeat"
    assert asked == [0, 20, 40, 0, 20, 40] and fetching.contents() == FILES
    needed = load_deployment(pinned, "t").files()
    assert Fetching(needed, fetching.files).lacking is None, "what is here is not asked for again"


def test_a_piece_that_cannot_be_what_it_says_is_refused(pinned: str) -> None:
    fetching = Fetching(load_deployment(pinned, "t").files(), {})
    true = piece_of(whole(pinned), fetch_of(fetching))
    other = blake2b(b"", digest_size=32).digest()
    for piece in (replace(true, offset=1), replace(true, digest=other)):
        assert not fetching.take(piece)
    for piece in (replace(true, size=5), replace(true, content=b"")):
        with pytest.raises(Malformed, match="a piece up to byte"):
            fetching.take(piece)
    with pytest.raises(Malformed, match="a file of 20 bytes with another digest"):
        fetching.take(replace(true, size=20))
    assert fetching.lacking == (true.digest.hex(), 0), "from the beginning"
    with pytest.raises(Malformed, match="has no digest"):
        Fetching(load_deployment(apply_sets(TABLE.read_text(), "t", [f"scenery={{{THINGS}}}"]), "t").files(), {})


def test_a_fetch_of_what_is_not_there_is_refused(pinned: str) -> None:
    fetch = fetch_of(Fetching(load_deployment(pinned, "t").files(), {}))
    assert piece_of(whole(pinned), replace(fetch, offset=len(SHARD))).content == b""
    for bad in (replace(fetch, offset=len(SHARD) + 1), replace(fetch, digest=bytes(32))):
        with pytest.raises(Malformed, match="a fetch"):
            piece_of(whole(pinned), bad)
    with pytest.raises(Malformed, match="a fetch of a file that the deployment does not have"):
        piece_of(load_deployment(pinned, "t"), fetch)


def test_a_member_asks_until_all_is_there_and_lives_meanwhile(pinned: str) -> None:
    """Every second message is lost; what is for another boot, or comes twice, changes nothing."""
    actions: list[Action] = []
    member = Member("node", "n1", "boot", bytes(32), "", actions, 0)
    build = Build("n1", "boot", "super", "run", "t", pinned, "fast")
    assert [(member.take_build(given), member.is_fetching) for given in (replace(build, boot="other"), build)] == [
        (False, False),
        (False, True),
    ]
    now_ns, lost, asked, beats = 0, False, 0, 0
    while member.build is None:
        actions.clear()
        member.wake(now_ns, lambda: BEAT)
        said = [action for action in actions if isinstance(action, Publish)]
        fetches = [decode(Fetch, action.payload) for action in said if action.channel is channels.FETCH]
        beats += sum(action.channel is channels.HEARTBEAT for action in said)
        asked += len(fetches)
        for fetch in fetches:
            lost = not lost
            piece = piece_of(whole(pinned), fetch)
            assert not member.take_build(replace(piece, boot="other"))
            if not lost:
                member.take_build(piece)
                assert not member.take_build(piece), "a repeat"
        assert not member.take_build(build), "a repeat"
        now_ns = max(now_ns, member.deadline_ns)
        assert now_ns < 100 * AGAIN_NS
    assert asked == 12 and beats >= asked
    assert member.build == build and member.deployment == whole(pinned) and not member.is_fetching
    assert not member.take_build(build)
    member.begin_anew()
    assert member.take_build(build), "nothing is asked for again"
    member.begin_anew()
    assert not member.take_build(replace(build, run="other")) and "of run other" in member.refusal


def test_a_member_that_begins_anew_in_between_starts_over(pinned: str) -> None:
    member = Member("node", "n1", "boot", bytes(32), "", [], 0)
    build = Build("n1", "boot", "super", "run", "t", pinned, "fast")
    member.take_build(build)
    member.begin_anew()
    assert not member.is_fetching
    assert not member.take_build(Piece("n1", "boot", bytes(32), 0, 3, b"lie"))
    assert not member.take_build(build) and member.is_fetching
