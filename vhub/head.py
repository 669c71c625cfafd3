"""What the vHub's core stands on, as the record that begins a file of its journal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from foosim.protocol.codec import encode
from foosim.vhub.records import HeadRecord
from foosim.world.initial_state import added_to

if TYPE_CHECKING:
    from foosim.vhub.core import HubCore


def head_of(core: HubCore) -> bytes:
    """Return the record with which a journal file starts: the state after the last closed tick."""
    assert core.state is not None and core.member.build is not None
    commit, _, frame = core.commits.get(core.state.closed) or (b"", None, None)
    layout = core.commits.layout if frame is None else frame.layout
    assert layout is not None
    added = [(entity.name, entity.model) for entity in added_to(core.state.deployment, layout)]
    chain = core.commits.chain_at(core.state.closed)
    where = commit, core.epoch_payload, core.capture_file, chain, core.footing.machine, core.door.absences.record()
    return encode(HeadRecord(core.member.build.run, core.state.snapshot(), added, *where))
