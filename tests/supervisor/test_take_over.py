"""What a supervisor that has taken over keeps of the one before: the last answers, and how far epochs have come."""

from foosim.protocol.codec import encode
from foosim.protocol.messages import Answer
from foosim.supervisor.records import ANSWERS_KEPT, fold
from tests.supervisor.test_requests import Run


def test_after_a_take_over_no_more_answers_are_kept_than_before() -> None:
    state = Run().system.supervisor.state
    history = fold(state.deployment, [encode(state.run_record)])
    answers = [Answer("one", f"r{n}", True, n, "", b"") for n in range(ANSWERS_KEPT + 50)]
    history.kept.answers.extend(answers)
    state.restore(history)
    assert list(state.answers.values()) == answers[-ANSWERS_KEPT:]


def test_after_a_take_over_epochs_are_above_those_of_the_journal() -> None:
    before, after = Run().system.supervisor.state, Run().system.supervisor.state
    for _ in range(3):
        before.begin_epoch(before.owners, before.deployment.nodes)
    after.restore(fold(before.deployment, [before.checkpoint()]))
    after.begin_epoch(after.owners, None)
    assert after.epoch == before.epoch + 1
