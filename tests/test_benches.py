"""What benches decide themselves, without a run."""

from bench import freeze, hot, shapes, validate
from bench.vhub_loss import CALM_S, KILLS, Killer
from foosim.deployment.loader import load_deployment


def test_the_vhub_is_killed_by_simulated_time() -> None:
    """A run that starts slowly is left alone until it plays, and one that is not back yet is not hit again."""
    killed: list[float] = []
    looks = [0.0, CALM_S / 2, CALM_S, CALM_S, CALM_S + 0.1, 2 * CALM_S - 0.1, 2 * CALM_S, 3 * CALM_S, 9 * CALM_S]
    killer = Killer(lambda: killed.append(looks[0]))
    while looks:
        killer(looks[0])
        looks.pop(0)
    assert killed == [CALM_S, 2 * CALM_S] and len(killed) == KILLS


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


def test_two_checkouts_are_compared_by_the_ratios_of_their_rounds() -> None:
    by = {"now": shapes.Found({"tick b": [2.0, 3.0, 4.0]}), "before": shapes.Found({"tick b": [4.0, 4.0, 4.0]})}
    assert shapes.with_ratio(by)["ratio"] == {"tick b": [0.5, 0.75, 1.0]}
    assert "ratio" not in shapes.with_ratio({"now": by["now"]})
    assert shapes.spread([3.0, 1.0, 2.0]) == [2.0, 1.0, 3.0] and shapes.spread([]) == []


def test_the_fleet_that_is_validated_is_the_same_by_counts_and_by_lines() -> None:
    by_counts, by_lines = (load_deployment(validate.fleet_text(by_line=by_line), "f") for by_line in (False, True))
    assert by_counts == by_lines
    assert len(by_counts.robots) == len(by_counts.players) == validate.ROVERS + 1
    assert len(by_counts.nodes) == validate.NODES


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
