"""The frames of a deployment as what pages draw: scene, moments, overlays.

Every source whose world is a deployment's uses it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foosim.console.shown.overlays import Overlays
from foosim.console.shown.poses import Poser
from foosim.console.shown.scene_json import scene_content
from foosim.console.shown.source import Moment
from foosim.console.shown.tracks import Pose
from foosim.deployment.schema import Deployment
from foosim.world.assembly.world import build_scene
from foosim.world.frame import Frame
from foosim.world.layout import build_layout


class Drawing:
    """One deployment's world."""

    def __init__(self, deployment: Deployment) -> None:
        """`deployment` has the contents of the files that it names."""
        self.deployment, self.layout = deployment, build_layout(deployment)
        self.scene = build_scene(deployment, self.layout)
        self.poser = Poser(self.layout, self.scene)
        bodies = self.scene.bodies.items()
        names = [link.name for _, body in bodies for link in body.links]
        self.links: dict[str, int] = {name: place for place, name in enumerate(names)}
        """The place of each link in the order of the scene, by name."""
        self.entities: dict[str, int] = {name: self.links[body.links[-1].name] for name, body in bodies}
        """That of each entity's last link, by the entity's name."""
        self._overlays: Overlays | None = None

    def known(self, poses: Mapping[str, Pose]) -> NDArray[np.float32]:
        """Return poses of links by name, in the order of the scene; not a number where there is none."""
        rows = np.full((len(self.links), 7), np.nan, np.float32)
        for link, (position, orientation) in poses.items():
            place = self.links.get(link)
            if place is not None:
                rows[place] = (*position, *orientation)
        return rows

    def content(self) -> dict[str, Any]:
        """Return the scene as pages read it."""
        return scene_content(self.deployment, self.layout, self.scene)

    def moment(self, frame: Frame, jump: bool = False, paused: bool = False) -> Moment:
        """Return the moment of a frame."""
        values = frame.values
        return Moment(frame.tick, self.poser.poses(values), self.poser.numbers(values), jump, paused)

    def overlays(self, frame: Frame, wanted: Collection[str]) -> list[dict[str, Any]]:
        """Return the message with these overlays, and a note of each sensor that cannot be drawn from here on."""
        if self._overlays is None:
            self._overlays = Overlays(self.deployment, self.layout)
        content = self._overlays.content(frame, wanted)
        notes = [{"type": "note", "level": "error", "text": text} for text in self._overlays.failures()]
        return [content, *notes]
