"""Clocks of machines need not agree: wall time is written down for people, and nothing is decided by it.

That monotonic clocks of several machines may be far apart is tried with real ones, in tests/wire/test_machines.py.
"""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2]
OTHERS = ("bench", "build", "docs", "tests")
"""Folders that are no packages."""
NOW = "wall.now_"
DECIDING = (ast.Compare, ast.BinOp, ast.IfExp, ast.If, ast.While, ast.Subscript)
"""Where a wall time would be compared, reckoned with, or looked at."""


def readings(tree: ast.Module) -> list[tuple[ast.Call, list[ast.AST]]]:
    """Each reading of the wall clock, with the expressions and statements around it, within its function."""
    found: list[tuple[ast.Call, list[ast.AST]]] = []

    def walk(node: ast.AST, around: list[ast.AST]) -> None:
        if isinstance(node, ast.Call) and ast.unparse(node.func).startswith(NOW):
            found.append((node, around))
        inside = [] if isinstance(node, ast.FunctionDef | ast.ClassDef) else [*around, node]
        for child in ast.iter_child_nodes(node):
            walk(child, inside)

    walk(tree, [])
    return found


def decided_by(around: list[ast.AST], reading: ast.Call) -> list[str]:
    """What would decide by a reading: those around it that have it in what they test, not in what they then do."""
    guilty = []
    for node in around:
        tested = [node.test] if isinstance(node, ast.If | ast.While | ast.IfExp) else [node]
        makes_path = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div)
        has_it = any(reading is one for part in tested for one in ast.walk(part))
        if isinstance(node, DECIDING) and has_it and not makes_path:
            guilty.append(type(node).__name__)
    return guilty


def test_wall_time_is_written_down_and_decides_nothing() -> None:
    read = 0
    paths = [path for path in sorted(ROOT.glob("[a-z]*/**/*.py")) if path.relative_to(ROOT).parts[0] not in OTHERS]
    texts = {path: path.read_text() for path in paths}
    for path, text in texts.items():
        for reading, around in readings(ast.parse(text)) if NOW in text else ():
            read += 1
            assert decided_by(around, reading) == [], f"{path.relative_to(ROOT)}:{reading.lineno}"
    assert read >= 4, "the search finds readings"


def test_no_message_carries_wall_time() -> None:
    """Between machines only ticks, simulated times and spans go; and `time` is not even imported where messages are."""
    tree = ast.parse((ROOT / "protocol" / "messages.py").read_text())
    fields = {node.target.id for node in ast.walk(tree) if isinstance(node, ast.AnnAssign)}  # type: ignore[union-attr]
    assert {"tick", "epoch"} <= fields
    assert not {name for name in fields if "wall" in name or "unix" in name or "utc" in name}


def test_a_comparison_is_found() -> None:
    for wrong in ("if wall.now_text() > x: pass", "y = wall.now_unix_ns() - x", "z = 1 if wall.now_unix_ns() else 2"):
        ((reading, around),) = readings(ast.parse(wrong))
        assert decided_by(around, reading)
    ((reading, around),) = readings(ast.parse("if x: name = f'{wall.now_stamp()}'"))
    assert decided_by(around, reading) == []
