"""What benches decide themselves, without a run."""

from bench import freeze, hot


def test_the_table_of_hot_modules_says_what_is_left_to_the_interpreter() -> None:
    listed = hot.compiled()
    assert {"vhub/state/hub_state", "node/core"} <= listed
    shares = {
        "one": {"vhub/state/hub_state": 60.0, "capture/rows": 39.9, "vhub/seldom": 0.1},
        "two": {"capture/rows": 100.0},
    }
    _, *rows, left = (line.split() for line in hot.lines(shares, 0.3, listed))
    assert rows == [["capture/rows", "39.90", "100.00"], ["*", "vhub/state/hub_state", "60.00", "0.00"]]
    assert left[-2:] == ["40.00", "100.00"]


def test_a_tree_is_compared_with_a_commit_by_fields_and_rows_whatever_fields_are_called() -> None:
    there = {
        "ticks": 2, "digest": "ab", "score": ["1 : 0"], "packets": {"delivered": 3},
        "fields": {"ball position": "1", "ball spin": "2"}, "rows": {"/tick": "3", "/packets": "4"},
    }  # fmt: skip
    renamed = {"fields": {"ball position": "1", "ball turn": "2"}, "rows": {"/tick": "5", "/packets": "4"}}
    here = {**there, "digest": "cd", **renamed}
    assert freeze.differences(there, there, {}) == []
    assert freeze.differences(here, there, {"spin": "turn"}) == []
    assert freeze.differences(here, there, {}) == [
        "digest ab -> cd",
        "field ball spin, which this tree lacks",
        "field ball turn, which the commit lacks",
        "rows of /tick",
    ]
    moved = {**here, "fields": {"ball position": "1", "ball turn": "9"}, "score": ["0 : 0"]}
    assert freeze.differences(moved, there, {"spin": "turn"}) == ["score ['1 : 0'] -> ['0 : 0']", "field ball turn"]
