"""The last answers of a server, so that a repeated request is answered and not performed again."""

from __future__ import annotations

from collections.abc import Iterable

from foosim.protocol.messages import Answer


class KeptAnswers(dict[tuple[str, str], Answer]):
    """Answers by sender and id of the request, the oldest first, at most `most`."""

    def __init__(self, most: int, answers: Iterable[Answer] = ()) -> None:
        super().__init__()
        self._most = most
        for answer in answers:
            self.keep(answer)

    def keep(self, answer: Answer) -> Answer:
        """Add an answer and return it; the oldest one is removed when there are too many."""
        self[answer.sender, answer.id] = answer
        if len(self) > self._most:
            self.pop(next(iter(self)))
        return answer
