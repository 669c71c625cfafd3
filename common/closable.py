"""What is closed at the end of a `with`."""

from __future__ import annotations

from typing import Self


class Closable:
    """Base of what has `close`: leaving its `with` calls it."""

    def close(self) -> object:
        """End it; a second call does nothing."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
