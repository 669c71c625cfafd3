"""The vHub's capture: its description of the network, and closings as the ticks that a capture takes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from foosim.capture.contents import library_versions
from foosim.capture.file import Described
from foosim.capture.writer import CaptureWriter
from foosim.deployment.schema import Deployment
from foosim.protocol.messages import Epoch
from foosim.vhub.network.custom_models import model_versions
from foosim.vhub.recording.model_hash import MODEL_HASH, model_hash
from foosim.vhub.recording.rows_of_closing import plan_of, tick_of
from foosim.vhub.state.records import Closing
from foosim.vhub.state.resume import Captured
from foosim.world.assembly.versions import foreign_versions


class Recorder(CaptureWriter):
    """Writes one capture, as `CaptureWriter` does. `metadata` (texts: run, fingerprint, ...) is added to its own."""

    def __init__(
        self,
        path: Path,
        deployment: Deployment,
        deployment_name: str,
        deployment_text: str,
        metadata: Mapping[str, str],
        say: Callable[[str, str], None] | None = None,
        journal_tick: int | None = None,
    ) -> None:
        self._plan = plan_of(deployment)
        versions = library_versions() | model_versions(deployment.network) | foreign_versions(deployment)
        metadata = {MODEL_HASH: model_hash(deployment), **metadata}
        described = Described(deployment, deployment_name, deployment_text, metadata, versions)
        super().__init__(path, described, say, journal_tick)

    @property
    def captured(self) -> Captured:
        """How far the resumed capture was."""
        return Captured(self.begun_with.tick, max(0, self.begun_with.epoch))

    def keep(self, item: Closing | Epoch) -> None:
        """Queue a closing, or an epoch that begins; wait while the queue is full."""
        self.put(tick_of(item, self._plan) if isinstance(item, Closing) else item)
