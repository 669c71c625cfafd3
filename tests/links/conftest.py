"""The fixture of the statistical tests."""

from __future__ import annotations

import pytest

from tests.links.proof import Proof


@pytest.fixture
def proof(request: pytest.FixtureRequest) -> Proof:
    """The seed and the sizes of this run."""
    return Proof(request.config.getoption("--links-seed"), request.config.getoption("--links-full"))
