"""A set of files replaces another as a whole, killed at any step, and no one's file is lost."""

from __future__ import annotations

import os
import shutil
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from reports.errors import OutputError
from reports.folder.exchange import EXCHANGE
from reports.folder.manifest import MANIFEST, read_manifest
from reports.folder.staging import holding, settled, staged

OLD = {f"old_{k}.csv": f"old {k}" for k in range(3)} | {"both.csv": "old", "sub/both.txt": "old"}
NEW = {f"new_{k}.csv": f"new {k}" for k in range(3)} | {"both.csv": "new", "deep/er/a.txt": "new"}
#: A person's: a note, a folder of another run, a table changed by hand, a file in the way of one.
OWN = {
    "notes.txt": "mine",
    "gap/report.md": "another run's",
    "old_1.csv": "old 1, corrected by hand",
    "new_1.csv": "mine before any run",
}
#: Where these are after an exchange.
AFTER = {
    "notes.txt": "mine",
    "gap/report.md": "another run's",
    "old_1.csv.kept": "old 1, corrected by hand",
    "new_1.csv.kept": "mine before any run",
}
STEPS = ("rename", "rmdir", "unlink", "mkdir")


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
    """Let a step of those that change a folder fail, counted from the first or the decision."""
    real = {name: getattr(os, name) for name in STEPS}
    done: list[str] = []

    def counted(name: str) -> Callable[..., None]:
        def step(*arguments: object, **more: object) -> None:
            if done or not decided or str(arguments[-1]).endswith(EXCHANGE):
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


def test_a_run_replaces_what_the_last_run_left_and_nothing_else(used: Path) -> None:
    run(used, NEW)
    assert files(used) == NEW | AFTER
    assert not (used / "sub").exists()
    assert {p.name for p in used.iterdir() if p.name.startswith(".")} == {MANIFEST}
    assert read_manifest(used).verb == "walk"
    assert set(read_manifest(used).files) == set(NEW)
    run(used, {"last.csv": "last"})
    assert files(used) == {"last.csv": "last"} | AFTER


def test_a_run_killed_at_any_step_leaves_files_of_one_run_and_the_next_look_a_whole_one(
    used: Path, tmp_path: Path
) -> None:
    def new_run(number: int) -> Callable[[], None]:
        def action() -> None:
            with failing_at(number, kill):
                run(tmp_path / "trial", NEW)

        return action

    whole = [files(used), NEW | AFTER]
    names = [set(OLD.items()) - {("old_1.csv", "old 1")}, set(NEW.items())]
    people = {text for text in OWN.values()}
    seen: set[int] = set()
    number, code = 0, -signal.SIGKILL
    while code == -signal.SIGKILL:
        number += 1
        shutil.rmtree(tmp_path / "trial", ignore_errors=True)
        shutil.copytree(used, tmp_path / "trial")
        code = in_child(new_run(number))
        left = files(tmp_path / "trial")
        assert people <= set(left.values()), number
        runs = set(left.items()) - {(n, t) for n, t in left.items() if t in people}
        assert runs <= names[0] or runs <= names[1], f"step {number}: files of two runs"
        with holding(tmp_path / "trial"):
            pass
        assert files(tmp_path / "trial") in whole, number
        seen.add(whole.index(files(tmp_path / "trial")))
        hidden = {p.name for p in (tmp_path / "trial").iterdir() if p.name.startswith(".")}
        assert hidden == {MANIFEST}, number
    assert code == 0
    assert number > 25
    assert seen == {0, 1}


def test_killed_again_while_it_is_settled(used: Path, tmp_path: Path) -> None:
    """Any number of kills, each a few steps further, ends in the new set."""

    def action() -> None:
        with failing_at(5, kill), holding(used):
            pass

    def first() -> None:
        with failing_at(3, kill, decided=True):
            run(used, NEW)

    assert in_child(first) == -signal.SIGKILL
    assert (used / EXCHANGE).is_dir()
    kills = 0
    while in_child(action):
        kills += 1
        assert kills < 30
    assert kills > 1
    assert files(used) == NEW | AFTER


def test_whoever_reads_a_folder_settles_it_first(used: Path) -> None:
    def action() -> None:
        with failing_at(8, kill, decided=True):
            run(used, NEW)

    assert in_child(action) == -signal.SIGKILL
    settled(used)
    assert files(used) == NEW | AFTER


def test_a_system_that_refuses_any_step_leaves_everything_as_it_was(
    used: Path, tmp_path: Path
) -> None:
    """Where it refuses to remove what is of no more use, the new set is in place already."""
    before = files(used, hidden=True)
    trial = tmp_path / "trial" / "out"
    refused = 0

    def refuse() -> None:
        raise OSError(28, "No space left on device")

    for number in range(1, 30):
        shutil.rmtree(trial, ignore_errors=True)
        shutil.copytree(used, trial)
        said = ""
        with failing_at(number, refuse, decided=True):
            try:
                run(trial, NEW)
            except OutputError as error:
                said = str(error)
        if said:
            refused += 1
            assert said.endswith(
                "cannot be written (No space left on device); choose another folder"
            )
            assert files(trial, hidden=True) == before, number
        else:
            assert files(trial) == NEW | AFTER, number
    assert refused > 12


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


@pytest.fixture
def interruptible() -> Iterator[None]:
    """A process started in the background ignores SIGINT; here it is to be heard."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_waits_for_the_end_of_an_exchange(used: Path) -> None:
    for number in range(2, 12):
        interrupt = failing_at(number, lambda: signal.raise_signal(signal.SIGINT), decided=True)
        with interrupt, pytest.raises(KeyboardInterrupt):
            run(used, NEW)
        assert files(used) == NEW | AFTER
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_file_that_the_run_reads_stays(used: Path) -> None:
    """`gap shrink --model out/model.toml --out out` keeps the model, and a later run knows it."""
    run(used, {"model.toml": "found", "found.csv": "1"}, "gap add")
    run(used, {"waterfall.png": "*"}, "gap shrink", inputs=[used / "model.toml"])
    assert files(used) == {"model.toml": "found", "waterfall.png": "*"} | files_of_people(used)
    run(used, {"standing.csv": "2"}, "stand")
    assert files(used) == {"standing.csv": "2"} | files_of_people(used)


def files_of_people(folder: Path) -> dict[str, str]:
    return {n: t for n, t in files(folder).items() if t in OWN.values()}


def test_a_file_of_the_same_bytes_is_no_ones_loss(tmp_path: Path) -> None:
    write(tmp_path, NEW)
    run(tmp_path, NEW)
    assert files(tmp_path) == NEW


def test_a_second_hand_made_change_gets_a_name_of_its_own(tmp_path: Path) -> None:
    for text in ("one", "two"):
        run(tmp_path, NEW)
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


@pytest.mark.parametrize(("name", "words"), [("both.csv", "is a folder"), ("deep", "is a file")])
def test_what_cannot_make_way_is_named(used: Path, name: str, words: str) -> None:
    before = files(used)
    if name == "deep":
        (used / "deep").write_text("mine", encoding="utf-8")
        before |= {"deep": "mine"}
    else:
        (used / name).unlink()
        (used / name).mkdir()
        del before[name]
    with pytest.raises(OutputError, match=words) as caught:
        run(used, NEW)
    assert str(used / name) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert files(used) == before


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


def test_a_damaged_exchange_is_refused(used: Path) -> None:
    (used / EXCHANGE).mkdir()
    with pytest.raises(OutputError, match="damaged"):
        run(used, NEW)


def test_left_over_folders_go(used: Path) -> None:
    write(used, {".legwatt-abc/new/half.csv": "1", ".legwatt-done/old/x": "1"})
    run(used, NEW)
    assert files(used) == NEW | AFTER
    assert {p.name for p in used.iterdir() if p.name.startswith(".")} == {MANIFEST}


def test_one_run_at_a_time_and_the_lock_ends_with_its_process(used: Path) -> None:
    ready, told = os.pipe()

    def hold() -> None:
        with holding(used):
            os.write(told, b"!")
            signal.pause()

    child = os.fork()
    if child == 0:
        try:
            hold()
        finally:
            os._exit(1)
    os.read(ready, 1)
    before = files(used, hidden=True)
    with pytest.raises(OutputError, match="another run is writing here") as caught:
        run(used, NEW)
    assert "\n" not in str(caught.value)
    assert files(used, hidden=True) == before
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    run(used, NEW)
    assert files(used) == NEW | AFTER


def test_a_forked_worker_does_not_keep_its_parents_lock(used: Path) -> None:
    ready, told = os.pipe()
    with holding(used):
        child = os.fork()
        if child == 0:
            os.write(told, b"!")
            signal.pause()
            os._exit(0)
        os.read(ready, 1)
    try:
        assert in_child(lambda: run(used, NEW)) == 0
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)


def test_a_run_without_result_leaves_no_folder(tmp_path: Path) -> None:
    with holding(tmp_path / "a" / "b"):
        assert (tmp_path / "a" / "b").is_dir()
    assert not list(tmp_path.iterdir())


def test_files_that_are_not_remembered_belong_to_the_user(tmp_path: Path) -> None:
    run(tmp_path, OLD, "twin", remembered=False)
    assert not (tmp_path / MANIFEST).exists()
    run(tmp_path, {"x.csv": "1"})
    assert files(tmp_path) == OLD | {"x.csv": "1"}
