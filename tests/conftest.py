"""What all tests share: how hypothesis chooses its examples, and which tests stay on one pytest worker.

Examples are the same in every run, so that a failure is a failure of the code and not of the day; what hypothesis
measures in wall time is off, because the machines that run the tests are shared. To search new ground:
`make test ARGS='--hypothesis-profile=search tests/laws'`; what it finds becomes an `@example`.
"""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

TESTS = Path(__file__).parent

settings.register_profile(
    "foosim", derandomize=True, deadline=None, print_blob=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("search", settings.get_profile("foosim"), derandomize=False, max_examples=2000)
settings.load_profile("foosim")


def pytest_report_header() -> str:
    """The settings under which hypothesis runs, in the first lines of the output."""
    current = settings()
    return f"hypothesis: derandomize={current.derandomize}, deadline={current.deadline}"


@pytest.hookimpl(tryfirst=True)  # before xdist reads the marks
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep tests/wire on one worker: its runs of six processes each would starve one another of two cores."""
    for item in items:
        if item.path.relative_to(TESTS).parts[0] == "wire":
            item.add_marker(pytest.mark.xdist_group("wire"))
