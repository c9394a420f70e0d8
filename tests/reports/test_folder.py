"""A run's files replace another's as a whole, killed at any step, and no one's file is lost."""

from __future__ import annotations

import os
import random
import shutil
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from pipeline.errors import OutputError
from reports.folder import MANIFEST, PENDING, holding, read_manifest, settled, staged

OLD = {f"old_{k}.csv": f"old {k}" for k in range(3)} | {"both.csv": "old", "sub/both.txt": "old"}
NEW = {f"new_{k}.csv": f"new {k}" for k in range(3)} | {"both.csv": "new", "deep/er/a.txt": "new"}
#: A person's: a note, a folder of another run, a table changed by hand, a file in the way of one.
OWN = {
    "notes.txt": "mine",
    "gap/report.md": "another run's",
    "old_1.csv": "old 1, corrected by hand",
    "new_1.csv": "mine before any run",
}
#: Where these are after a run.
AFTER = {
    "notes.txt": "mine",
    "gap/report.md": "another run's",
    "old_1.csv.kept": "old 1, corrected by hand",
    "new_1.csv.kept": "mine before any run",
}
#: Calls that change a folder.
STEPS = ("rename", "replace", "rmdir", "unlink", "mkdir")


def write(folder: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")


def run(out: Path, files: dict[str, str], verb: str = "walk", **more: object) -> None:
    with staged(out, verb, **more) as folder:  # type: ignore[arg-type]
        write(folder, files)


def files(folder: Path, *, hidden: bool = False) -> dict[str, str]:
    """Every file by its name in the folder."""
    return {
        path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8")
        for path in folder.rglob("*")
        if path.is_file() and (hidden or not path.relative_to(folder).parts[0].startswith("."))
    }


def hidden(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir() if path.name.startswith(".")}


@pytest.fixture
def used(tmp_path: Path) -> Path:
    """A folder in which a run wrote and a person worked."""
    out = tmp_path / "out"
    run(out, OLD, "reports")
    write(out, OWN)
    return out


def in_child(action: Callable[[], None]) -> int:
    """Do it in a forked process; its exit code, negative for a signal."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            action()
            code = 0
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


@contextmanager
def failing_at(number: int, fail: Callable[[], None], *, decided: bool = False) -> Iterator[None]:
    """Let a step that changes a folder fail, counted from the first or from the decision."""
    real = {name: getattr(os, name) for name in STEPS}
    done: list[str] = []

    def counted(name: str) -> Callable[..., None]:
        def step(*arguments: object, **more: object) -> None:
            if done or not decided or str(arguments[-1]).endswith(PENDING):
                done.append(name)
            if len(done) == number:
                fail()
            real[name](*arguments, **more)

        return step

    try:
        for name in STEPS:
            setattr(os, name, counted(name))
        yield
    finally:
        for name in STEPS:
            setattr(os, name, real[name])


def kill() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def killed_run(out: Path, number: int, *, decided: bool = False) -> int:
    def action() -> None:
        with failing_at(number, kill, decided=decided):
            run(out, NEW)

    return in_child(action)


def check_killed(out: Path, number: int) -> bool:
    """Kill a run at a step; whether there was such a step."""
    code = killed_run(out, number)
    left = files(out)
    assert set(OWN.values()) <= set(left.values()), f"step {number}: a person's file is lost"
    of_runs = {(n, t) for n, t in left.items() if t not in OWN.values()}
    assert of_runs <= set(OLD.items()) or of_runs <= set(NEW.items()), f"step {number}: a mixture"
    with holding(out):
        pass
    assert files(out) in ({**OLD, **OWN}, {**NEW, **AFTER}), number
    assert hidden(out) == {MANIFEST}, number
    return code == -signal.SIGKILL


def test_a_run_replaces_what_the_last_run_left_and_nothing_else(
    used: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(used, NEW)
    assert files(used) == NEW | AFTER
    assert "held a run of 'reports'" in capsys.readouterr().out
    assert not (used / "sub").exists()
    assert hidden(used) == {MANIFEST}
    assert read_manifest(used).verb == "walk"
    assert set(read_manifest(used).files) == set(NEW)
    run(used, {"last.csv": "last"})
    assert files(used) == {"last.csv": "last"} | AFTER
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("kills", [5, pytest.param(40, marks=pytest.mark.slow)])
def test_a_run_killed_at_random_steps_leaves_files_of_one_run(
    used: Path, tmp_path: Path, kills: int
) -> None:
    steps = 1
    while killed_run(shutil.copytree(used, tmp_path / f"count_{steps}"), steps) < 0:
        steps += 1
    assert steps > 20
    draw = random.Random(kills)
    for k in range(kills):
        out = shutil.copytree(used, tmp_path / f"trial_{k}")
        assert check_killed(out, draw.randrange(1, steps))
        run(out, {"next.csv": "1"})
        assert files(out).items() >= {"next.csv": "1", "notes.txt": "mine"}.items()


def test_killed_again_while_it_is_mended(used: Path) -> None:
    """Any number of kills, each a few steps further, ends in the new set."""

    def mend() -> None:
        with failing_at(5, kill), holding(used):
            pass

    assert killed_run(used, 3, decided=True) == -signal.SIGKILL
    assert (used / PENDING).is_dir()
    kills = 0
    while in_child(mend):
        kills += 1
        assert kills < 30
    assert kills > 1
    assert files(used) == NEW | AFTER


def test_whoever_reads_a_folder_mends_it_first(used: Path) -> None:
    assert killed_run(used, 8, decided=True) == -signal.SIGKILL
    settled(used)
    assert files(used) == NEW | AFTER


def test_a_system_that_refuses_a_step_leaves_files_of_one_run_and_the_next_start_mends(
    used: Path, tmp_path: Path
) -> None:
    def refuse() -> None:
        raise OSError(28, "No space left on device")

    refused = 0
    for number in range(1, 15):
        trial = shutil.copytree(used, tmp_path / f"trial_{number}")
        with failing_at(number, refuse, decided=True):
            says = ""
            try:
                run(trial, NEW)
            except OutputError as error:
                says = str(error)
        refused += says.endswith(
            "cannot be written (No space left on device); choose another folder"
        )
        assert not says or "No space left" in says
        left = {(n, t) for n, t in files(trial).items() if t not in OWN.values()}
        assert left <= set(OLD.items()) or left <= set(NEW.items())
        settled(trial)
        assert files(trial) in ({**OLD, **OWN}, {**NEW, **AFTER})
    assert refused > 8


@pytest.mark.parametrize("stop", [KeyboardInterrupt, RuntimeError, OutputError("no")])
def test_a_stop_while_files_are_gathered_leaves_everything_as_it_was(
    used: Path, stop: type[BaseException]
) -> None:
    before = files(used, hidden=True)

    def stopped() -> None:
        with staged(used, "walk") as folder:
            write(folder, NEW)
            raise stop

    with pytest.raises(stop if isinstance(stop, type) else type(stop)):
        stopped()
    assert files(used, hidden=True) == before


def test_an_interrupt_waits_for_the_end_of_a_replacement(used: Path, tmp_path: Path) -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    for number in range(2, 12):
        trial = shutil.copytree(used, tmp_path / f"trial_{number}")
        with failing_at(number, interrupt, decided=True), pytest.raises(KeyboardInterrupt):
            run(trial, NEW)
        assert files(trial) == NEW | AFTER


def test_a_file_that_the_run_reads_stays(used: Path) -> None:
    """`gap shrink --model out/model.toml --out out` keeps the model, and a later run knows it."""
    own = {"notes.txt": "mine", "gap/report.md": "another run's"}
    own |= {"old_1.csv.kept": OWN["old_1.csv"], "new_1.csv": OWN["new_1.csv"]}
    run(used, {"model.toml": "found", "found.csv": "1"}, "gap add")
    run(used, {"waterfall.png": "*"}, "gap shrink", inputs=[used / "model.toml"])
    assert files(used) == {"model.toml": "found", "waterfall.png": "*"} | own
    run(used, {"standing.csv": "2"}, "stand")
    assert files(used) == {"standing.csv": "2"} | own


def test_what_is_set_aside_gets_a_name_of_its_own_and_the_same_bytes_are_no_loss(
    tmp_path: Path,
) -> None:
    write(tmp_path, NEW)
    run(tmp_path, NEW)
    assert files(tmp_path) == NEW
    for text in ("one", "two"):
        write(tmp_path, {"both.csv": text})
        run(tmp_path, NEW)
    assert files(tmp_path) == NEW | {"both.csv.kept": "one", "both.csv.kept2": "two"}


def test_a_link_is_moved_and_not_written_through(tmp_path: Path) -> None:
    write(tmp_path, {"elsewhere/table.csv": "mine"})
    (tmp_path / "out").mkdir()
    os.mkfifo(tmp_path / "out" / "new_0.csv")  # reading it would wait for ever
    (tmp_path / "out" / "both.csv").symlink_to(tmp_path / "elsewhere" / "table.csv")
    run(tmp_path / "out", NEW)
    assert (tmp_path / "elsewhere" / "table.csv").read_text(encoding="utf-8") == "mine"
    assert (tmp_path / "out" / "both.csv.kept").is_symlink()
    assert (tmp_path / "out" / "new_0.csv.kept").is_fifo()
    assert (tmp_path / "out" / "both.csv").read_text(encoding="utf-8") == "new"


@pytest.mark.parametrize(
    ("name", "words"), [("both.csv/x", "both.csv: is a folder"), ("deep", "deep: is a file")]
)
def test_what_cannot_make_way_is_named(tmp_path: Path, name: str, words: str) -> None:
    write(tmp_path / "out", {name: "mine"})
    with pytest.raises(OutputError, match=words) as caught:
        run(tmp_path / "out", NEW)
    assert "\n" not in str(caught.value)
    assert files(tmp_path / "out", hidden=True) == {name: "mine"}


@pytest.mark.parametrize(
    "text",
    ["", "{", '{"format": 9, "verb": "x", "files": {}}', '{"format": 1, "files": []}']
    + ['{"format": 1, "verb": "x", "files": {"../../precious.txt": "0"}}'],
)
def test_a_manifest_of_someone_else_is_refused(used: Path, text: str) -> None:
    (used / MANIFEST).write_text(text, encoding="utf-8")
    before = files(used)
    with pytest.raises(OutputError, match="damaged"):
        run(used, NEW)
    assert files(used) == before


def test_left_over_folders_go(used: Path) -> None:
    write(used, {".legwatt-abc/half.csv": "1"})
    run(used, NEW)
    assert files(used) == NEW | AFTER
    assert hidden(used) == {MANIFEST}


def test_one_run_at_a_time_and_the_lock_ends_with_its_process_not_its_workers(used: Path) -> None:
    ready, reported = os.pipe()

    def hold() -> None:
        with holding(used):
            worker = os.fork()
            os.write(reported, worker.to_bytes(4, "little"))
            signal.pause()

    child = os.fork()
    if child == 0:
        try:
            hold()
        finally:
            os._exit(1)
    worker = max(int.from_bytes(os.read(ready, 4), "little") for _ in range(2))
    before = files(used, hidden=True)
    with pytest.raises(OutputError, match="another run is writing here") as caught:
        run(used, NEW)
    assert "\n" not in str(caught.value)
    assert files(used, hidden=True) == before
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    try:
        run(used, NEW)
    finally:
        os.kill(worker, signal.SIGKILL)
    assert files(used) == NEW | AFTER


def test_a_run_without_result_leaves_no_folder(tmp_path: Path) -> None:
    with holding(tmp_path / "a" / "b"):
        assert (tmp_path / "a" / "b").is_dir()
    assert not list(tmp_path.iterdir())


def test_files_that_are_not_remembered_belong_to_the_user(tmp_path: Path) -> None:
    run(tmp_path, OLD, "stand", remembered=False)
    assert not (tmp_path / MANIFEST).exists()
    run(tmp_path, {"x.csv": "1"})
    assert files(tmp_path) == OLD | {"x.csv": "1"}
