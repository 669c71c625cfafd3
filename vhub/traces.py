"""Traces of a link's capacity, in the form of mahimahi: each line a time in ms at which 1500 bytes can leave."""

from __future__ import annotations

from typing import Final

OPPORTUNITIES_MAX: Final = 1_000_000


def read_opportunities(text: str) -> tuple[int, ...]:
    """Return the times in ms, ascending; raises ValueError, with the line, for what is no trace."""
    times: list[int] = []
    for number, line in enumerate(text.split("\n"), 1):
        word = line.partition("#")[0].strip()
        if not word:
            continue
        if not (word.isascii() and word.isdigit()) or len(word) > 12:
            raise ValueError(f"line {number}: not a whole number of ms, {word[:32]!r}")
        if times and int(word) < times[-1]:
            raise ValueError(f"line {number}: {word} ms after {times[-1]} ms, times ascend")
        times.append(int(word))
        if len(times) > OPPORTUNITIES_MAX:
            raise ValueError(f"line {number}: more than {OPPORTUNITIES_MAX} lines")
    if not times or times[-1] == 0:
        raise ValueError("no time after 0 ms")
    return tuple(times)
