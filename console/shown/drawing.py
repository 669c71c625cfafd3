"""The frames of one layout as what pages draw: scene, moments, overlays, links with their ends and walls.

Every source whose world is a deployment's uses it.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from foosim.console.shown.overlays import Overlays
from foosim.console.shown.poses import Poser
from foosim.console.shown.scene_json import scene_content
from foosim.console.shown.source import Moment
from foosim.deployment.schema import Deployment
from foosim.world.assembly.world import build_scene
from foosim.world.frame import Frame
from foosim.world.layout import Layout


class Drawing:
    """One layout of one deployment's world."""

    def __init__(self, deployment: Deployment, layout: Layout) -> None:
        """`deployment` has the contents of the files that it names."""
        self.deployment, self.layout = deployment, layout
        self.scene = build_scene(deployment, layout)
        self.poser = Poser(layout, self.scene)
        self._overlays: Overlays | None = None

    def content(self) -> dict[str, Any]:
        """Return the scene as pages read it."""
        return scene_content(self.deployment, self.layout, self.scene)

    def moment(self, frame: Frame, jump: bool = False, paused: bool = False) -> Moment:
        """Return the moment of a frame of this layout."""
        return Moment(frame.tick, self.poser.poses(frame.values), frame.values, jump, paused)

    def overlays(self, frame: Frame, wanted: Collection[str]) -> list[dict[str, Any]]:
        """Return the message with these overlays, and a note of each sensor that cannot be drawn from here on."""
        if self._overlays is None:
            self._overlays = Overlays(self.deployment, self.layout)
        content = self._overlays.content(frame, wanted)
        notes = [{"type": "note", "level": "error", "text": text} for text in self._overlays.failures()]
        return [content, *notes]
