"""Single keys of a terminal: what arrives, taken apart, and whether this process may read it."""

from __future__ import annotations

import os
from typing import Final

_ESCAPED: Final = {"\x1b[A": "up", "\x1b[B": "down", "\x1b[C": "right", "\x1b[D": "left"}


def split_keys(text: str) -> tuple[list[str], str]:
    """Return the keys in the text of a terminal, and the beginning of an incomplete one."""
    keys: list[str] = []
    text = text.replace("\x1bO", "\x1b[")  # some terminals send arrows so
    while text and text not in ("\x1b", "\x1b["):
        length = 3 if text[:3] in _ESCAPED else 1
        keys.append(_ESCAPED.get(text[:3], text[0]))
        text = text[length:]
    return keys, text


def is_foreground(file: int) -> bool:
    """Whether this process may touch the terminal: the kernel stops background processes that do."""
    try:
        return os.tcgetpgrp(file) == os.getpgrp()
    except OSError:
        return False
