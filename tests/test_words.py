"""Source and docs are written in the field's words: what a component does, without persons and without riddles.

`python -m tests.test_words PATH...` lists what is found in files or folders.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from tests.test_tidy import PACKAGES, ROOT

INSTEAD: Final = {
    r"told|tells?|telling": "report, state, name; last sent, last command",
    r"ask(s|ed|ing)?": "request, query, read, call; set-point, requested",
    r"said|unsaid": "reported, logged, written, sent",
    r"so many": "n, the count",
    r"whoever|whomever|nobody|somebody|everybody": "the process, the user, the sender; no node, each robot",
    r"those (that|who|which)": "the nodes that, packets that",
    r"(go|goes|going|went|gone) on": "continues, moves",
    r"made (of|from)": "has, consists of, built from",
    r"(that|which|what|who) (is|are|has|have) (no|none|not)": "the positive form",
    r"speaks?": "trigger, send",
    r"stands? still|stood still": "is blocked, is paused, rests",
}
"""Words by what is written in their place."""
GAP: Final = r"[ _\n#]+"
WORD: Final = re.compile("|".join(rf"(?<![a-zA-Z])(?:{one.replace(' ', GAP)})(?![a-z])" for one in INSTEAD))
PAGES: Final = [ROOT / name for name in ("README.md", "CONTRIBUTING.md")]
ENDINGS: Final = {".py", ".md", ".yaml"}


def found(path: Path) -> Iterator[str]:
    """Each such word in a file, with its place."""
    text = path.read_text()
    for match in WORD.finditer(text):
        line = text.count("\n", 0, match.start()) + 1
        shown = text.splitlines()[line - 1].strip()[:100]
        yield f"{path.relative_to(ROOT)}:{line}: {' '.join(match[0].split())!r} in {shown}"


def files_in(path: Path) -> Iterator[Path]:
    """The files of a folder whose words count; a file as it is."""
    if path.is_file():
        yield path
        return
    yield from (one for one in sorted(path.rglob("*")) if one.suffix in ENDINGS and "node_modules" not in one.parts)


def test_source_and_docs_use_the_words_of_the_field() -> None:
    folders = [*PAGES, ROOT / "docs", *(ROOT / package for package in PACKAGES)]
    problems = [line for folder in folders for path in files_in(folder) for line in found(path)]
    assert not problems, "\n".join(problems)


if __name__ == "__main__":
    for name in sys.argv[1:]:
        print(*(line for path in files_in((ROOT / name).absolute()) for line in found(path)), sep="\n")
