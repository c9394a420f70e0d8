"""A run's files replace another's as a whole, killed at any step, and no one's file is lost."""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from actuators.errors import LegwattError
from reports.folder import (
    DECIDED,
    RECORD,
    holding,
    read_record,
    settled,
    sha256,
    staged,
)
from tests.command_line import Command, in_another_process, results

OLD = {f"old_{k}.csv": f"old {k}" for k in range(3)} | {"both.csv": "old", "sub/both.txt": "old"}
NEW = {f"new_{k}.csv": f"new {k}" for k in range(2)} | {"both.csv": "new", "deep/er/a.txt": "new"}
#: A person's: a note, a folder of another run, a table changed by hand.
OWN = {"notes.txt": "mine", "gap/report.md": "another run's", "old_1.csv": "old 1, corrected"}
#: A record that would let a run remove what no run wrote.
EDITED = '{"verb": "walk", "resources": [{"path": "../a", "hash": "sha256:0"}], "hash": "0"}'
#: Calls that change a folder.
STEPS = ("rename", "replace", "rmdir", "unlink", "mkdir")


def write(folder: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")


def run(out: Path, files: dict[str, str], verb: str = "walk", **more: object) -> None:
    with staged(out, verb, **more) as folder:  # type: ignore[arg-type]
        write(folder, files)


def files(folder: Path) -> dict[str, str]:
    """Every file that a person sees, but for the record."""
    found = (p for top in results(folder) for p in ([top] if top.is_file() else top.rglob("*")))
    return {p.relative_to(folder).as_posix(): p.read_text("utf-8") for p in found if p.is_file()}


def mended(out: Path) -> dict[str, str]:
    """The files after the next start, which leaves nothing hidden."""
    with holding(out):
        pass
    assert not list(out.glob(".*"))
    return files(out)


@pytest.fixture
def used(tmp_path: Path) -> Path:
    """A folder in which a run wrote and a person worked."""
    run(tmp_path / "out", OLD, "reports")
    write(tmp_path / "out", OWN)
    return tmp_path / "out"


def in_child(action: Callable[[], None]) -> int:
    """Do it in a forked process; its exit code, negative for a signal."""
    child = os.fork()
    if child == 0:
        try:
            action()
            os._exit(0)
        finally:
            os._exit(1)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


@contextmanager
def failing_at(number: int, fail: Callable[[], None]) -> Iterator[list[str]]:
    """Let one step that changes a folder fail, counted from 1; the list grows by every step."""
    real, done = {name: getattr(os, name) for name in STEPS}, list[str]()

    def counted(name: str) -> Callable[..., None]:
        def step(*arguments: object, **more: object) -> None:
            done.append(name)
            if len(done) == number:
                fail()
            real[name](*arguments, **more)

        return step

    with pytest.MonkeyPatch.context() as patch:
        for name in STEPS:
            patch.setattr(os, name, counted(name))
        yield done


def kill() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def full() -> None:
    raise OSError(28, "No space left on device")


def interrupt() -> None:
    raise KeyboardInterrupt


def test_a_run_replaces_what_the_last_run_left_and_nothing_else(
    used: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(used, NEW, decimal=",")
    assert mended(used) == NEW | OWN
    assert "held a run of 'reports'" in capsys.readouterr().out
    assert not (used / "sub").exists()
    package = json.loads((used / RECORD).read_text("utf-8"))
    assert (package["name"], package["verb"]) == ("legwatt-walk", "walk")
    assert package["resources"][0] == {
        **{"name": "both.csv", "path": "both.csv", "bytes": 3},
        "hash": f"sha256:{sha256(used / 'both.csv')}",
        "dialect": {"delimiter": ";", "decimalChar": ","},
    }
    run(used, {"last.csv": "last"})
    assert mended(used) == {"last.csv": "last"} | OWN


@pytest.mark.parametrize("fail", [kill, full, interrupt])
def test_stopped_at_any_step_the_next_start_finds_or_makes_a_whole_set(
    used: Path, tmp_path: Path, fail: Callable[[], None]
) -> None:
    out = shutil.copytree(used, tmp_path / "whole")
    with failing_at(0, fail) as done:
        run(out, NEW)
    assert len(done) > 20
    ends = []
    for number in range(1, len(done) + 1):
        out = shutil.copytree(used, tmp_path / str(number))

        def stopped(out: Path = out, number: int = number) -> None:
            with failing_at(number, fail):
                run(out, NEW)

        def killed_again(out: Path = out) -> None:
            with failing_at(6, kill), holding(out):
                pass

        assert (in_child(stopped) == -signal.SIGKILL) == (fail is kill)
        assert files(out).items() <= OLD.items() | NEW.items() | OWN.items()
        assert fail is not interrupt or not (out / DECIDED).exists()  # it waits for the end
        while number % 2 and in_child(killed_again):  # each mends a little more
            assert files(out).items() >= OWN.items()
        ends.append(mended(out))
        assert ends[-1] in ({**OLD, **OWN}, {**NEW, **OWN}), number
    assert 5 < ends.count({**NEW, **OWN}) < len(ends) - 5


@pytest.mark.parametrize("stop", [KeyboardInterrupt, RuntimeError, LegwattError])
def test_a_stop_while_files_are_gathered_leaves_everything_as_it_was(
    used: Path, stop: type[BaseException]
) -> None:
    before = (used / RECORD).read_bytes()

    def stopped(folder: Path) -> None:
        write(folder, NEW)
        raise stop

    with pytest.raises(stop), staged(used, "walk") as folder:
        stopped(folder)
    assert mended(used) == {**OLD, **OWN}
    assert (used / RECORD).read_bytes() == before
    with pytest.raises(stop), holding(used / "x" / "y"):
        raise stop
    assert not (used / "x").exists()


def test_a_changed_file_is_named_before_anything_is_computed(used: Path) -> None:
    edited = pytest.raises(LegwattError, match=r"old_1\.csv: is not as a run wrote it")
    with edited, holding(used, "reports"):
        raise AssertionError
    with holding(used, "walk"):  # which may not write it
        pass
    with pytest.raises(LegwattError, match=r"old_1\.csv: is not as a run wrote it") as caught:
        run(used, NEW | OLD)
    assert "\n" not in str(caught.value)
    assert mended(used) == {**OLD, **OWN}
    run(used, NEW | {"old_1.csv": OWN["old_1.csv"]})  # the same bytes are no loss
    assert mended(used) == {**NEW, **OWN}


@pytest.mark.parametrize(
    ("name", "make", "words"),
    [
        ("new_0.csv", lambda path: path.write_text("mine"), "new_0.csv: is not as a run"),
        ("new_0.csv", os.mkfifo, "new_0.csv: is not as a run"),  # reading it would wait for ever
        ("both.csv", lambda path: path.symlink_to("sub/both.txt"), "both.csv: is not as a run"),
        ("both.csv", os.mkdir, "both.csv: is a folder"),
        ("deep", lambda path: path.write_text("mine"), "deep: is not as a run wrote it"),
        ("deep", lambda path: path.symlink_to("gap"), "deep: is not as a run wrote it"),
        (RECORD, lambda path: path.write_text("{}"), "edited or damaged"),
        (RECORD, lambda path: path.write_text(EDITED), "edited or damaged"),
    ],
)
def test_what_is_in_the_way_is_named_and_nothing_is_moved(
    used: Path, name: str, make: Callable[[Path], object], words: str
) -> None:
    (used / name).unlink(missing_ok=True)
    make(used / name)
    before = sorted((p, p.lstat().st_mtime_ns) for p in used.rglob("*"))
    with pytest.raises(LegwattError, match=words) as caught:
        run(used, NEW)
    assert "\n" not in str(caught.value)
    assert sorted((p, p.lstat().st_mtime_ns) for p in used.rglob("*")) == before


def test_what_comes_into_the_way_of_a_killed_run_stops_the_next_start(used: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("reports.folder._finish", lambda out: None)
        run(used, NEW)  # as killed once it is decided
    (used / "new_0.csv").write_text("mine since", encoding="utf-8")
    with pytest.raises(LegwattError, match=r"new_0\.csv: is not as a run wrote it"):
        mended(used)
    assert files(used) == OLD | OWN | {"new_0.csv": "mine since"}
    (used / "new_0.csv").rename(used / "since.csv")
    assert mended(used) == NEW | OWN | {"since.csv": "mine since"}


def test_a_file_that_the_run_reads_stays_and_a_later_run_knows_it(tmp_path: Path) -> None:
    run(tmp_path, {"model.toml": "found", "found.csv": "1"}, "gap")
    run(tmp_path, {"waterfall.png": "*"}, "gap shrink", inputs=[tmp_path / "model.toml"])
    assert mended(tmp_path) == {"model.toml": "found", "waterfall.png": "*"}
    run(tmp_path, {"standing.csv": "2"}, "stand")
    assert mended(tmp_path) == {"standing.csv": "2"}


def test_one_run_at_a_time_and_the_lock_ends_with_its_process_not_its_workers(used: Path) -> None:
    ready, reported = os.pipe()
    if (child := os.fork()) == 0:
        with holding(used):
            os.write(reported, os.fork().to_bytes(4, "little"))
            signal.pause()
    worker = max(int.from_bytes(os.read(ready, 4), "little") for _ in range(2))
    with pytest.raises(LegwattError, match="another run is writing here"):
        run(used, NEW)
    assert files(used) == {**OLD, **OWN}
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    try:
        run(used, NEW)
    finally:
        os.kill(worker, signal.SIGKILL)
    assert mended(used) == {**NEW, **OWN}


def test_from_the_command_line(
    tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line and exit 2 for every folder that will not do, before anything is computed."""
    out, table = tmp_path / "out", tmp_path / "out" / "standing.csv"
    assert command("stand", out) == 0
    whole = files(out)
    assert set(read_record(out)[1]) == {*whole, RECORD}
    limit = (resource.RLIMIT_FSIZE, (30_000, 30_000))
    done = in_another_process(
        ["walk", "--out", str(out)], tmp_path, lambda: resource.setrlimit(*limit)
    )
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert f"{out}" in done.stderr
    assert "cannot be written (File too large)" in done.stderr
    assert command("stand", out, "--set", "femur_mass=-1") == 2
    assert mended(out) == whole
    capsys.readouterr()
    table.write_text("mine", encoding="utf-8")
    assert command("stand", out) == 2
    assert capsys.readouterr().err.startswith(f"{table}: is not as a run wrote it")
    for place in (table, table / "deeper", Path("/proc/legwatt")):
        assert command("stand", place) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1
        assert said.startswith(str(place))
        assert "choose another folder" in said
    (out / DECIDED).mkdir()
    assert command("walk", tmp_path / "new", "--model", str(out / "none.toml")) == 2
    assert not (out / DECIDED).exists()  # mended before a model is read
    settled(tmp_path / "nowhere")
