"""Damaged CAN logs: every whole record is kept, what is lost is said, nothing raises."""

import random
import re

import pytest
from can_samples import (
    READER,
    SAMPLES,
    START_S,
    VOYAGE,
    candump,
    candump_line,
    expected,
    frame,
    identity,
    transport,
    voyage,
    written,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from reader_checks import check_log, log_of

from ingest.canbus import READERS


def test_glued_lines_come_apart():
    lines = [candump_line(m) for m in VOYAGE]
    text = b"".join(line[:-1] if i % 5 == 0 else line for i, line in enumerate(lines))
    assert identity(transport("candump", text)) == expected(VOYAGE)
    assert log_of(READER["candump"], text).bytes_damaged == 0


@pytest.mark.parametrize("junk", [b"# a remark", b"\x00\xff", b"!!", b" what?"])
def test_junk_right_after_a_record_costs_nothing(junk):
    lines = [candump_line(m) for m in VOYAGE]
    text = b"".join(line.rstrip() + junk + b"\n" if i % 7 == 3 else line for i, line in enumerate(lines))
    assert identity(transport("candump", text)) == expected(VOYAGE)


def test_a_line_cut_and_glued_costs_itself_only():
    lines = [candump_line(m) for m in VOYAGE]
    for cut in range(1, len(lines[50])):
        text = b"".join([*lines[:50], lines[50][:cut], *lines[51:]])
        log = log_of(READER["candump"], text)
        intact = 402 if cut == len(lines[50]) - 1 else 401
        assert len(identity(transport("candump", text))) == intact, lines[50][:cut]
        found = [f for f in log.findings if f.kind in ("damaged", "truncated")]
        if intact == 401:
            assert [(f.offset, f.length) for f in found] == [(len(b"".join(lines[:50])), cut)]


def test_truncation_at_every_byte_keeps_every_whole_line():
    text = SAMPLES["candump"][:3000]
    for cut in range(len(text)):
        whole = text[:cut].count(b"\n")
        more = cut < len(text) and text[cut : cut + 1] == b"\n"
        assert len(transport("candump", text[:cut])) == whole + more, text[:cut][-60:]


@pytest.mark.parametrize("name", ["candump", "asc", "trc", "can-csv", "ydraw", "actisense"])
def test_junk_between_lines_costs_nothing(name):
    rng = random.Random(name)
    lines = SAMPLES[name].splitlines(keepends=True)
    whole = log_of(READER[name], SAMPLES[name])
    for _ in range(20):
        at = rng.randrange(30, len(lines))
        junk = bytes(rng.choice(b"\x00\x01\xfe~<>|{}xyz") for _ in range(rng.randrange(1, 40))) + b"\n"
        text = b"".join([*lines[:at], junk, *lines[at:]])
        log = log_of(READER[name], text)
        assert log.messages == whole.messages
        offset = sum(map(len, lines[:at]))
        found = [f for f in log.findings if f.kind in ("damaged", "truncated")]
        assert found and all(offset <= f.offset < offset + len(junk) for f in found)
        assert log.bytes_damaged == sum(f.length for f in found)


def test_damage_inside_lines_loses_only_those_lines():
    rng = random.Random(4)
    lines = [candump_line(m) for m in VOYAGE]
    spoilt = set(rng.sample(range(len(lines)), 40))
    for i in spoilt:
        at = rng.randrange(len(lines[i]) - 1)
        lines[i] = lines[i][:at] + b"\x80" + lines[i][at + 1 :]
    frames = transport("candump", b"".join(lines))
    assert identity(frames) == expected([m for i, m in enumerate(VOYAGE) if i not in spoilt])


def test_a_damaged_stamp_does_not_move_the_clock():
    messages = voyage(3)
    messages[70].timestamp += 4e8
    messages[100].timestamp -= 3e7
    log = log_of(READER["candump"], candump(messages))
    assert log.duration_s < 3.1
    assert [f.count for f in log.findings if f.kind == "clock" and "contradict" in f.message] == [2]


def test_a_restart_of_the_clock_is_continued_and_said():
    first, second = voyage(3), voyage(3, start=START_S - 1000)
    log = log_of(READER["candump"], candump(first + second))
    assert len(log.tables["rudder"]) == 60
    assert 5.7 < log.duration_s < 6.1
    assert any(f.kind == "clock" and "went back" in f.message for f in log.findings)


def test_half_a_blf_gives_its_half_and_says_so():
    data = written(voyage(300), ".blf")
    whole, half = transport("blf", data), transport("blf", data[: len(data) // 2])
    assert 0.3 * len(whole) < len(half) < 0.7 * len(whole)
    assert identity(half) == identity(whole)[: len(half)]
    log = log_of(READER["blf"], data[: len(data) // 2])
    assert any(f.kind == "truncated" for f in log.findings)


def test_a_spoilt_blf_container_costs_itself_only():
    data = bytearray(written(voyage(300), ".blf"))
    whole = transport("blf", bytes(data))
    at = data.index(b"LOBJ", data.index(b"LOBJ") + 4) + 4000
    data[at : at + 8] = b"\xaa" * 8
    frames = transport("blf", bytes(data))
    assert len(whole) - 3500 < len(frames) < len(whole)
    assert identity(frames)[-2000:] == identity(whole)[-2000:]


def test_what_follows_a_break_inside_a_blf_container_is_not_believed():
    """A wrong byte seldom stops zlib: all that follows reads as objects, of other senders and times."""
    data = written(voyage(300), ".blf")
    whole = identity(transport("blf", data))
    spans = [m.start() for m in re.finditer(b"LOBJ", data)]
    rng = random.Random(7)
    for k in range(40):
        broken, which = bytearray(data), rng.randrange(1, len(spans) - 1)
        broken[rng.randrange(spans[which] + 40, spans[which + 1] - 8)] ^= rng.choice([0x41, 1 << k % 8])
        log, frames = log_of(READER["blf"], bytes(broken)), transport("blf", bytes(broken))
        assert set(identity(frames)) <= set(whole)
        assert len(frames) > len(whole) - 3500
        assert [f.offset for f in log.findings if f.kind == "damaged"] == [spans[which]]


def test_a_pause_at_the_end_of_half_a_blf_is_none_of_its_damage():
    messages = [*voyage(20), *voyage(20, start=START_S + 100)]
    data = written(messages, ".blf")
    half = transport("blf", data[:-200])
    assert len(half) > 0.8 * len(messages)


@pytest.mark.parametrize("name", ["asc", "trc", "can-csv", "ydraw", "actisense"])
def test_pieces_of_a_file_make_the_same_log(name, monkeypatch):
    whole = log_of(READER[name], SAMPLES[name])
    monkeypatch.setattr("ingest.canbus.lines.CHUNK", 700)
    pieces = log_of(READER[name], SAMPLES[name])
    assert whole.findings == pieces.findings
    assert all(table.equals(pieces.tables[topic]) for topic, table in whole.tables.items())


@pytest.mark.parametrize(
    "filler", [b"7", b" ", b"(", b"(1.0) ", b"a", b"ff,", b"LOBJ", b"#", b"1 ", b"0123456789 "]
)
def test_a_filler_is_no_frame(filler):
    """Half a megabyte that looks like the beginning of a record at every place."""
    noise = (filler * (1 << 19))[: 1 << 19]
    for name in SAMPLES:
        if name != "actisense":
            assert len(transport(name, noise).time_ns) == 0


@given(st.lists(st.sampled_from(list(SAMPLES)), min_size=1, max_size=2), st.randoms())
@settings(max_examples=40, deadline=None)
def test_spliced_and_shuffled_logs_are_read(names, rng):
    text = b"".join(SAMPLES[n][rng.randrange(2000) : 2000 + rng.randrange(2000)] for n in names)
    for reader in READERS:
        if reader.name != "mf4":
            log = log_of(reader, text)
            if log is not None and log.tables:
                check_log(log, len(text))


@given(st.binary(max_size=400))
@settings(max_examples=60, deadline=None)
def test_nothing_makes_a_reader_raise(noise):
    for reader in READERS:
        if reader.name != "mf4":
            assert 0 <= reader.sniff(noise) <= 1
            log_of(reader, noise)


def test_a_frame_that_looks_like_a_blf_object():
    frames = [frame(START_S + 0.01 * k, 0x09F11201, b"LOBJ\x20\0\1\0") for k in range(5)]
    assert identity(transport("blf", written(frames, ".blf"))) == expected(frames)
