"""Deployment files: every problem at once, each with its place, byte for byte, and nothing from outside gets through.

The bad files are made from good ones by other lines, more lines and settings: deployment_problems.txt has them with
their reports.
"""

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foosim.common.errors import DeploymentError
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.text.files import read_deployment_text
from foosim.deployment.text.report import PROBLEMS_MAX
from foosim.deployment.text.yaml import locate_in, plain, read_tree
from tests.apart import apart
from tests.deployment.halls import FLEET, MADE, PILOT, ROVER, TWO, behind_head, hall

HALLS = {"hall": "", "rover": ROVER, "pilots": ROVER + PILOT + TWO, "fleet": FLEET}
"""What halls of that name begin with."""
CASES = Path(__file__).with_name("deployment_problems.txt")
TABLE_TEXT = (Path(__file__).parents[2] / "deploy" / "table.yaml").read_text()


def small_text() -> str:
    """One rod, a camera, one node, a player and a client; the table of table.yaml on a single line."""
    tree, _ = read_tree(TABLE_TEXT, locate_in("table.yaml"))
    assert tree is not None
    return f"""\
format: 2
world: small
seed: 1
tick: 2 ms
substeps: 4
engine: pure
pace: fast
table: {json.dumps(plain(tree)["table"])}
robots:
  red.goal:
    model: rod
    team: red
    line: goal
    sensors:
      encoder:
        kind: encoder
        rate: 100 Hz
        modifiers:
          - {{kind: gaussian_noise, std: {{slide: 0.2 mm, spin: 0.5 deg}}}}
  camera:
    model: camera
    sensors:
      ball:
        kind: ball
        rate: 100 Hz
        modifiers: [{{kind: gaussian_noise, std: 1.5 mm}}]
nodes:
  one:
    robots: [red.goal, camera]
players:
  keeper:
    class: foosim.library.table.players.football:Team
    rate: 100 Hz
    robots:
      red.goal: [encoder]
      camera: [ball]
clients:
  hand:
    lockstep: true
    rate: 50 Hz
network:
  links:
    - id: up
      from: [keeper, hand]
      to: red.*
      loss: 0.5 %
      jitter:
        shape: gamma
        sd: 0.3 ms
    - id: down
      from: '*'
      to: keeper
deadlines:
  tick_named: 500 ms
  tick_lost: 1 s
"""


SMALL = small_text()
GOOD = SMALL.splitlines(keepends=True)


def problems_of(text: str) -> list[str]:
    """The lines of the report on a bad file."""
    with pytest.raises(DeploymentError) as error:
        load_deployment(text, "small.yaml")
    assert str(error.value) == "\n".join(error.value.problems)
    return list(error.value.problems)


def changed(*lines: tuple[int, str]) -> str:
    """The small file with these lines, counted from 1, replaced (by nothing, one or several)."""
    text = GOOD.copy()
    for number, line in lines:
        text[number - 1] = line + "\n" if line else ""
    return "".join(text)


def test_the_small_file_is_good() -> None:
    deployment = load_deployment(SMALL, "small.yaml")
    assert deployment.endpoints() == ["camera", "hand", "keeper", "red.goal"]
    assert deployment.owners() == {"camera": "one", "red.goal": "one"}


@dataclass
class Case:
    """A case of deployment_problems.txt: how a text is made, and the lines of the report on it."""

    base: str
    sets: list[str]
    replaced: list[tuple[int, str]]
    added: str
    problems: list[str]
    written_out: str

    @property
    def found(self) -> list[str]:
        """The problems that there are; in halls their places are counted from the first added or shared line."""
        if self.base in ("made", *HALLS):
            text = MADE if self.base == "made" else hall(HALLS[self.base] + self.added)
            return [behind_head(line, "f") for line in problems_with(text, "f", self.sets)]
        if self.base == "small" and not self.sets:
            found = problems_with(changed(*self.replaced), "small.yaml", ())
            return [problem.removeprefix("small.yaml:") for problem in found]
        return problems_with(apart() if self.base == "apart" else TABLE_TEXT, "table.yaml", self.sets)


def problems_with(text: str, name: str, sets: Sequence[str]) -> list[str]:
    """The lines of the report on a text with settings; none for a good one."""
    try:
        load_deployment(apply_sets(text, name, sets) if sets else text, name)
    except DeploymentError as error:
        assert str(error) == "\n".join(error.problems)
        return list(error.problems)
    return []


def cases() -> Iterator[Case]:
    """The cases of deployment_problems.txt."""
    for block in CASES.read_text().partition("\n\n")[2].strip("\n").split("\n\n"):
        lines = block.split("\n")
        marks = ("> ", "+ ", "= ", "--set ", "@")
        marked = {mark: [line[len(mark) :] for line in lines if line.startswith(mark)] for mark in marks}
        replaced: dict[int, list[str]] = {}
        for match in filter(None, (re.fullmatch(r"([0-9]+)\|(?: (.*))?", line) for line in lines)):
            replaced.setdefault(int(match[1]), []).append(match[2] or "")
        base = marked["@"][0] if marked["@"] else "small"
        assert len(lines) == sum(map(len, (*marked.values(), *replaced.values()))), block
        others = [(number, "\n".join(texts)) for number, texts in replaced.items()]
        added, out = ("".join(f"{line}\n" for line in marked[mark]) for mark in ("+ ", "= "))
        yield Case(base, marked["--set "], others, added, marked["> "], out)


@pytest.mark.parametrize("case", list(cases()), ids=lambda case: (case.sets or [case.added or case.base])[0][:60])
def test_each_problem_is_one_line_with_its_place(case: Case) -> None:
    assert case.found == case.problems
    if case.written_out:
        short, long = hall(HALLS[case.base] + case.added), hall(case.written_out)
        assert load_deployment(short, "short").model_dump() == load_deployment(long, "long").model_dump()


@pytest.mark.parametrize("text", ["null", "[]", "text", "1", "''"])
def test_a_file_that_is_no_mapping_is_refused(text: str) -> None:
    assert len(problems_of(text)) == 1
    assert problems_of(text)[0].startswith("small.yaml:1:1: not a mapping, ")


def test_an_empty_mapping_lacks_every_required_key() -> None:
    missing = [problem.rpartition(" ")[2] for problem in problems_of("{}")]
    keys = ["format", "nodes", "pace", "robots", "seed", "substeps", "tick", "world"]
    assert sorted(missing) == [f"'{key}'" for key in keys]


def test_nothing_is_built_from_what_is_refused_by_the_scan() -> None:
    """The schema is not asked: its problems would be reported too."""
    assert problems_of("a: &a [1]\nb: *a\n") == [
        "small.yaml:1:4: anchors are refused (a text that begins with & needs quotes), '&a'",
        "small.yaml:2:4: aliases are refused (a text that begins with * needs quotes), '*a'",
    ]


def test_the_report_of_a_hostile_file_is_bounded() -> None:
    keys = problems_of("".join(f"k{number}: 1\n" for number in range(5000)))
    assert len(keys) == PROBLEMS_MAX + 1
    assert keys[-1] == f"and more: only the first {PROBLEMS_MAX} problems are shown"
    robots = "".join(f"  a{number}: {{model: camera, sensors: {{}}}}\n" for number in range(600))
    names = ",".join(f"b{number}" for number in range(4000))
    hostile = changed((10, f"{robots}  red.goal:"), (29, f"    robots: [{names}]"))
    assert len(problems_of(hostile)) == PROBLEMS_MAX + 1


def test_a_file_is_read_from_disk_within_its_bounds(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + SMALL.encode())
    assert read_deployment_text(path) == SMALL


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"a: 1\nb: caf\xe9\n", "2:7: not UTF-8, 233"),
        (b"\xef\xbb\xbf\xff", "1:1: not UTF-8, 255"),
        (b"a" * 65_537, "1:1: more than 65536 bytes"),
        (None, " there is no such file"),
    ],
)
def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path, content: bytes | None, problem: str) -> None:
    path = tmp_path / "a.yaml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(DeploymentError) as error:
        read_deployment_text(path)
    assert list(error.value.problems) == [f"{path}:{problem}"]


EDITS = st.lists(
    st.tuples(
        st.sampled_from(["drop", "double", "swap", "insert", "value"]),
        st.integers(0, len(GOOD) - 1),
        st.integers(0, 40),
        st.sampled_from(
            [*"[]{}:,-?!&*#|>'\"%@ \t\n~10", "null", "on", "1e999", "<<: ", "\x00", "\u2028", "\\ud800", "!!str "]
        ),
    ),
    min_size=1,
    max_size=4,
)


@given(EDITS)
def test_a_mangled_file_is_loaded_or_refused_in_plain_lines(edits: list[tuple[str, int, int, str]]) -> None:
    lines = GOOD.copy()
    for kind, number, column, text in edits:
        index = number % len(lines)
        line = lines[index]
        if kind == "drop":
            del lines[index]
        elif kind == "double":
            lines.insert(index, line)
        elif kind == "swap":
            lines[index], lines[column % len(lines)] = lines[column % len(lines)], line
        elif kind == "insert":
            lines[index] = line[:column] + text + line[column:]
        else:
            lines[index] = line.partition(":")[0] + ": " + text + "\n"
    try:
        load_deployment("".join(lines), "f")
    except DeploymentError as error:
        for problem in error.problems:
            assert problem.startswith("f:")
            assert problem.isprintable()
