"""The table with a process for each role, for tests that place roles, or put some of them together, by themselves."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

TABLE: Final = Path(__file__).parents[1] / "deploy" / "table.yaml"


def apart() -> str:
    """Return the deployment without the processes that roles share."""
    text = re.sub(r"^ *process: main\n", "", TABLE.read_text(), flags=re.MULTILINE)
    return text.replace("supervisor:\n\nvhub:\n\n", "")
