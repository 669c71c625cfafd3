"""What a sensor raises when it is checked whether its robot and its world fit its settings."""

from __future__ import annotations

from foosim.common.errors import BadValue
from foosim.common.finding import Location


class Misfit(BadValue):
    """A setting of a component that its robot or its world does not fit; `path` leads to it from the component's."""

    def __init__(self, path: Location, what: str, value: object, nearest: str | None = None) -> None:
        super().__init__(what, value, nearest)
        self.path = path
