"""Modules of the page that need no document: run by node, where it is."""

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

SOURCES = Path(__file__).parent.parent.parent / "console" / "page" / "src"
pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="node is needed, 20 or newer")


def run(script: str) -> Any:
    """Return what a module's code hands to `told`."""
    head = "const told = (value) => process.stdout.write(JSON.stringify(value));\n"
    command = ["node", "--input-type=module", "--eval", head + script.replace("SOURCES", SOURCES.as_uri())]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_names_stand_in_the_map_and_on_none_of_the_others() -> None:
    """Sixty bodies on a few places, also in the corners."""
    labels, texts = run("""
        import { placeLabels } from "SOURCES/map_labels.js";
        const at = [[0, 0], [800, 600], [400, 300], [420, 305], [0, 300]];
        const places = [...Array(60).keys()].map((n) => ({ x: at[n % 5][0], y: at[n % 5][1], text: `rover${n}.arm` }));
        told([placeLabels(places, { width: 800, height: 600 }), places.map(({ text }) => text)]);
    """)
    halves = [3.3 * len(text) for text in texts]
    boxes = [(a["x"] - half, a["x"] + half, a["y"]) for a, half in zip(labels, halves, strict=True)]
    assert all(left >= 0 and right <= 800 and 12 <= foot <= 600 for left, right, foot in boxes)
    together = [(a, b) for n, a in enumerate(boxes) for b in boxes[:n]
                if a[0] < b[1] and b[0] < a[1] and abs(a[2] - b[2]) < 12]  # fmt: skip
    assert together == []
    assert sum(label["apart"] for label in labels) > 20, "a line leads to those that had to go far"


def test_series_are_stacked_and_lonely_values_found() -> None:
    stacked, lonely, ticks = run("""
        import { lonely, stack } from "SOURCES/series.js";
        import { ticks } from "SOURCES/text.js";
        const one = (name, points) => ({ name, unit: "", points });
        told([
          stack([one("a", [[0, 1], [1, 2]]), one("b", [[0, 3], [1, null]])]),
          [[1, null, 2, 3, null, 4], [1, undefined, 2], [null, undefined, 5, undefined, null], []].map(lonely),
          [ticks(0, 32, 8), ticks(0.1, 0.4, 4), ticks(3, 3, 8)],
        ]);
    """)
    assert [(one["name"], one["points"]) for one in stacked] == [("b", [[0, 4], [1, 2]]), ("a", [[0, 1], [1, 2]])]
    assert lonely == [[0, 5], [], [2], []]
    assert ticks == [[0, 5, 10, 15, 20, 25, 30], [0.1, 0.2, 0.3, 0.4], [3]]
