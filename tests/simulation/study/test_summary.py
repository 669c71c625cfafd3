"""What a sweep's table shows: groups, their means against worked figures, failed runs, the picture's parts."""

from __future__ import annotations

from typing import Any

import pytest
from matplotlib.figure import Figure
from scipy import stats

from foosim.common.errors import BadValue, UnknownName
from foosim.simulation.study.summary import draw, groups, varied
from foosim.simulation.study.table import Table

DELAY, RATE = "network.links.0.delay", "robots.*.sensors.pose.rate"


def row(delay: str, rate: str, seed: int, score: float | None, loss: float | None, message: str = "") -> dict[str, Any]:
    figures = {"score": score, "loss": loss, "same": None if message else 4.0, "ticks": None if message else 500}
    return {
        DELAY: delay, RATE: rate, "seed": seed, "message": message,
        **{name: value for name, value in figures.items() if value is not None},
    }  # fmt: skip


TABLE = Table(
    (DELAY, RATE),
    [
        row("20ms", "10Hz", 1, 1.0, 0.5),
        row("20ms", "50Hz", 1, 9.0, None),
        row("0.02s", "50Hz", 1, 8.0, None),
        row("0ms", "10Hz", 1, 5.0, 0.25),
        row("20ms", "10Hz", 2, 2.0, 0.5),
        row("20ms", "10Hz", 3, 6.0, None),
        row("20ms", "10Hz", 4, 99.0, None, "it fell over"),
        row("0ms", "50Hz", 1, None, None, "--set:1:3: out of range"),
    ],
)


def test_rows_with_equal_parameters_are_a_group_with_its_means() -> None:
    found = groups(TABLE, [DELAY, RATE], ["score", "loss"])
    assert [(group.parameters, group.runs, group.failed) for group in found] == [
        (("20ms", "10Hz"), 4, 1),
        (("20ms", "50Hz"), 1, 0),
        (("0.02s", "50Hz"), 1, 0),
        (("0ms", "10Hz"), 1, 0),
        (("0ms", "50Hz"), 1, 1),
    ]
    first, second, last = found[0], found[1], found[4]
    score, loss = first.mean("score"), first.mean("loss")
    assert score is not None and loss is not None
    half = stats.t.ppf(0.975, 2) * 7**0.5 / 3**0.5  # 1, 2 and 6: mean 3, variance (4 + 1 + 9) / 2
    assert (score.value, score.low, score.high) == pytest.approx((3.0, 3.0 - half, 3.0 + half))
    assert (loss.value, loss.low, loss.high, first.values["loss"]) == (0.5, 0.5, 0.5, [0.5, 0.5])
    assert second.mean("loss") is None and (nine := second.mean("score")) is not None
    assert (nine.value, nine.low, nine.high) == (9.0, None, None)
    assert last.mean("score") is None


def test_grouped_by_fewer_parameters_the_others_are_pooled() -> None:
    found = groups(TABLE, [RATE], ["score"])
    assert [(group.parameters, group.runs, group.failed) for group in found] == [(("10Hz",), 5, 1), (("50Hz",), 3, 1)]
    assert found[0].values == {"score": [1.0, 5.0, 2.0, 6.0]}
    (whole,) = groups(TABLE, [], ["score"])
    assert (whole.runs, len(whole.values["score"])) == (8, 6)


def test_metrics_differ_among_the_runs_that_worked() -> None:
    assert varied(TABLE) == ["loss", "score"]


def test_a_picture_has_a_panel_for_each_metric_and_a_curve_for_each_combination() -> None:
    figure = Figure()
    draw(figure, TABLE, DELAY, ["score", "loss"], "a title")
    score, loss = figure.axes
    assert (score.get_ylabel(), loss.get_ylabel()) == ("score", "loss")
    assert score.get_xlabel() == f"{DELAY}, ms"
    (slow, _, (slow_bars,)), (fast, _, _) = score.containers
    assert slow.get_xydata().tolist() == [[0.0, 5.0], [20.0, 3.0]], "in the order of the delay, failed runs left out"
    assert fast.get_xydata().tolist() == [[pytest.approx(20.2), 9.0], [pytest.approx(20.2), 8.0]]
    second = slow_bars.get_segments()[1]
    mean = groups(TABLE, [DELAY, RATE], ["score"])[0].mean("score")
    assert mean is not None and second[:, 1].tolist() == pytest.approx([mean.low, mean.high])
    legend = score.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == [f"{RATE}=10Hz", f"{RATE}=50Hz"]


def test_values_that_are_no_quantities_stand_in_their_first_order() -> None:
    rows = [row(delay, "1Hz", 1, score, 0.0) for delay, score in (("none", 1.0), ("fast", 2.0), ("{a: 1}", 3.0))]
    figure = Figure()
    draw(figure, Table((DELAY, RATE), rows), DELAY, ["score"], "")
    (axes,) = figure.axes
    assert axes.get_xlabel() == DELAY
    assert [(tick, text.get_text()) for tick, text in zip(axes.get_xticks(), axes.get_xticklabels(), strict=True)] == [
        (0.0, "none"), (1.0, "fast"), (2.0, "{a: 1}")
    ]  # fmt: skip


def test_unknown_names_no_curve_and_too_many_are_refused() -> None:
    with pytest.raises(
        UnknownName, match=r"no such metric \(there are: loss, .*, score, ticks\), 'scor', nearest is 'score'"
    ):
        groups(TABLE, [DELAY], ["scor"])
    with pytest.raises(UnknownName, match=r"no such parameter .*, 'seed'"):
        draw(Figure(), TABLE, "seed", ["score"], "")
    failed = Table((DELAY, RATE), [one for one in TABLE.rows if one["message"]])
    with pytest.raises(BadValue, match="no run has a value of the metric, 'ticks'"):
        draw(Figure(), failed, DELAY, ["ticks"], "")
    many = Table((DELAY, RATE), [row("0ms", f"{rate}Hz", 1, 1.0, 1.0) for rate in range(11)])
    with pytest.raises(BadValue, match="more than 10 combinations"):
        draw(Figure(), many, DELAY, ["score"], "")
