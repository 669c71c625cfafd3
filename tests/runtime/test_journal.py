"""Journals: what was appended is read again, up to where a file is torn; one writer; files turn and go."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from foosim.runtime import journal as journal_module
from foosim.runtime.journal import (
    FRAMING_BYTES,
    HEAD_BYTES,
    Journal,
    JournalDamaged,
    JournalError,
    Records,
    journal_files,
    read_journal,
    read_newest,
)

RECORDS = [b"", b"\x00", b"first", bytes(range(256)) * 2, b"\xff" * 7, b"last"]


def written(folder: Path, records: list[bytes]) -> Path:
    """The one file of a closed journal."""
    with Journal(folder, "hub") as journal:
        for record in records:
            journal.append(record)
    (path,) = journal_files(folder, "hub")
    return path


def flip(path: Path, place: int) -> None:
    content = bytearray(path.read_bytes())
    content[place] ^= 0x10
    path.write_bytes(content)


def places(path: Path) -> list[int]:
    """Where the records of a whole file start, and where the last one ends."""
    records = Records(path)
    return [records.valid_bytes, *(records.valid_bytes for _ in records)]


def started_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the machine be started once more: what was written and not synced may be lost, whatever it is."""
    monkeypatch.setattr(journal_module, "machine_start", lambda: "another start")


def test_records_are_read_as_they_were_written(tmp_path: Path) -> None:
    records = Records(written(tmp_path, RECORDS))
    assert list(records) == RECORDS
    assert records.left_bytes == 0
    assert list(records) == []


def test_a_record_is_in_the_file_when_append_returns(tmp_path: Path) -> None:
    with Journal(tmp_path, "hub") as journal:
        for count, record in enumerate(RECORDS, 1):
            journal.append(record)
            assert list(Records(journal.path)) == RECORDS[:count]


def test_a_killed_process_loses_nothing(tmp_path: Path) -> None:
    program = """if True:
        import os, pathlib, signal, sys
        from foosim.runtime.journal import Journal
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
    ends = [HEAD_BYTES]
    for record in RECORDS:
        ends.append(ends[-1] + FRAMING_BYTES + len(record))
    assert ends[-1] == len(content)
    for size in range(len(content)):
        path.write_bytes(content[:size])
        records = Records(path)
        whole = sum(end <= size for end in ends) - 1
        assert list(records) == RECORDS[: max(0, whole)], size
        assert records.left_bytes == size - (ends[whole] if whole >= 0 else 0), size


@pytest.mark.parametrize("place", range(-FRAMING_BYTES - 4, 0, 3))
def test_a_corrupt_last_record_ends_the_file(tmp_path: Path, place: int) -> None:
    """In its payload, its checksum, its length, its mark, its opening: nothing tells it from one that is torn."""
    path = written(tmp_path, RECORDS)
    flip(path, path.stat().st_size + place)
    records = Records(path)
    assert list(records) == RECORDS[:-1]
    assert records.left_bytes == FRAMING_BYTES + 4


def test_what_is_no_journal_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "hub-000001.journal"
    with pytest.raises(JournalError, match=r"hub-000001\.journal: cannot be read, No such file"):
        Records(path)
    path.write_bytes(b"foosim journal 1\n")
    with pytest.raises(JournalError, match="no journal of this version, its first bytes are b'foosim journal 1"):
        Records(path)
    path.write_bytes(b"")
    assert list(Records(path)) == []


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
        assert len(journal_files(tmp_path, "hub")) == 25
    starts = [next(Records(path)) for path in journal_files(tmp_path, "hub")]
    assert starts[0] == b"tick 00"
    assert starts[1:] == sorted(starts[1:]) and all(start.startswith(b"head after") for start in starts[1:])
    ticks = [record for record in read_journal(tmp_path, "hub") if record.startswith(b"tick")]
    assert ticks == [b"tick %02d" % tick for tick in range(100)]
    for path, start in zip(journal_files(tmp_path, "hub")[1:], starts[1:], strict=True):
        following = list(Records(path))[1:2]
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
        assert list(Records(journal.path))[-1] == b"more"


def test_the_disk_is_told_each_interval_and_at_the_end(tmp_path: Path) -> None:
    journal = Journal(tmp_path, "hub", sync_every_s=0.001)
    journal.append(b"one")
    while not journal._synced[1]:
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
        from foosim.runtime.journal import Journal, JournalError
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
    records = Records(tmp_path / "hub-000001.journal")
    assert list(records) == [b"whole"]
    assert records.left_bytes == 0


# --- damage, and what a machine leaves that loses its power -----------------------------------------------------------


def test_every_bad_bit_before_the_last_record_is_damage(tmp_path: Path) -> None:
    path = written(tmp_path, RECORDS)
    content, starts = path.read_bytes(), places(path)
    for place in range(17, starts[-2]):
        path.write_bytes(content)
        flip(path, place)
        with pytest.raises(JournalDamaged) as caught:
            list(Records(path))
        at = sum(start <= place for start in starts) - 1
        told = f"byte {starts[at]}: record {at + 1} is damaged, " if at >= 0 else "byte 17: the head of the file is"
        assert str(caught.value).startswith(f"{path}: {told}"), place
        if at >= 0:
            behind = len(RECORDS) - at - 1
            assert str(caught.value).endswith(f"{behind} whole record{'s' * (behind > 1)} after it")
            assert (caught.value.path, caught.value.byte, caught.value.records) == (path, starts[at], at)
        for read in (read_journal, read_newest):
            with pytest.raises(JournalDamaged):
                list(read(tmp_path, "hub"))


def test_a_hole_that_was_not_synced_is_an_end_on_a_machine_that_was_started_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pages come to the disk in any order: the machine kept later ones, and nothing says that it had this one."""
    with Journal(tmp_path, "hub", sync_every_s=1000) as journal:
        for number in range(100):
            journal.append(b"%04d" % number * 50)
    path, (start, stop) = journal.path, places(journal.path)[40:42]
    content = bytearray(path.read_bytes())
    for hole in (bytes(stop - start), content[start : stop - 5] + b"?" * 5):
        content[start:stop] = hole
        path.write_bytes(content)
        with pytest.raises(JournalDamaged, match="record 41 is damaged, 59 whole records after it"):
            list(Records(path))
        with monkeypatch.context() as patch:
            started_again(patch)
            assert len(list(Records(path))) == len(list(read_journal(tmp_path, "hub"))) == 40


def test_what_was_synced_before_a_later_record_is_damage_on_any_machine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Journal(tmp_path, "hub", sync_every_s=0.001) as journal:
        for number in range(20):
            journal.append(b"%04d" % number)
        synced = {journal._synced}
        while len(synced) < 3:
            journal.append(b"more")
            synced.add(journal._synced)
        journal.append(b"last")
    started_again(monkeypatch)
    content, starts = journal.path.read_bytes(), places(journal.path)
    for place in (starts[0] + 5, starts[7], starts[19] + 20):
        journal.path.write_bytes(content)
        flip(journal.path, place)
        with pytest.raises(JournalDamaged, match=r"record \d+ is damaged"):
            list(Records(journal.path))
    journal.path.write_bytes(content)
    flip(journal.path, starts[-2])
    assert len(list(Records(journal.path))) == len(starts) - 2


def test_the_end_of_a_full_file_is_judged_by_the_files_behind_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Journal(tmp_path, "hub", bytes_max=200, sync_every_s=1000) as journal:
        for tick in range(20):
            journal.append(b"tick %02d" % tick)
            journal.rotate_if_full(partial(bytes.__mod__, b"head after %02d", tick), tick)
    with Journal(tmp_path, "hub") as journal:
        journal.append(b"opened again")
    files, whole = journal_files(tmp_path, "hub"), list(read_journal(tmp_path, "hub"))
    first = list(Records(files[0]))
    content = files[0].read_bytes()
    torn = content[: places(files[0])[-2] + 5]
    for left, record in ((torn, len(first)), (b"", 1), (bytes(len(content)), 1)):
        files[0].write_bytes(left)
        if record > 1:  # else nothing tells which opening it was of
            with pytest.raises(JournalDamaged, match=rf"000001\.journal: byte \d+: record {record} is damaged, \d+ "):
                list(read_journal(tmp_path, "hub"))
            with monkeypatch.context() as patch:
                started_again(patch)
                assert list(read_journal(tmp_path, "hub")) == [*first[:-1], b"opened again"]
        else:
            assert list(read_journal(tmp_path, "hub")) == whole[len(first) :]
        assert list(read_newest(tmp_path, "hub")) == [b"opened again"]
    files[0].write_bytes(content)
    files[1].write_bytes(bytes(files[1].stat().st_size))
    with pytest.raises(JournalDamaged, match=r"000002\.journal: byte 0: record 1 is damaged, \d+ whole"):
        list(read_journal(tmp_path, "hub"))
    started_again(monkeypatch)
    assert list(read_journal(tmp_path, "hub")) == [*first, b"opened again"]


def test_a_record_of_another_place_or_another_journal_is_none(tmp_path: Path) -> None:
    """What a disk has left of files that are gone does not go on with a journal."""
    path, other = written(tmp_path / "one", RECORDS), written(tmp_path / "two", RECORDS)
    starts = places(path)
    content, foreign = path.read_bytes(), other.read_bytes()
    path.write_bytes(content[: starts[3]] + foreign[starts[3] :])
    assert list(Records(path)) == RECORDS[:3]
    path.write_bytes(content + content[starts[2] : starts[3]])
    assert list(Records(path)) == RECORDS


def test_a_file_that_did_not_come_to_the_disk_leaves_the_one_before(tmp_path: Path) -> None:
    written(tmp_path, RECORDS)
    for left in (b"", b"foosim jour", bytes(5000)):
        (tmp_path / "hub-000002.journal").write_bytes(left)
        assert list(read_journal(tmp_path, "hub")) == list(read_newest(tmp_path, "hub")) == RECORDS
