"""The layouts of a build's world that a process keeps: each is that of what was added, and they are few."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import pytest

from foosim.common.errors import Malformed
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.protocol.handshake import LAYOUTS_KEPT, Member
from foosim.protocol.messages import Build
from foosim.world.layout import Layout, build_layout
from foosim.world.start import AddedEntity

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
BALLS: Final = [[AddedEntity(f"ball{number}", "ball") for number in range(count)] for count in range(2 * LAYOUTS_KEPT)]


def text(*sets: str) -> str:
    return apply_sets(TABLE.read_text(), "t", sets)


def made(of: str, added: list[AddedEntity]) -> Layout:
    return build_layout(load_deployment(of, "t"), [(one.name, one.model) for one in added])


def member_of(of: str, *added: AddedEntity) -> Member:
    member = Member("node", "n1", "boot", bytes(32), "", [], 0)
    assert member.take_build(Build("n1", "boot", "super", "run", "t", of, "fast", list(added)))
    return member


def test_each_is_that_of_what_was_added_however_often_it_is_asked_for() -> None:
    member = member_of(text(), *BALLS[1])
    assert member.layout is not None and member.layout.digest == made(text(), BALLS[1]).digest
    assert member.layout_with(BALLS[1]) is member.layout
    for added in (*BALLS, *reversed(BALLS)):
        assert member.layout_with(added).digest == made(text(), added).digest
        assert member.layout_with(list(added)) is member.layout_with(added)
        assert len(member._made) <= LAYOUTS_KEPT


def test_what_cannot_be_added_is_refused_each_time() -> None:
    member = member_of(text())
    for _ in range(2):
        with pytest.raises(Malformed, match=r"rod ball0 cannot be added"):
            member.layout_with([AddedEntity("ball0", "rod")])


def test_another_build_has_layouts_of_its_own() -> None:
    """Of a run with another deployment, where this process is a newcomer."""
    member, other = member_of(text()), text("robots.red.goal.sensors={}", "players={}")
    member.layout_with(BALLS[1])
    member.begin_anew()
    assert member.take_build(Build("n1", "boot", "super", "next", "t", other, "fast", []))
    for added in BALLS[:2]:
        assert member.layout_with(added).digest == made(other, added).digest != made(text(), added).digest
