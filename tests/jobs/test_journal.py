"""The journal contains exactly the finished entries, even if its writer was killed."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from raycam.errors import JobError
from raycam.jobs import journal
from raycam.jobs.journal import Journal, JournalEntry
from support.raises import raises

ENTRIES = [
    JournalEntry(3, {"a/b.png": (5, "aa" * 32), "c.json": (0, "bb" * 32)}, seconds=0.25),
    JournalEntry(0, error="WorldError: “odd”\nsecond line"),
    JournalEntry(1, {}),
]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "journal.jsonl"
    with Journal(path) as book:
        for entry in ENTRIES:
            book.add(entry)
    return path


def entries(path: Path) -> list[JournalEntry]:
    return [entry for _, entry in journal.read(path) if entry is not None]


def test_entries_can_be_read_again_by_their_offset(path: Path) -> None:
    assert entries(path) == ENTRIES
    for place, entry in journal.read(path):
        assert journal.read_entry(path, place) == entry
    with raises(JobError, code="damaged_job"):
        journal.read_entry(path, 1)
    assert entries(path.with_name("none")) == []


def test_line_truncated_at_any_byte_loses_only_that_line(path: Path) -> None:
    data = path.read_bytes()
    ends = [0] + [index + 1 for index, byte in enumerate(data) if byte == ord("\n")]
    for size in range(len(data) + 1):
        path.write_bytes(data[:size])
        whole = sum(end <= size for end in ends) - 1
        assert entries(path) == ENTRIES[:whole]
        with Journal(path) as book:
            place = book.add(JournalEntry(9, {}))
        assert entries(path) == [*ENTRIES[:whole], JournalEntry(9, {})]
        assert place == ends[whole]


def damaged(path: Path) -> list[int]:
    return [place for place, entry in journal.read(path) if entry is None]


def test_invalid_journal_lines_are_ignored_and_blanked(path: Path) -> None:
    right = path.read_bytes()
    nonsense = b'\0\0\0\0\n[]\n{"frame": "x", "files": {}}\n{"frame": 4}\n{"frame": 4, "files": {"a": 3}}\n'
    path.write_bytes(nonsense + right + b'{"fra')
    assert entries(path) == ENTRIES
    places = damaged(path)
    assert places == [0, 5, 8, 36, 49]
    for left in range(len(places), 0, -1):
        assert len(damaged(path)) == left
        journal.erase_line(path, places[left - 1])
    journal.erase_line(path, len(nonsense))  # valid lines are kept
    assert damaged(path) == []
    assert entries(path) == ENTRIES
    assert path.read_bytes()[len(nonsense) :] == right + b'{"fra'
    with Journal(path) as book:
        book.add(JournalEntry(4, {}))
    assert entries(path) == [*ENTRIES, JournalEntry(4, {})]


def test_flipped_bit_invalidates_its_line_and_adds_no_entry(path: Path) -> None:
    data = path.read_bytes()
    for place in range(len(data)):
        path.write_bytes(data[:place] + bytes([data[place] ^ 1 << place % 8]) + data[place + 1 :])
        found = entries(path)
        # If the flipped bit belongs to a line break, two lines are joined and both entries are lost.
        assert len(found) in (1, 2)
        # If it belongs to the last line break, the last line is incomplete, which is not damage.
        assert len(damaged(path)) == (0 if place == len(data) - 1 else 1)
        assert all(entry in ENTRIES for entry in found)


def test_failed_write_leaves_the_journal_unchanged(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = path.read_bytes()

    def fail(*_: object) -> int:
        raise OSError(5, "Input/output error")

    real_write = os.write
    with Journal(path) as book:
        for name, broken in (("write", lambda file, data: real_write(file, data[:7])), ("fsync", fail)):
            with monkeypatch.context() as patch:
                patch.setattr(os, name, broken)
                with raises(OSError, code="file_unreadable", mentions=[path.name]):
                    book.add(JournalEntry(7, {}))
            assert path.read_bytes() == before
        book.add(JournalEntry(7, {}))
    assert entries(path) == [*ENTRIES, JournalEntry(7, {})]


def test_add_syncs_the_entry_before_it_returns(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced = []
    monkeypatch.setattr(os, "fsync", lambda file: synced.append(os.fstat(file).st_size))
    with Journal(path) as book:
        book.add(JournalEntry(8, {}))
    assert synced == [path.stat().st_size]
