"""Journals: what was appended is read again, up to where a file is torn; one writer; files turn and go."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from foosim.protocol.journal import SIGNATURE, Journal, JournalError, journal_files, read_journal, read_records

RECORDS = [b"", b"\x00", b"first", bytes(range(256)) * 2, b"\xff" * 7, b"last"]


def written(folder: Path, records: list[bytes]) -> Path:
    """The one file of a closed journal."""
    with Journal(folder, "hub") as journal:
        for record in records:
            journal.append(record)
    (path,) = journal_files(folder, "hub")
    return path


def test_records_are_read_as_they_were_written(tmp_path: Path) -> None:
    records = read_records(written(tmp_path, RECORDS))
    assert list(records) == RECORDS
    assert records.left_bytes == 0
    assert list(records) == []


def test_a_record_is_in_the_file_when_append_returns(tmp_path: Path) -> None:
    with Journal(tmp_path, "hub") as journal:
        for count, record in enumerate(RECORDS, 1):
            journal.append(record)
            assert list(read_records(journal.path)) == RECORDS[:count]
        assert journal.statistics().records == len(RECORDS)
        assert journal.statistics().bytes == journal.path.stat().st_size


def test_a_killed_process_loses_nothing(tmp_path: Path) -> None:
    program = """if True:
        import os, pathlib, signal, sys
        from foosim.protocol.journal import Journal
        journal = Journal(pathlib.Path(sys.argv[1]), "hub")
        for number in range(1000):
            journal.append(b"%d" % number)
        os.kill(os.getpid(), signal.SIGKILL)
    """
    done = subprocess.run([sys.executable, "-c", program, str(tmp_path)], check=False)
    assert done.returncode == -9
    assert list(read_journal(tmp_path, "hub")) == [b"%d" % number for number in range(1000)]
    with Journal(tmp_path, "hub") as journal:
        assert journal.path == tmp_path / "hub-000002.journal"


def test_a_file_torn_at_any_byte_gives_the_records_before(tmp_path: Path) -> None:
    path = written(tmp_path, RECORDS)
    content = path.read_bytes()
    ends = [len(SIGNATURE)]
    for record in RECORDS:
        ends.append(ends[-1] + 8 + len(record))
    assert ends[-1] == len(content)
    for size in range(len(content)):
        path.write_bytes(content[:size])
        records = read_records(path)
        whole = sum(end <= size for end in ends) - 1
        assert list(records) == RECORDS[: max(0, whole)], size
        assert records.left_bytes == size - (ends[whole] if whole >= 0 else 0), size


@pytest.mark.parametrize("place", [-1, -4, -5, -8, -12, -13])
def test_a_corrupt_record_ends_the_file(tmp_path: Path, place: int) -> None:
    """In its payload, its checksum or its length, of the last record (12 bytes) or the one before."""
    path = written(tmp_path, RECORDS)
    content = bytearray(path.read_bytes())
    content[place] ^= 0x10
    path.write_bytes(content)
    records = read_records(path)
    assert list(records) == (RECORDS[:-1] if place >= -12 else RECORDS[:-2])
    assert records.left_bytes == (12 if place >= -12 else 27)


def test_zeros_behind_the_records_are_none(tmp_path: Path) -> None:
    """Some file systems leave zeros where a dead machine had not written yet."""
    path = written(tmp_path, RECORDS)
    with path.open("ab") as file:
        file.write(bytes(4096))
    records = read_records(path)
    assert list(records) == RECORDS
    assert records.left_bytes == 4096


def test_a_length_beyond_the_file_is_not_believed(tmp_path: Path) -> None:
    path = written(tmp_path, [b"first"])
    with path.open("ab") as file:
        file.write(b"\xff\xff\xff\xff" + bytes(40))
    assert list(read_records(path)) == [b"first"]


def test_what_is_no_journal_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "hub-000001.journal"
    with pytest.raises(JournalError, match=r"hub-000001\.journal: cannot be read, No such file"):
        read_records(path)
    path.write_bytes(b"foosim journal 2\n")
    with pytest.raises(JournalError, match="no journal of this version, its first bytes are b'foosim journal 2"):
        read_records(path)
    path.write_bytes(b"")
    assert list(read_records(path)) == []


def test_a_second_writer_is_kept_out_until_the_first_is_gone(tmp_path: Path) -> None:
    first = Journal(tmp_path, "hub")
    with pytest.raises(JournalError, match=rf"written by another process \(pid {os.getpid()}\)"):
        Journal(tmp_path, "hub")
    with Journal(tmp_path, "supervisor"):
        first.append(b"one")
    first.close()
    first.close()
    with Journal(tmp_path, "hub") as second:
        second.append(b"two")
    assert list(read_journal(tmp_path, "hub")) == [b"one", b"two"]


def test_a_full_file_is_followed_by_one_that_starts_with_the_head(tmp_path: Path) -> None:
    with Journal(tmp_path, "hub", bytes_max=200) as journal:
        for tick in range(100):
            journal.append(b"tick %02d" % tick)
            journal.rotate_if_full(partial(bytes.__mod__, b"head after %02d", tick), tick)
        assert journal.statistics().files == len(journal_files(tmp_path, "hub")) == 9
    starts = [next(read_records(path)) for path in journal_files(tmp_path, "hub")]
    assert starts[0] == b"tick 00"
    assert starts[1:] == sorted(starts[1:]) and all(start.startswith(b"head after") for start in starts[1:])
    ticks = [record for record in read_journal(tmp_path, "hub") if record.startswith(b"tick")]
    assert ticks == [b"tick %02d" % tick for tick in range(100)]
    for path, start in zip(journal_files(tmp_path, "hub")[1:], starts[1:], strict=True):
        following = list(read_records(path))[1:2]
        assert following in ([b"tick %02d" % (int(start[-2:]) + 1)], [])


def test_files_go_once_nobody_needs_them(tmp_path: Path) -> None:
    """Those before an earlier opening go with the first that is known to be done with."""
    written(tmp_path, [b"of an earlier process"])
    with Journal(tmp_path, "hub", bytes_max=200) as journal:
        for tick in range(60):
            journal.append(b"tick %02d" % tick)
            journal.rotate_if_full(lambda: b"head", tick)
        files = journal_files(tmp_path, "hub")
        journal.forget_before(5)
        assert journal_files(tmp_path, "hub") == files
        journal.forget_before(30)
        left = journal_files(tmp_path, "hub")
        assert 0 < len(left) < len(files) and left == files[-len(left) :]
        assert b"tick 30" in list(read_journal(tmp_path, "hub"))
        journal.forget_before(10**9)
        assert journal_files(tmp_path, "hub") == [journal.path]
        journal.append(b"more")
        assert list(read_records(journal.path))[-1] == b"more"


def test_the_disk_is_told_each_interval_and_at_the_end(tmp_path: Path) -> None:
    journal = Journal(tmp_path, "hub", sync_every_s=0.001)
    journal.append(b"one")
    while journal.statistics().syncs == 0:
        pass
    journal.close()
    assert list(read_journal(tmp_path, "hub")) == [b"one"]


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(JournalError, match=r"file/hub\.lock: cannot be opened"):
        Journal(tmp_path / "file", "hub")


def test_a_full_disk_ends_the_journal_between_two_records(tmp_path: Path) -> None:
    """The limit of a process's file size stands in for a full disk: a write goes in part, the next one fails."""
    program = """if True:
        import pathlib, resource, sys
        from foosim.protocol.journal import Journal, JournalError
        journal = Journal(pathlib.Path(sys.argv[1]), "hub")
        journal.append(b"whole")
        resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
        for record in (bytes(200), b"small"):
            try:
                journal.append(record)
            except JournalError as error:
                print(error)
    """
    done = subprocess.run([sys.executable, "-c", program, str(tmp_path)], check=True, capture_output=True, text=True)
    lines = done.stdout.splitlines()
    assert len(lines) == 2 and lines[0] == lines[1]
    assert lines[0].endswith("hub-000001.journal: cannot be written, File too large")
    records = read_records(tmp_path / "hub-000001.journal")
    assert list(records) == [b"whole"]
    assert records.left_bytes == 0
