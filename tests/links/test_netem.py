"""The same settings through the kernel's netem and through a link (T27), where the kernel has it and lets us.

netem's jitter without a distribution is uniform on both sides of the delay; its correlation is left at 0, because it
destroys the law (Salsano et al. 2009).
"""

from __future__ import annotations

import json
import subprocess
import sys
from functools import cache
from math import sqrt
from pathlib import Path
from typing import Final

import pytest
from scipy import stats

from tests.links.offered import MS, every, fabric_of, fates
from tests.links.proof import Proof

PROBE: Final = Path(__file__).with_name("netem_probe.py")
NETEM: Final = "delay 20ms 5ms loss 10%"
LINK: Final = "delay: 15 ms, jitter: {shape: uniform, width: 10 ms}, loss: 10 %, order: free"
PERIOD_US: Final = 1500


def in_namespace(command: str) -> subprocess.CompletedProcess[str]:
    """Run a shell's command in a network of its own."""
    return subprocess.run(["unshare", "-n", "sh", "-c", command], capture_output=True, text=True, check=False)


@cache
def missing() -> str:
    """Return why there is no netem, or an empty text."""
    try:
        done = in_namespace(f"ip link set lo up && tc qdisc add dev lo root netem {NETEM}")
    except FileNotFoundError as error:
        return f"no {error.filename}"
    return "" if done.returncode == 0 else f"no netem here: {done.stderr.strip() or done.returncode}"


def test_netem_and_a_link_are_alike(proof: Proof) -> None:
    if missing():
        pytest.skip(missing())
    n = proof.size(2000, 20_000)
    setup = f"ip link set lo up && tc qdisc add dev lo root netem {NETEM} limit 10000"
    done = in_namespace(f"{setup} && exec {sys.executable} {PROBE} {n} {PERIOD_US}")
    assert done.returncode == 0, done.stderr
    kernel = [delay for delay in json.loads(done.stdout) if delay is not None]
    flights = list(fates(fabric_of(LINK, proof.seed), every(PERIOD_US * 1000, n)))
    ours = [f.due_ns - f.sent_ns for f in flights if not f.cause]
    proof.likely("T27", "delay, netem's and ours: two-sample Kolmogorov", float(stats.ks_2samp(kernel, ours).pvalue), n)
    pooled = (len(kernel) + len(ours)) / (2 * n)
    z = (len(kernel) - len(ours)) / sqrt(2 * n * pooled * (1 - pooled))
    proof.normal("T27", "loss, netem's and ours: two proportions", z, n)


def test_the_probe_counts_what_comes() -> None:
    """Without netem all packets come, within milliseconds: what the comparison is made with works."""
    try:
        done = in_namespace(f"ip link set lo up && exec {sys.executable} {PROBE} 50 200")
    except FileNotFoundError as error:
        pytest.skip(f"no {error.filename}")
    if done.returncode:
        pytest.skip(f"no network of one's own here: {done.stderr.strip()}")
    delays = json.loads(done.stdout)
    assert len(delays) == 50 and all(0 < delay < 1000 * MS for delay in delays)
