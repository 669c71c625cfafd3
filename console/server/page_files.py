"""Files served beside the WebSocket, held in memory, with their security headers.

Nothing outside of this list is served.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Final

TYPES: Final[Mapping[str, str]] = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".txt": "text/plain; charset=utf-8",
}
POLICY: Final = (
    "default-src 'self'; connect-src 'self'; img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'; object-src 'none'"
)
HEADERS: Final[Mapping[str, str]] = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-cache",
}


@dataclass(frozen=True, slots=True)
class PageFile:
    """One file of the page."""

    content_type: str
    content: bytes


def page_files() -> dict[str, PageFile]:
    """Return the files of the page by path; `/` is its index."""
    found = {}
    for file in files("foosim.console").joinpath("www").iterdir():
        content_type = TYPES.get(file.name[file.name.rfind(".") :])
        if file.is_file() and content_type is not None:
            found[f"/{file.name}"] = PageFile(content_type, file.read_bytes())
    found["/"] = found["/index.html"]
    return found
