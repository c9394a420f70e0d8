"""TOML as editors leave it: with a byte-order mark, with CRLF; the rest is told in one line."""

from __future__ import annotations

import pytest

from actuators.text_file import UnreadableTextError, read_file, read_toml_file


@pytest.mark.parametrize("content", [b"\xef\xbb\xbfa = 1\r\n", b"a = 1\n", b"a = 1"])
def test_marks_and_line_ends_do_not_matter(tmp_path, content):
    path = tmp_path / "file.toml"
    path.write_bytes(content)
    assert read_toml_file(path) == {"a": 1}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("a = 1".encode("utf-16"), "is UTF-16 text; save it as UTF-8"),
        (b"a = 1\nb = '\xe9'", "line 2: byte 0xe9 is not UTF-8 text"),
        (b"a = 1\na = 2\n", "malformed TOML: .*line 2"),
        (b"a = " + b"[" * 10_000, "tables are nested too deeply"),
        (b"a = " + b"1" * 5_000, "a number has thousands of digits"),
    ],
)
def test_what_is_no_toml_is_told_with_its_line(tmp_path, content, message):
    path = tmp_path / "file.toml"
    path.write_bytes(content)
    with pytest.raises(UnreadableTextError, match=message) as caught:
        read_toml_file(path)
    assert "\n" not in str(caught.value)


def test_folders_devices_and_large_files_are_refused_unread(tmp_path):
    path = tmp_path / "large"
    path.write_bytes(b" " * 2000)
    with pytest.raises(UnreadableTextError, match="has 0.002 MB, expected at most 0.001 MB"):
        read_file(path, 1000)
    for place, fact in ((tmp_path, "is a folder"), ("/dev/null", "no regular file")):
        with pytest.raises(UnreadableTextError, match=fact):
            read_file(type(path)(place), 1000)
