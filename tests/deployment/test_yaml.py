"""YAML from outside: what scalars mean, what is refused before anything is built, and that text reads back."""

from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from foosim.deployment.text.yaml import DEPTH_MAX, locate_in, measure, plain, read_tree, resolve, write_yaml


def read(text: str) -> Any:
    """The data of a text without problems."""
    tree, problems = read_tree(text, locate_in("f"))
    assert problems == []
    assert tree is not None
    return plain(tree)


def refused(text: str) -> list[str]:
    """The problems of a text of which nothing is built."""
    tree, problems = read_tree(text, locate_in("f"))
    assert tree is None
    return [str(problem) for problem in problems]


ANCHORS = "anchors are refused (a text that begins with & needs quotes)"
ALIASES = "aliases are refused (a text that begins with * needs quotes)"
TAGS = "tags are refused (a text that begins with ! needs quotes)"


@pytest.mark.parametrize(
    ("text", "value"),
    [
        *((text, text) for text in ("on", "off", "yes", "no", "y", "n", "12:30:45", "1_000", "2001-12-14", "=", "0b1")),
        *((text, None) for text in ("null", "Null", "~", "")),
        *((text, True) for text in ("true", "True", "TRUE")),
        *((text, False) for text in ("false", "False", "FALSE")),
        *(("12", 12), ("-7", -7), ("+3", 3), ("007", 7), ("0x1F", 31), ("0o17", 15), ("1e5", 1e5), ("1.", 1.0)),
        *((".5", 0.5), ("-2.5e-3", -0.0025), ("1e", "1e"), ("2 ms", "2 ms"), ("0x", "0x"), ("+", "+"), (".", ".")),
    ],
)
def test_plain_scalars_mean_what_yaml_1_2_says(text: str, value: object) -> None:
    assert resolve(text) == value
    assert type(resolve(text)) is type(value)
    assert read(f"a: {text}\n") == {"a": value}
    assert read(f"a: '{text}'\n") == {"a": text}


def test_keys_are_text() -> None:
    assert read("on: 1\n2: 2\nnull: 3\n12:30:45: 4\n'': 5\n") == {"on": 1, "2": 2, "null": 3, "12:30:45": 4, "": 5}


def test_flow_collections_and_all_kinds_of_scalars_are_read() -> None:
    text = 'a: [1, {b: c}]\nb: |\n  x\n  y\nc: >\n  x\n  y\nd: "\\u00e9"\n? e\n: f\n'
    assert read(text) == {"a": [1, {"b": "c"}], "b": "x\ny\n", "c": "x y\n", "d": "é", "e": "f"}


@pytest.mark.parametrize(
    ("text", "problems"),
    [
        (
            "a: &x [1]\nb: *x\nc: !!python/object/apply:os.system ['true']\n<<: {d: 1}\n",
            [
                f"f:1:4: {ANCHORS}, '&x'",
                f"f:2:4: {ALIASES}, '*x'",
                f"f:3:4: {TAGS}, 'tag:yaml.org,2002:python/object/apply:os.sy...'",
                "f:4:1: merge keys are refused, '<<'",
            ],
        ),
        ("a: ! b\n", [f"f:1:4: {TAGS}, '!'"]),
        ("a: !!str b\n", [f"f:1:4: {TAGS}, 'tag:yaml.org,2002:str'"]),
        ("&k a: 1\n", [f"f:1:1: {ANCHORS}, '&k'"]),
        ("%TAG ! tag:x:\n---\na: !y 1\n", [f"f:3:4: {TAGS}, 'tag:x:y'"]),
        ("", ["f:1:1: no YAML document, ''"]),
        ("# nothing\n", ["f:1:1: no YAML document, '# nothing\\n'"]),
        ("a: 1\n---\nb: 1\n", ["f:2:1: more than one YAML document, '---'"]),
        ("? [a]\n: 1\n", ["f:1:3: a key is a text, 'a collection or an alias'"]),
        ("a: 1\n  b: 2\n", ["f:2:4: not valid YAML, mapping values are not allowed here"]),
        ("a: 'b\n", ["f:2:1: not valid YAML, found unexpected end of stream, while scanning a quoted scalar"]),
        ("a: 1\nb: \x00\n", ["f:2:4: a character that YAML does not allow, '\\x00'"]),
        ("a: \ud800\n", ["f:1:4: a character that YAML does not allow, '\\ud800'"]),
        ('a: "\\ud800"\n', ["f:1:4: half a character (a lone surrogate), '\\ud800'"]),
        ('a: "\\UFFFFFFFF"\n', ["f:1:7: not valid YAML, 'a number out of range'"]),
        ("%YAML 1." + "9" * 5000 + "\n---\na\n", ["f:1:9: not valid YAML, 'a number out of range'"]),
        ("a: 1e999\nb: .inf\nc: -.INF\nd: .nan\n", [
            "f:1:4: a number is finite, '1e999'", "f:2:4: a number is finite, '.inf'",
            "f:3:4: a number is finite, '-.INF'", "f:4:4: a number is finite, '.nan'",
        ]),
        ("a: " + "9" * 5000 + "\n", ["f:1:4: a number of more than 40 characters, '" + "9" * 43 + "...'"]),
    ],
)  # fmt: skip
def test_what_is_refused_is_refused_with_its_place(text: str, problems: list[str]) -> None:
    assert refused(text) == problems


def bombs() -> dict[str, str]:
    """Texts within the limit of bytes that cost much to read, or crash a reader that recurses."""
    lol = "a0: &a0 [lol, lol]\n" + "".join(f"a{n + 1}: &a{n + 1} [*a{n}, *a{n}]\n" for n in range(30))
    return {
        "billion laughs": lol,
        "deep flow sequences": "[" * 65_000,
        "deep flow mappings": "{a: " * 16_000,
        "deep block sequences": "- " * 32_000,
        "deep block mappings": "".join(" " * n + "a:\n" for n in range(300)),
        "complex keys": "? " * 32_000,
        "many nodes": "[" + "a," * 32_000 + "]",
        "many bytes": "a: " + "b" * 65_536,
        "many documents": "---\n" * 16_000,
    }


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("deep flow sequences", f"f:1:17: nested more than {DEPTH_MAX} deep, 17"),
        ("deep flow mappings", f"f:1:65: nested more than {DEPTH_MAX} deep, 17"),
        ("deep block mappings", f"f:17:17: nested more than {DEPTH_MAX} deep, 17"),
        ("complex keys", "f:1:3: a key is a text, 'a collection or an alias'"),
        ("many nodes", "f:1:40000: more than 20000 nodes, 20001"),
        ("many bytes", "f:1:1: more than 65536 bytes, 65539"),
        ("many documents", "f:2:1: more than one YAML document, '---'"),
        ("deep block sequences", f"f:1:33: nested more than {DEPTH_MAX} deep, 17"),
    ],
)
def test_a_bomb_is_named(name: str, problem: str) -> None:
    assert refused(bombs()[name]) == [problem]


def test_a_bomb_of_aliases_is_refused_in_short_lines() -> None:
    assert all(len(problem) < 200 and "\n" not in problem for problem in refused(bombs()["billion laughs"]))


def test_depth_and_nodes_up_to_the_limits_are_read() -> None:
    deep = "[" * DEPTH_MAX + "]" * DEPTH_MAX
    tree, problems = read_tree(deep, locate_in("f"))
    assert problems == []
    assert tree is not None
    assert measure(tree) == (DEPTH_MAX, DEPTH_MAX)
    many = "[" + "1," * 19_999 + "]"
    tree, problems = read_tree(many, locate_in("f"))
    assert problems == []
    assert tree is not None
    assert measure(tree) == (1, 20_000)
    assert refused("[" + "1," * 20_000 + "]") != []


def test_a_duplicate_key_keeps_the_first_value_and_is_a_problem() -> None:
    tree, problems = read_tree("a: 1\nb: {c: 1, c: 2}\n'a': 3\n", locate_in("f"))
    assert [str(problem) for problem in problems] == [
        "f:2:11: duplicate key (first in line 2), 'c'",
        "f:3:1: duplicate key (first in line 1), 'a'",
    ]
    assert tree is not None
    assert plain(tree) == {"a": 1, "b": {"c": 1}}


SIGNS = "0123456789.eE+-~:#'\"\n \t&*!|>%@`[]{},\\\x85\u2028\ufeff"
WORDS = ["on", "1e5", "0o17", ".inf", "<<", "null", "True", "12:30:45", "~", "-", "=", "0x1f", "1_0", "---", "..."]
TEXTS = st.text(st.characters(exclude_categories=["Cs"]) | st.sampled_from(SIGNS), max_size=12) | st.sampled_from(WORDS)
NUMBERS = st.integers(-(10**30), 10**30) | st.floats(allow_nan=False, allow_infinity=False)

DATA = st.recursive(
    st.none() | st.booleans() | NUMBERS | TEXTS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXTS, inner, max_size=4),
    max_leaves=12,
)


@given(DATA)
def test_what_is_written_reads_back(data: object) -> None:
    back = read(write_yaml(data))
    assert back == data
    assert repr(back) == repr(data)


def test_long_and_odd_keys_read_back() -> None:
    for key in ("k" * 101, "k" * 2000, "a b", "a: b", "\u00e9", "\u00a0", "line\nline", "", " a", "-", "1", "no", "a:"):
        data = {key: {key: [key, {key: key}, [[key], {}, []]]}}
        assert read(write_yaml(data)) == data
        assert yaml.safe_load(write_yaml(data)) == data


@given(DATA)
def test_what_is_written_is_the_same_in_yaml_1_1(data: object) -> None:
    assert yaml.safe_load(write_yaml(data)) == data


@given(st.text(max_size=80) | st.text("[]{}:,-?!&*#|>'\"%@`\n \t\\ab10.~=<", max_size=80))
def test_any_text_is_read_or_refused(text: str) -> None:
    tree, problems = read_tree(text, locate_in("f"))
    assert tree is not None or problems
    for problem in problems:
        assert str(problem).isprintable()
    if tree is not None and not problems:
        data = plain(tree)
        assert read(write_yaml(data)) == data
