"""How many answers a supervisor keeps for requests that come again, also one that has taken over."""

from foosim.protocol.codec import encode
from foosim.protocol.messages import Answer
from foosim.supervisor.records import ANSWERS_KEPT, fold
from tests.supervisor.test_requests import Run


def test_after_a_take_over_no_more_answers_are_kept_than_before() -> None:
    state = Run().system.supervisor.state
    history = fold(state.deployment, [encode(state.run_record)])
    answers = [Answer("one", f"r{n}", True, n, "", b"") for n in range(ANSWERS_KEPT + 50)]
    for answer in answers:
        history.answers.keep(answer)
    state.restore(history)
    assert list(state.answers.values()) == answers[-ANSWERS_KEPT:]
