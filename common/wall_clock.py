"""Wall time for messages and names: the one place that reads it.

It is used in logs, file names and run files, and compared with the dates of certificates. No decision of a run depends
on it, since wall clocks jump: deadlines and lags use the monotonic clock of a shell.
"""

from __future__ import annotations

import time
from datetime import UTC, datetime


def now_text() -> str:
    """Return the time in UTC as `2026-03-01T12:00:00.123456Z`; such texts sort as the times do."""
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ")  # noqa: TID251


def now_utc() -> datetime:
    """Return the time in UTC, for the dates of certificates."""
    return datetime.now(UTC)  # noqa: TID251


def now_stamp() -> str:
    """Return the local time for names of files: `20260301-130000`."""
    return datetime.now(UTC).astimezone().strftime("%Y%m%d-%H%M%S")  # noqa: TID251


def now_unix_ns() -> int:
    """Return the time in ns since 1970, as captures and viewers note it."""
    return time.time_ns()  # noqa: TID251
