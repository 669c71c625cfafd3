"""One known line stays off the terminal; whatever else is written meanwhile comes out, on its own stream."""

import json
import subprocess
import sys
from pathlib import Path

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"


def run(program: str) -> tuple[int, str, str]:
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


def test_only_the_known_line_is_left_out() -> None:
    program = """
import os
from foosim.node.physics.quiet import without_lines
os.write(1, b"known before\\n")
with without_lines(b"known"):
    for stream in (1, 2):
        os.write(stream, b"known %d\\nunknown %d\\nis known\\n" % (stream, stream))
os.write(2, b"known after\\n")
"""
    assert run(program) == (0, "known before\nunknown 1\nis known\n", "unknown 2\nis known\nknown after\n")


def test_an_error_passes() -> None:
    program = """
import os
from foosim.node.physics.quiet import without_lines
with without_lines(b"known"):
    os.write(2, b"known\\nit failed since")
    raise ImportError("no such library")
"""
    code, _, err = run(program)
    assert code == 1 and err.startswith("it failed sinceTraceback") and err.endswith("ImportError: no such library\n")


def test_a_process_without_standard_streams_goes_on() -> None:
    program = """
import os
from foosim.node.physics.quiet import without_lines
for stream in (1, 2):
    os.close(stream)
with without_lines(b"known"):
    done = True
os._exit(7 if done else 1)
"""
    assert run(program)[0] == 7


def test_pybullet_is_imported_without_a_word() -> None:
    assert run("import foosim.node.physics.bullet_engine") == (0, "", "")


def test_a_rehearsal_prints_nothing_but_its_progress_and_result() -> None:
    arguments = ["rehearse", str(TABLE), "--for", "20ms", "--engine", "bullet", "--json"]
    program = f"import sys; sys.argv[1:] = {arguments}; from foosim.cli import main; main()"
    code, out, err = run(program)
    assert code == 0 and all(" of 0.02 s simulated, " in line for line in err.splitlines()), (
        "progress, on a slow machine"
    )
    assert json.loads(out)["ticks"] == 10
