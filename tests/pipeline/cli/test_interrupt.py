"""One folder holds the files of one run: after another run, a failing one, a killed one, or two."""

from __future__ import annotations

import os
import random
import re
import resource
import shutil
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from pipeline.api import figures
from pipeline.cli.main import main
from pipeline.errors import FigureError
from reports.folder import MANIFEST, holding, read_manifest
from tests.command_line import Command, exit_code, in_another_process, results
from tests.demo import DEMO


def full(most: int) -> None:
    """No file may grow beyond so many bytes, as on a disk that is full: the system refuses."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))


CHANGE = ("--set", "hip_spacing=280")


def contents(folder: Path) -> dict[str, bytes]:
    """What a person sees: files by name, folders with what is in them."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for top in results(folder)
        for path in ([top] if top.is_file() else top.rglob("*"))
        if path.is_file()
    }


def settled(folder: Path) -> dict[str, bytes]:
    """The same after the next look at the folder; nothing hidden but the manifest is left."""
    with holding(folder):
        pass
    assert {p.name for p in folder.iterdir() if p.name.startswith(".")} <= {MANIFEST}
    return contents(folder)


def test_a_run_of_any_verb_replaces_the_last_one(tmp_path: Path, command: Command) -> None:
    """No comma copy beside tables of other numbers, no table of standing beside a walk's."""
    (tmp_path / "notes.txt").write_text("mine", encoding="utf-8")
    assert command("stand", tmp_path / "alone") == 0
    alone = contents(tmp_path / "alone")
    assert command("stand", tmp_path, "--decimal", "comma", *CHANGE) == 0
    assert any(name.endswith(".comma.csv") for name in contents(tmp_path))
    assert exit_code(["gap", "read", str(DEMO), "--out", str(tmp_path)]) == 0
    assert {p.name for p in results(tmp_path)} == {
        *("notes.txt", "alone", "quality.csv", "quality.meta.json")
    }
    assert command("stand", tmp_path) == 0
    left = {n: c for n, c in contents(tmp_path).items() if not n.startswith("alone/")}
    assert left == alone | {"notes.txt": b"mine"}
    assert contents(tmp_path / "alone") == alone


def test_the_manifest_names_what_the_run_wrote(out: Path, tmp_path: Path, command: Command) -> None:
    assert command("walk", tmp_path) == 0
    manifest = read_manifest(tmp_path)
    assert manifest.verb == "walk"
    assert set(manifest.files) == set(contents(tmp_path))
    assert set(manifest.files) < set(contents(out))


def killed_at_random(root: Path, folder: Path, verb: str, kills: int, seed: int) -> None:
    """Kill runs of a verb at random instants; the folder holds a whole set after every one."""
    command = [sys.executable, "-m", "pipeline", verb, "--out"]
    for name, more in (("old", ()), ("new", CHANGE)):
        begin = time.monotonic()
        run = [*command, str(folder / name), *more]
        subprocess.run(run, cwd=root, check=True, capture_output=True, timeout=300)
        takes = time.monotonic() - begin
    shutil.copytree(folder / "old", folder / "out")
    sets = {"old": contents(folder / "old"), "new": contents(folder / "new")}
    here, instants, seen = "old", random.Random(seed), []
    for kill in range(kills):
        other = "new" if here == "old" else "old"
        more = CHANGE if other == "new" else ()
        process = subprocess.Popen(
            [*command, str(folder / "out"), *more],
            cwd=root,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        # The end of a run, when it writes, is looked at more closely than its beginning.
        time.sleep(takes * instants.random() ** 0.3 * 1.05)
        process.kill()
        process.wait()
        left = contents(folder / "out").items()
        assert any(left <= one.items() for one in sets.values()), f"kill {kill}: a mixture"
        after = settled(folder / "out")
        assert after in sets.values(), f"kill {kill}: neither the old set nor the new one"
        here = next(name for name, one in sets.items() if one == after)
        seen.append(here)
    print(f"{verb}: after {kills} kills within {takes:.1f} s: {' '.join(seen)}")


@pytest.mark.slow
@pytest.mark.parametrize("verb", ["stand", "walk", "reports"])
def test_many_kills_at_random_instants_leave_whole_sets(
    root: Path, tmp_path: Path, verb: str
) -> None:
    killed_at_random(root, tmp_path, verb, 25, seed=2)


def test_bad_input_leaves_the_last_run_alone(
    tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command("stand", tmp_path) == 0
    before = contents(tmp_path)
    assert command("stand", tmp_path, "--set", "femur_mass=-1") == 2
    assert command("walk", tmp_path, "--set", "hip_spacing=200") == 1
    assert exit_code(["gap", str(tmp_path / "no.csv"), "--out", str(tmp_path)]) == 2
    assert contents(tmp_path) == before
    capsys.readouterr()
    assert command("stand", tmp_path / "new", "--set", "femur_mass=-1") == 2
    assert not (tmp_path / "new").exists()


def test_a_run_that_fails_in_its_figures_leaves_the_last_run_alone(
    tmp_path: Path,
    command: Command,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert command("stand", tmp_path) == 0
    before = contents(tmp_path)

    def failing(*arguments: object, **more: object) -> None:
        raise FigureError("a figure that cannot be drawn")

    monkeypatch.setattr(figures, "gait_figure", failing)  # the first
    assert command("reports", tmp_path) == 2
    assert capsys.readouterr().err == "a figure that cannot be drawn\n"
    assert settled(tmp_path) == before


def test_an_interrupt_leaves_the_last_run_alone(
    tmp_path: Path,
    command: Command,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Ctrl-C between two files: one line, exit 130."""
    assert command("stand", tmp_path) == 0
    before = contents(tmp_path)
    real = os.replace
    calls: list[object] = []

    def replace(source: object, target: object) -> None:
        calls.append(target)
        if len(calls) == 5:
            raise KeyboardInterrupt
        real(source, target)  # type: ignore[arg-type]

    monkeypatch.setattr(os, "replace", replace)
    assert command("walk", tmp_path) == 130
    assert capsys.readouterr().err.count("\n") == 1
    assert settled(tmp_path) == before


VERBS = {
    "stand": ["stand"],
    "walk": ["walk"],
    "reports": ["reports"],
    "gap": ["gap", "where", str(DEMO)],
}


@pytest.mark.parametrize("verb", ["walk", "gap"])
def test_a_full_disk(tmp_path: Path, short_demo: Path, command: Command, verb: str) -> None:
    """One line, exit 2, and the last run's files as they were."""
    place = tmp_path / "out"
    assert command("stand", place) == 0
    before = contents(place)
    words = [str(short_demo) if word == str(DEMO) else word for word in VERBS[verb]]
    arguments = [*words, "--out", str(place)]
    done = in_another_process(arguments, tmp_path, partial(full, 30_000))
    assert done.returncode == 2, done.stderr
    assert done.stderr.count("\n") == 1
    assert "cannot be written (File too large); choose another folder" in done.stderr
    assert f"{place}" in done.stderr
    assert "legwatt-" not in done.stderr
    assert settled(place) == before


@pytest.mark.parametrize("verb", VERBS)
def test_a_folder_that_may_not_be_written(
    tmp_path: Path,
    verb: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    tmp_path.chmod(0o500)
    if os.geteuid() == 0:  # who may write everywhere is told what others are told
        monkeypatch.setattr(os, "access", lambda path, mode: False)
    try:
        assert exit_code([*VERBS[verb], "--out", str(tmp_path)]) == 2
    finally:
        tmp_path.chmod(0o700)
    error = capsys.readouterr().err
    assert error == f"{tmp_path}: cannot be written (Permission denied); choose another folder\n"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("place", ["file", "file/deeper", "/proc/legwatt"])
def test_what_is_no_folder(
    tmp_path: Path, verb: str, place: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    assert exit_code([*VERBS[verb], "--out", str(tmp_path / place)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert error.startswith(str(tmp_path / place))
    assert "choose another folder" in error
    assert contents(tmp_path) == {"file": b"mine"}


@pytest.mark.parametrize(
    ("target", "given", "words"),
    [
        ("reports", {"OUT": "it's a dir"}, ["--out", "it's a dir"]),
        ("reports", {"ROBOT": "my robot.toml"}, ["--robot", "my robot.toml"]),
        ("gap", {"OUT": "a b"}, ["--out", "a b/gap"]),
        ("gap", {"LOG": "my log.csv"}, ["gap", "my log.csv", "--robot"]),
        ("gap", {"LOG": "one.csv two.csv"}, ["gap", "one.csv", "two.csv", "--robot"]),
        ("blind", {"OUT": "a b"}, ["--out", "a b/blind"]),
        ("check", {"ROBOT": "my robot.toml"}, ["check", "my robot.toml"]),
    ],
)
def test_make_takes_names_with_spaces(
    root: Path, tmp_path: Path, target: str, given: dict[str, str], words: list[str]
) -> None:
    """The command that make runs, word by word."""
    (tmp_path / "my log.csv").write_text("", encoding="utf-8")
    stamp = tmp_path / ".venv" / ".installed"
    stamp.parent.mkdir()
    stamp.touch()
    says = f"{sys.executable} -c 'import sys; print(*sys.argv, sep=chr(10))'"
    done = subprocess.run(
        ["make", "-f", str(root / "Makefile"), "-o", ".venv/.installed", target, f"PY={says}"]
        + [f"{name}={value}" for name, value in given.items()],
        cwd=tmp_path,
        check=True,
        capture_output=True,
        text=True,
        timeout=60,
    )
    said = "\n" + re.split(r"-m\n(?:pipeline|tests\.blind)\n", done.stdout, maxsplit=1)[1]
    assert "\n" + "\n".join(words) + "\n" in said


def test_check_and_urdf_verbs(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """0 sound, 1 a finding that fails, 2 unreadable; `urdf` writes what the robot file says."""
    for name in ("hexapod.toml", "hexapod_axis90.toml", "leg.toml"):
        (tmp_path / name).write_bytes((root / "urdf" / name).read_bytes())
        assert main(["urdf", str(tmp_path / name)]) == 0
        built = (tmp_path / name).with_suffix(".urdf")
        assert built.read_bytes() == (root / "urdf" / built.name).read_bytes()
        assert main(["check", str(built)]) == 0
    assert main(["check", "-v", str(tmp_path / "hexapod.toml")]) == 0
    assert "FAIL" not in capsys.readouterr().out
    tibia = r'(<link name="rm_tibia_link">.*?<mass value=")[^"]*"'
    light = re.sub(tibia, r'\1-0.5"', built.read_text(encoding="utf-8"), count=1, flags=re.S)
    built.write_text(light, encoding="utf-8")
    assert main(["check", str(built)]) == 1
    assert "FAIL rm_tibia_link: mass positive: -0.5 kg" in capsys.readouterr().out
    assert main(["check", str(tmp_path / "none.urdf")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
