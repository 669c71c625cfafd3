"""Intervals of 95 % against tables and worked examples."""

import pytest

from foosim.analysis.intervals import mean, rate, share, t_quantile


@pytest.mark.parametrize(
    ("freedom", "t"), [(1, 12.706), (2, 4.303), (3, 3.182), (4, 2.776), (5, 2.571), (19, 2.093), (39, 2.023)]
)
def test_quantiles_are_those_of_the_table(freedom: int, t: float) -> None:
    """Abramowitz and Stegun, table 26.10."""
    assert t_quantile(freedom) == pytest.approx(t, abs=6e-4)


def test_intervals_are_those_of_worked_examples() -> None:
    eight, three, none = share(8, 10), mean([1, 2, 3]), rate(0, 10.0)
    for found, value, low, high in (
        (eight, 0.8, 0.4902, 0.9433),
        (three, 2.0, 2.0 - 4.3027 / 3**0.5, 2.0 + 4.3027 / 3**0.5),
        (none, 0.0, 0.0, 0.3841),
    ):
        assert [found.value, found.low, found.high] == pytest.approx([value, low, high], abs=1e-3)
    assert (share(0, 5).low, share(5, 5).high) == (0.0, 1.0)
    assert (mean([4]).value, mean([4]).low) == (4, None)
