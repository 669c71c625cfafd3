"""Included files: their sections, places in the right file, and what is never read."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from foosim.common import limits
from foosim.common.errors import DeploymentError, show
from foosim.common.finding import Finding
from foosim.deployment.loader import apply_sets, load_deployment, load_network, refuse_findings, with_network
from foosim.deployment.text.files import read_source_file
from foosim.deployment.text.includes import Source
from foosim.launcher.plan import make_plan
from foosim.launcher.run_options import RunOptions
from tests.deployment.halls import HEAD, PATROL, ROVER, hall

ROBOTS = "robots: {r: {like: rover, count: 3, x: 1 m, y: 2 m, spacing: {x: 2 m}}}\n"
SHELF = "scenery:\n  shelf: {shape: box, length: 2 m, width: 1 m, height: 2 m, y: 8 m}\n"

Files = Callable[..., Source]


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Files:
    """Writes files by their names, in which a _ is a slash, into the current folder, and reads the first one."""
    monkeypatch.chdir(tmp_path)

    def write(**texts: str) -> Source:
        for name, text in texts.items():
            path = tmp_path / f"{name.replace('_', '/')}.yaml"
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
        return read_source_file(Path(f"{next(iter(texts))}.yaml"))

    return write


def refused(source: Source) -> list[str]:
    """The problems of a source in f.yaml."""
    with pytest.raises(DeploymentError) as error:
        load_deployment(source, "f.yaml")
    return list(error.value.problems)


def unreadable(files: Files, **texts: str) -> list[str]:
    """The problems of a deployment of which a file cannot be read."""
    with pytest.raises(DeploymentError) as error:
        files(**texts)
    return list(error.value.problems)


def test_sections_of_included_files_are_put_together(files: Files) -> None:
    source = files(
        f="include: [parts/rovers.yaml, world.yaml]\nscenery: {box: {shape: box, length: 1 m, width: 1 m, height: 1 m, "
        "y: -8 m}}\nnodes: {one: {robots: ['*']}}\n",
        parts_rovers="include: parts/templates.yaml\n" + ROBOTS,
        parts_templates=ROVER,
        world=HEAD + SHELF,
    )
    assert [path for path, _ in source.included] == ["parts/rovers.yaml", "parts/templates.yaml", "world.yaml"]
    alone = hall(ROVER + ROBOTS + SHELF + "  box: {shape: box, length: 1 m, width: 1 m, height: 1 m, y: -8 m}\n")
    assert load_deployment(source, "f.yaml") == load_deployment(alone, "alone")


def test_the_canonical_text_stands_alone(files: Files) -> None:
    source = files(f="include: [t.yaml]\n" + hall(ROBOTS), t=ROVER)
    canonical = apply_sets(source, "f.yaml", ["robots.r-2.x=9 m"])
    assert "include" not in canonical and canonical.count("templates") == 1
    assert apply_sets(canonical, "c", []) == canonical
    alone = hall(ROVER + ROBOTS.replace("robots: {", "robots: {r-2: {x: 9 m}, "))
    assert load_deployment(canonical, "c") == load_deployment(alone, "alone")


def test_a_text_without_its_files_is_refused() -> None:
    assert refused(Source("include: [a.yaml, b.yaml]\n" + HEAD)) == [
        "f.yaml:1:11: include[0]: a text that came without its files, which has to stand alone, 'a.yaml'",
        "f.yaml:1:19: include[1]: a text that came without its files, which has to stand alone, 'b.yaml'",
    ]
    with pytest.raises(DeploymentError, match=r"--set:1:9: include: a text that came without its files"):
        apply_sets(hall(ROVER + ROBOTS), "f", ["include=a.yaml"])


def test_problems_are_in_the_file_that_they_are_written_in(files: Files) -> None:
    text = "include: [a/a.yaml, b.yaml]\n" + HEAD + "nodes: {one: {robots: ['*']}}\nclients: {c: {on: r-4}}\n"
    fast = ROVER.replace("rate: 5 Hz", "rate: 60 Hz")
    assert refused(files(f=text, a_a=fast, b=ROBOTS)) == [
        "f.yaml:11:19: clients.c.on: unknown robot, 'r-4', nearest is 'r-1'",
        "a/a.yaml:5:32: templates.rover.sensors.pose.rate: above the rate of the ticks: valid are 1 mHz to 50 Hz, "
        "'60 Hz', nearest is '50 Hz'",
    ]
    source = files(
        f=text,
        a_a=fast + "  other: {modl: 1, class: 'a:B'}\n",
        b="# text\n" + ROBOTS.replace("x: 1 m", "x: 1 kg") + SHELF.replace("width", "widht"),
    )
    assert refused(source) == [
        "a/a.yaml:7:11: templates.other: unknown key, 'modl'",
        "b.yaml:2:40: robots.r-1.x: not a length (a number and one of m, cm, mm, um, km); kg measures a mass, '1 kg'",
        "b.yaml:4:10: scenery.shelf: missing key, 'width'",
        "b.yaml:4:36: scenery.shelf: unknown key, 'widht', nearest is 'width'",
    ]


def test_what_does_not_fit_is_named_at_the_setting_and_else_at_the_first_key(files: Files) -> None:
    """Of two values that do not fit, that of a setting is at fault, and not that of an included file."""
    table = (Path(__file__).parents[2] / "deploy" / "table.yaml").read_text()
    source = files(f="include: [rest.yaml]\n" + table, rest="clients: {}\n")
    with pytest.raises(DeploymentError) as error:
        apply_sets(source, "f.yaml", ["table.goal.height=30 mm"])
    assert all(problem.startswith("--set:1:19: table.goal.height") for problem in error.value.problems)


def test_a_key_is_given_in_one_file(files: Files) -> None:
    source = files(
        f=hall("include: [a.yaml, b.yaml]\n" + ROBOTS),
        a=ROVER + SHELF + "seed: 5\n",
        b="# b\n" + SHELF + "hall: {length: 40 m}\ntemplates: {rover: {}}\n",
    )
    assert refused(source) == [
        "f.yaml:3:1: seed: a key that two files give, also at a.yaml:9:1",
        "f.yaml:8:8: hall.length: a key that two files give, also at b.yaml:4:8",
        "b.yaml:3:3: scenery.shelf: a key that two files give, also at a.yaml:8:3",
        "b.yaml:5:13: templates.rover: a key that two files give, also at a.yaml:2:3",
    ]


@pytest.mark.parametrize(
    ("path", "problem"),
    [
        ("../a.yaml", "has no empty component, no . and no .."),
        ("/etc/passwd", "is relative"),
        ("~/a.yaml", "is relative"),
        ("a/../../a.yaml", "has no empty component, no . and no .."),
        ("file:a.yaml", "has no scheme and no drive"),
        ("a//b.yaml", "has no empty component, no . and no .."),
        (".hidden.yaml", "has letters, digits, _, - and . (not at the beginning) between its slashes"),
    ],
)
def test_a_path_leads_nowhere_but_into_the_folder(files: Files, path: str, problem: str) -> None:
    source = files(f=f"include: ['{path}']\n" + hall(ROVER + ROBOTS))
    assert source.included == ()
    assert refused(source) == [f"f.yaml:1:11: include[0]: a path inside the deployment's folder {problem}, '{path}'"]


def test_what_cannot_be_read_is_said_where_it_is_included(files: Files, tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "big.yaml").write_bytes(b"#" * (limits.DEPLOYMENT_BYTES_MAX + 1))
    (tmp_path / "latin.yaml").write_bytes(b"a: 1\nb: \xff\n")
    (tmp_path / "real.yaml").write_text(SHELF)
    (tmp_path / "link.yaml").symlink_to("real.yaml")
    (tmp_path / "out").symlink_to("/etc")
    os.mkfifo(tmp_path / "pipe.yaml")
    names = ["absent", "folder", "big", "latin", "link", "out/passwd", "pipe"]
    include = "".join(f"  - {name}{'' if name in ('folder', 'out/passwd') else '.yaml'}\n" for name in names)
    refused_link = "a symbolic link, or no folder, on the way; neither is followed"
    assert unreadable(files, f=f"include:\n{include}" + hall(ROVER + ROBOTS)) == [
        f"f.yaml:2:5: include[0]: cannot be included, absent.yaml: No such file or directory in {tmp_path}",
        "f.yaml:3:5: include[1]: cannot be included, folder: no regular file",
        f"f.yaml:6:5: include[4]: cannot be included, link.yaml: {refused_link}",
        f"f.yaml:7:5: include[5]: cannot be included, out/passwd: {refused_link}",
        "f.yaml:8:5: include[6]: cannot be included, pipe.yaml: no regular file",
        f"big.yaml:1:1: more than {limits.DEPLOYMENT_BYTES_MAX} bytes",
        "latin.yaml:2:4: not UTF-8, 255",
    ]


@pytest.mark.parametrize(
    ("texts", "problem"),
    [
        ({"f": "include: [a.yaml]\n", "a": "include: b.yaml\n", "b": "include: [a.yaml]\n"},
         "b.yaml:1:11: include[0]: a file that includes itself (a.yaml includes b.yaml includes a.yaml), 'a.yaml'"),
        ({"f": "include: [a.yaml]\n", "a": "include: f.yaml\n"},
         "a.yaml:1:10: include: a file that includes itself (f.yaml includes a.yaml includes f.yaml), 'f.yaml'"),
        ({"f": "include: f.yaml\n"},
         "f.yaml:1:10: include: a file that includes itself (f.yaml includes f.yaml), 'f.yaml'"),
        ({"f": "include: [5, [x]]\n"}, "f.yaml:1:11: include[0]: not a path, 5"),
        ({"f": "include: {a: 1}\n"}, "f.yaml:1:10: include: not a path, a mapping of 1"),
        ({"f": "include: [a.yaml]\n", "a": "- 1\n"}, "a.yaml:1:1: not a mapping of sections, a list of 1"),
        ({"f": "include: [a.yaml]\n", "a": "a: &b 1\n"},
         "a.yaml:1:4: anchors are refused (a text that begins with & needs quotes), '&b'"),
        ({"f": "include: [a.yaml]\n", "a": "# nothing\n"}, "a.yaml:1:1: no YAML document, '# nothing\\n'"),
        ({"f": "include: [a.yaml]\n", "a": "a: 1\na: 2\n"}, "a.yaml:2:1: duplicate key (first in line 1), 'a'"),
    ],
)  # fmt: skip
def test_what_is_no_file_of_sections_is_refused(files: Files, texts: dict[str, str], problem: str) -> None:
    texts["f"] += hall(ROVER + ROBOTS)
    assert problem in refused(files(**texts))


def test_a_file_that_two_include_is_read_once(files: Files) -> None:
    both = "include: [a.yaml, b.yaml]\n" + hall(ROBOTS)
    source = files(f=both, a="include: t.yaml\n", b="include: [t.yaml]\n", t=ROVER)
    assert [path for path, _ in source.included] == ["a.yaml", "t.yaml", "b.yaml"]
    load_deployment(source, "f.yaml")


def test_files_are_limited_in_number_depth_and_size(files: Files) -> None:
    most = limits.INCLUDES_MAX
    many = {f"n{n}": f"k{n}: 1\n" for n in range(most + 1)}
    include = f"include: [{', '.join(f'{name}.yaml' for name in many)}]\n"
    found = refused(files(f=include + HEAD, **many))
    assert found[0].endswith(f": include[{most}]: more than {most} included files, 'n{most}.yaml'")
    deep = limits.INCLUDE_DEPTH_MAX
    chain = {f"n{n}": f"include: n{n + 1}.yaml\n" for n in range(deep)} | {f"n{deep}": "a: 1\n"}
    found = refused(files(f="include: n0.yaml\n" + HEAD, **chain))
    assert f"n{deep - 1}.yaml:1:10: include: more than {deep} files that include one another, 'n{deep}.yaml'" in found
    comment = "#" * 65_000 + "\n"
    found = refused(files(f="include: [a.yaml, b.yaml, c.yaml, d.yaml, e.yaml]\n" + HEAD, **{
        name: f"{comment}{name}: 1\n" for name in "abcde"}))  # fmt: skip
    assert "f.yaml:1:43: include[4]: with it the included files have more than 262144 bytes, 'e.yaml'" in found
    numbers = f"x: [{'1,' * 9_998}]\n"
    found = refused(files(f="include: [a.yaml, b.yaml]\n" + HEAD, a=numbers, b=numbers))
    assert "f.yaml:1:19: include[1]: with it there are more than 20000 nodes" in found


def test_what_is_too_large_with_its_files_is_refused(files: Files) -> None:
    texts = {name: f"clients: {{{name}: {{on: {'x' * 40_000}}}}}\n" for name in "ab"}
    with pytest.raises(DeploymentError, match=r"f\.yaml:2:1: too large with its settings and included files"):
        apply_sets(files(f="# f\ninclude: [a.yaml, b.yaml]\n" + hall(ROVER + ROBOTS), **texts), "f.yaml", [])


def test_settings_change_what_was_included(files: Files) -> None:
    source = files(f="include: [t.yaml]\n" + hall(ROBOTS), t=ROVER)
    text = apply_sets(
        source, "f.yaml", ["templates.rover.sensors.pose.rate=10 Hz", "robots.r-2.sensors.pose.rate=1 Hz"]
    )
    robots = load_deployment(text, "f").robots
    assert [robots[f"r-{n}"].sensors["pose"].rate_hz for n in (1, 2, 3)] == [10, 1, 10]


def test_a_network_is_included_too(files: Files) -> None:
    source = files(f="include: [net.yaml]\n", net="network: {links: [{id: a, from: '*', to: '*', delay: 1 ms}]}\n")
    network = load_network(source, "f.yaml")
    assert network is not None and network.links[0].delay_ns == 1_000_000
    alone = hall(ROVER + ROBOTS)
    assert load_deployment(with_network(alone, "alone", (source, "f.yaml"), []), "n").network == network


def test_later_findings_are_placed_in_the_included_file(files: Files) -> None:
    source = files(
        f="include: [t.yaml]\n" + hall(ROBOTS), t=ROVER + f"players: {{p: {{class: '{PATROL}', rate: 1 Hz}}}}\n"
    )
    with pytest.raises(DeploymentError) as error:
        refuse_findings(source, "f.yaml", [Finding(("players", "p", "class"), "no such class", PATROL)])
    assert error.value.problems == (f"t.yaml:7:22: players.p.class: no such class, {show(PATROL)}",)


def test_a_plan_is_made_of_a_file_with_its_files(files: Files) -> None:
    files(f="include: [parts/t.yaml]\n" + hall(ROBOTS), parts_t=ROVER)
    plan = make_plan(RunOptions(Path("f.yaml")))
    assert len(plan.deployment.robots) == 3
    assert "include" not in plan.text
