"""How many answers a supervisor keeps for requests that come again, also one that has taken over."""

from foosim.protocol.messages import Answer
from foosim.supervisor.issued import Issued
from foosim.supervisor.requests import ANSWERS_KEPT
from tests.supervisor.test_requests import Run


def test_after_a_take_over_no_more_answers_are_kept_than_before() -> None:
    requests = Run().system.supervisor.requests
    answers = {("one", f"r{n}"): Answer("one", f"r{n}", True, n, "", b"") for n in range(ANSWERS_KEPT + 50)}
    requests.resume({}, answers, Issued(), 0)
    kept = requests.journalled()[1]
    assert kept == list(answers.values())[-ANSWERS_KEPT:]
