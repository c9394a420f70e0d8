"""What results say of the files that they were made from."""

from pathlib import Path

from pipeline.api.result import own_names


def test_files_of_one_name_are_told_apart_by_their_folders() -> None:
    files = [Path(p) for p in ("/a/one/log.csv", "/a/two/log.csv", "/b/two/log.csv", "/a/r.toml")]
    assert own_names(files) == ["one/log.csv", "a/two/log.csv", "b/two/log.csv", "r.toml"]
    assert own_names([files[0], files[0]]) == ["log.csv", "log.csv"]
