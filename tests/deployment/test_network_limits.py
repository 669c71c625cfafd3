"""Settings of a network that are each in their bounds and do not go together: refused, with the bound."""

from __future__ import annotations

from pathlib import Path

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment.loader import apply_sets, load_deployment

TEXT = (Path(__file__).parents[2] / "deploy" / "table.yaml").read_text()


@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        ("burst: {loss: 60 %, mean_burst: 1.4}", "so much loss comes in bursts of at least 1.5 packets, 1.4"),
        ("burst: {loss: 98 %, mean_burst: 2}", "so much loss comes in bursts of at least 49 packets, 2"),
        ("burst: {loss: 5 %, mean_burst: 2, bad_loss: 50 %}", "with this bad_loss bursts are shorter than 2 packets"),
        ("burst: {loss: 5 %, mean_bad: 1 s, dwell: {alpha: 2, max: 1 s}}", "dwell.max: not above mean_bad, '1 s'"),
        ("jitter: {shape: pareto, mean: 51 ms, max: 100 ms}", "jitter.mean: above half of max, 100 ms, '51 ms'"),
        ("jitter: {shape: pareto, mean: 6 s}", "jitter.mean: above half of max, 10 s, '6 s'"),
        ("markov4: {p13: 60 %, p31: 50 %, p14: 41 %}", "p14: more than 100 % with p13, '41 %'"),
        ("markov4: {p13: 6 %, p31: 80 %, p32: 21 %}", "p32: more than 100 % with p31, '21 %'"),
    ],
)
def test_settings_that_do_not_go_together(settings: str, problem: str) -> None:
    with pytest.raises(DeploymentError) as caught:
        load_deployment(apply_sets(TEXT, "t", [f"network.links=[{{id: l, between: ['*', '*'], {settings}}}]"]), "t")
    assert problem in str(caught.value)


@pytest.mark.parametrize(
    "settings",
    [
        "burst: {loss: 60 %, mean_burst: 1.5}",
        "burst: {loss: 98 %, mean_burst: 49}",
        "burst: {loss: 50 %, mean_burst: 1}",
        "burst: {loss: 5 %, mean_burst: 1.99, bad_loss: 50 %}",
        "burst: {loss: 5 %, mean_bad: 1 s, dwell: {alpha: 2, max: 2 s}}",
        "jitter: {shape: pareto, mean: 50 ms, max: 100 ms}",
        "markov4: {p13: 60 %, p31: 50 %, p14: 40 %}",
    ],
)
def test_those_at_the_bound_are(settings: str) -> None:
    load_deployment(apply_sets(TEXT, "t", [f"network.links=[{{id: l, between: ['*', '*'], {settings}}}]"]), "t")
