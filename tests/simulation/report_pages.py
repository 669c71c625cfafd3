"""A report's page as a browser takes it in."""

from __future__ import annotations

import json
from base64 import b64encode
from hashlib import sha256
from html.parser import HTMLParser
from typing import Any


class Page(HTMLParser):
    """Checks that elements are closed in order, and that nothing is fetched or run but the one script that the page's
    policy names; keeps texts, table rows, the places of drawings, and the data."""

    def __init__(self, content: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.texts: list[str] = []
        self.rows: list[list[str]] = []
        self.places: list[str] = []
        self.data: dict[str, Any] = {}
        self.policy = ""
        self._kind: str | None = None
        self.inlined: dict[str, str] = {}
        self.feed(content)
        self.close()
        assert self.open == []
        rules = dict(rule.strip().split(" ", 1) for rule in self.policy.split(";"))
        assert rules.pop("default-src") == rules.pop("base-uri") == rules.pop("form-action") == "'none'"
        assert rules == {f"{name}-src": f"'{digest_of(text)}'" for name, text in self.inlined.items()}

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        assert tag not in ("link", "img", "iframe", "object") and not {"href", "src", "style"} & given.keys()
        assert not any(name.startswith("on") for name in given)
        if tag != "meta":
            self.open.append(tag)
        elif given.get("http-equiv") == "Content-Security-Policy":
            self.policy = str(given["content"])
        self._kind = given.get("type")
        if "data-drawing" in given:
            self.places.append(str(given["data-drawing"]))
        if tag == "tr":
            self.rows.append([])

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == "script" and self._kind == "application/json":
            self.data = json.loads(data)
        elif self.open and self.open[-1] in ("script", "style"):
            assert self.open[-1] not in self.inlined
            self.inlined[self.open[-1]] = data
        elif data.strip():
            self.texts.append(data)
            if self.open[-1] in ("td", "code") and "tr" in self.open:
                self.rows[-1].append(data)


def digest_of(text: str) -> str:
    return f"sha256-{b64encode(sha256(text.encode()).digest()).decode()}"
