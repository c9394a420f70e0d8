"""Faults put into the code one at a time, each of which a test should notice: `make mutants`.

The faults are those of cosmic-ray's operators. They are run here and not by its own command, which
starts Python anew for each of them and edits the checkout: this works in a copy, forks a process
that has the libraries loaded, and runs only test files that reach the changed line. The rooms and
their tests stand in `mutants.toml`.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import importlib
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tqdm import tqdm

ROOT = Path(__file__).parents[1]
CONFIG = Path(__file__).with_suffix(".toml")
PROJECT = ("actuators", "pipeline", "reports", "tests")
#: Loaded once: what the tests load beside the project's own code.
LIBRARIES = (
    *("pytest", "numpy", "scipy.optimize", "scipy.signal", "scipy.stats", "scipy.interpolate"),
    *("hypothesis", "pandas", "pinocchio", "pyarrow.parquet", "tomlkit", "jinja2"),
)
#: Pytest's exit code where every test of a file is left out.
NOTHING_TO_RUN = 5
#: Of each kind the nearest wrong operator: a sum for a difference, a bound for its neighbour.
BINARY = {
    "Add": ("Sub",),
    "Sub": ("Add",),
    "Mul": ("Div",),
    "Div": ("Mul",),
    "FloorDiv": ("Mul",),
    "Mod": ("Mul",),
    "Pow": ("Mul",),
    "BitAnd": ("BitOr",),
}
COMPARISON = {
    "Eq": ("NotEq",),
    "NotEq": ("Eq",),
    "Lt": ("LtE", "GtE"),
    "LtE": ("Lt", "Gt"),
    "Gt": ("GtE", "LtE"),
    "GtE": ("Gt", "Lt"),
    "Is": ("IsNot",),
    "IsNot": ("Is",),
}
OTHERS = (
    *("ReplaceUnaryOperator_USub_UAdd", "ReplaceUnaryOperator_Delete_Not", "AddNot"),
    *("ReplaceUnaryOperator_Delete_Invert", "ReplaceTrueWithFalse", "ReplaceFalseWithTrue"),
    *("ReplaceAndWithOr", "ReplaceOrWithAnd", "ReplaceBreakWithContinue", "NumberReplacer"),
    *("ReplaceContinueWithBreak", "ZeroIterationForLoop"),
)
OPERATORS = (
    *(f"ReplaceBinaryOperator_{a}_{b}" for a, others in BINARY.items() for b in others),
    *(f"ReplaceComparisonOperator_{a}_{b}" for a, others in COMPARISON.items() for b in others),
    *OTHERS,
)
#: After this long a process waits for something that does not come [s].
HANGS = 3600.0
KILLED, SURVIVED, UNCOVERED, EQUIVALENT = "killed", "survived", "no coverage", "equivalent"


@dataclass(frozen=True)
class Mutant:
    """One fault.

    Attributes:
        path: Of the file, from the top folder.
        line: Where, from 1.
        was: The line as it is.
        now: The line with the fault.
        source: The whole file with the fault.
        tests: Files of tests that reach the line, the quick ones first.
    """

    path: str
    line: int
    was: str
    now: str
    source: str
    tests: tuple[str, ...]


@dataclass
class Tally:
    """Counts of one file.

    Attributes:
        made: All faults that can be put into it.
        verdicts: Verdict to count; of covered faults those that were run.
    """

    made: int = 0
    verdicts: dict[str, int] = field(default_factory=dict)

    def add(self, verdict: str, count: int = 1) -> None:
        self.verdicts[verdict] = self.verdicts.get(verdict, 0) + count

    def __getitem__(self, verdict: str) -> int:
        return self.verdicts.get(verdict, 0)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="tests.mutants", description=__doc__.splitlines()[0])
    parser.add_argument("--share", type=float, default=1.0, help="of covered faults that are run")
    parser.add_argument("--seed", type=int, default=0, help="of the choice of that share")
    parser.add_argument("files", nargs="*", help="only files whose path contains one of these")
    options = parser.parse_args(arguments)
    try:
        importlib.import_module("cosmic_ray.mutating")
        importlib.import_module("coverage")
    except ImportError as missing:
        print(f"{missing}: install the extra, pip install -e '.[mutants]'", file=sys.stderr)
        return 2
    config = tomllib.loads(CONFIG.read_text(encoding="utf-8"))
    for library in ("OMP", "OPENBLAS", "MKL"):
        os.environ[f"{library}_NUM_THREADS"] = "1"  # a forked process must not inherit threads
    os.environ["MPLBACKEND"] = "Agg"
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # as Ctrl-C: the copy goes
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        copy = Path(folder) / "copy"
        copy_checkout(copy)
        for name in LIBRARIES:
            importlib.import_module(name)
        tallies: dict[str, Tally] = {}
        for room in config["room"]:
            run_room(copy, room, config.get("equivalent", []), options, tallies)
    report(tallies, options)
    return 0


def copy_checkout(copy: Path) -> None:
    """The files that git knows or would take, as they are now."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        check=True,
        capture_output=True,
    ).stdout.decode()
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file():  # not what was deleted and is still listed
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, copy / name)


def run_room(
    copy: Path,
    room: Mapping[str, Any],
    equivalent: Sequence[Mapping[str, str]],
    options: argparse.Namespace,
    tallies: dict[str, Tally],
) -> None:
    """Run a room's mutants: adds to the tallies, prints survivors as they are found."""
    sources = [str(p.relative_to(copy)) for g in room["sources"] for p in sorted(copy.glob(g))]
    sources = [s for s in sources if not options.files or any(f in s for f in options.files)]
    tests = [str(p.relative_to(copy)) for g in room["tests"] for p in sorted(copy.glob(g))]
    if not tests:
        raise SystemExit(f"{CONFIG.name}: no file matches the tests of room '{room['name']}'")
    if not sources:
        return
    reached, seconds = baseline(copy, tests, sources)
    noticed: dict[str, Counter[str]] = {}
    chosen: list[Mutant] = []
    for path in sources:
        tally = tallies.setdefault(path, Tally())
        covered = []
        for mutant in mutants_of(copy, path, reached, seconds):
            tally.made += 1
            if any(is_named(mutant, known) for known in equivalent):
                tally.add(EQUIVALENT)
            elif mutant.tests:
                covered.append(mutant)
            else:
                tally.add(UNCOVERED)
        count = -int(-options.share * len(covered) // 1)
        picked = random.Random(f"{options.seed} {Path(path).name}").sample(covered, count)
        chosen += sorted(picked, key=lambda m: (m.line, m.now))
    for mutant in tqdm(chosen, desc=room["name"], disable=None, leave=False):
        verdict = verdict_on(copy, mutant, seconds, noticed.setdefault(mutant.path, Counter()))
        tallies[mutant.path].add(verdict)
        if verdict == SURVIVED:
            place = f"{mutant.path}:{mutant.line}"
            tqdm.write(f"survived: {place}\n  - {mutant.was}\n  + {mutant.now}", sys.stdout)
            sys.stdout.flush()


def is_named(mutant: Mutant, known: Mapping[str, str]) -> bool:
    """Whether a fault is one of those that `mutants.toml` names as changing nothing."""
    return (Path(mutant.path).name, mutant.was, mutant.now) == (
        known["file"],
        known["was"],
        known["now"],
    )


def baseline(
    copy: Path, tests: Sequence[str], sources: Sequence[str]
) -> tuple[dict[str, dict[str, set[int]]], dict[str, float]]:
    """Lines (source to numbers) that each file of tests reaches, and how long it takes [s].

    Each file runs in a process of its own, so that what its fixtures and imports reach counts, too.

    Raises:
        SystemExit: A test fails without any fault.
    """
    reached, seconds = {}, {}
    for test in tqdm(tests, desc="without a fault", disable=None, leave=False):
        out = copy.parent / "lines.json"

        def measured(test: str = test, out: Path = out) -> int:
            import coverage

            measure = coverage.Coverage(
                data_file=None, config_file=False, include=[str(copy / s) for s in sources]
            )
            measure.start()
            code = run_pytest([test])
            measure.stop()
            data = measure.get_data()
            lines = {s: data.lines(str((copy / s).resolve())) or [] for s in sources}
            out.write_text(json.dumps(lines), encoding="utf-8")
            return code

        code, log, seconds[test] = in_child(copy, measured)
        if code == NOTHING_TO_RUN:  # all of them are slow
            continue
        if code != 0:
            raise SystemExit(f"{log}\n{test} fails without any fault: mend it first")
        lines = json.loads(out.read_text(encoding="utf-8"))
        reached[test] = {name: set(numbers) for name, numbers in lines.items()}
    return reached, seconds


def mutants_of(
    copy: Path,
    path: str,
    reached: Mapping[str, Mapping[str, set[int]]],
    seconds: Mapping[str, float],
) -> Iterator[Mutant]:
    """Every fault that leaves a file valid Python with another meaning; decorators stay."""
    from cosmic_ray.ast import ast_nodes, get_ast
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator

    text = (copy / path).read_text(encoding="utf-8")
    tree = ast.parse(text)
    meaning, spans = ast.dump(tree), statements(tree)
    decorators = {d.lineno for node in ast.walk(tree) for d in getattr(node, "decorator_list", ())}
    nodes = list(ast_nodes(get_ast(text)))
    before = text.splitlines()
    for name in OPERATORS:
        operator = get_operator(f"core/{name}")()
        places = [p for node in nodes for p in operator.mutation_positions(node)]
        for occurrence, ((line, _), _end) in enumerate(places):
            if line in decorators:
                continue
            changed = mutate_code(text, operator, occurrence)
            try:
                if changed is None or ast.dump(ast.parse(changed)) == meaning:
                    continue
            except SyntaxError:
                continue
            first, last = spans.get(line, (line, line))
            run = [t for t in reached if reached[t][path] & set(range(first, last + 1))]
            yield Mutant(
                path,
                line,
                before[line - 1].strip(),
                changed.splitlines()[line - 1].strip(),
                changed,
                tuple(sorted(run, key=lambda t: (seconds[t], t))),
            )


def statements(tree: ast.Module) -> dict[int, tuple[int, int]]:
    """Line to the first and last line of the statement, or of a compound one's head, it is in."""
    spans: dict[int, tuple[int, int]] = {}
    for node in ast.walk(tree):  # outer ones first
        if isinstance(node, ast.stmt):
            last = node.end_lineno or node.lineno
            body = getattr(node, "body", None)
            if isinstance(body, list) and body:
                last = max(node.lineno, body[0].lineno - 1)
            for line in range(node.lineno, last + 1):
                spans[line] = (node.lineno, last)
    return spans


def verdict_on(
    copy: Path, mutant: Mutant, seconds: Mapping[str, float], noticed: Counter[str]
) -> str:
    """Run the tests that reach a fault; what takes far longer than without it is noticed, too.

    Args:
        copy: Where.
        mutant: The fault.
        seconds: Of each file of tests without a fault.
        noticed: How many faults of this source each file of tests has noticed: the best comes
            first, which changes how long it takes and nothing else. Counts up.
    """
    target, killer = copy / mutant.path, copy.parent / "killer.txt"
    original, stamp = target.read_bytes(), target.stat()
    target.write_text(mutant.source, encoding="utf-8")
    # Another time than any compiled file was made for.
    os.utime(target, (stamp.st_atime, stamp.st_mtime + 1000.0))
    killer.unlink(missing_ok=True)

    def work() -> int:
        for test in sorted(mutant.tests, key=lambda t: -noticed[t]):  # stable: then the quick ones
            if (code := run_pytest([test])) != 0:
                killer.write_text(test, encoding="utf-8")
                return code
        return 0

    try:
        limit = 20.0 + 5.0 * sum(seconds[t] for t in mutant.tests)
        code, _, _ = in_child(copy, work, limit)
    finally:
        target.write_bytes(original)
        os.utime(target, (stamp.st_atime, stamp.st_mtime))
    if killer.exists():
        noticed[killer.read_text(encoding="utf-8")] += 1
    return SURVIVED if code == 0 else KILLED


def run_pytest(tests: Sequence[str]) -> int:
    """Run files of tests up to the first failure, in this process."""
    import pytest

    own = ["-x", "-p", "no:cacheprovider", "-m", "not slow", "--hypothesis-seed=0"]
    own += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # hypothesis is there already
    return int(pytest.main([*own, *tests]))


def in_child(
    copy: Path, work: Callable[[], int], limit: float | None = None
) -> tuple[int, str, float]:
    """Do work in a forked process that sees the copy alone.

    Args:
        copy: Becomes the working folder and the place of the project's modules.
        work: Returns the exit code.
        limit: Of the processor's time, which other work on the machine does not change [s].

    Returns:
        Its exit code, what it printed, and the processor's time it took [s].
    """
    log = copy.parent / "output.txt"
    shutil.rmtree(copy / ".hypothesis", ignore_errors=True)  # no memory of earlier faults
    child = os.fork()
    if child == 0:
        code = 70
        try:
            os.setpgid(0, 0)
            if limit is not None:
                resource.setrlimit(resource.RLIMIT_CPU, (int(limit) + 1, int(limit) + 1))
            with log.open("w", encoding="utf-8") as file:
                os.dup2(file.fileno(), 1)
                os.dup2(file.fileno(), 2)
            os.chdir(copy)
            sys.path[:] = [str(copy), *(p for p in sys.path if Path(p).resolve() != ROOT)]
            for name in [n for n in sys.modules if n.split(".")[0] in PROJECT]:
                del sys.modules[name]
            sys.dont_write_bytecode = limit is not None
            os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
            code = work()
        except BaseException:
            import traceback

            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
    try:
        code, seconds = wait(child)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)  # and what it started
    return code, log.read_text(encoding="utf-8", errors="replace"), seconds


def wait(child: int) -> tuple[int, float]:
    """Exit code and processor's time [s] of a process; one that hangs is ended."""
    end = time.monotonic() + HANGS
    try:
        while time.monotonic() < end:
            done, status, used = os.wait4(child, os.WNOHANG)
            if done:
                return os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime
            time.sleep(0.02)
    except BaseException:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        raise
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return 124, HANGS


def report(tallies: Mapping[str, Tally], options: argparse.Namespace) -> None:
    """Print counts by file and the share killed."""
    verdicts = (KILLED, SURVIVED, UNCOVERED, EQUIVALENT)
    total = Tally(sum(t.made for t in tallies.values()))
    wide = max((len(p) for p in tallies), default=10)
    print(f"{'file':{wide}s}  {'made':>6s}" + "".join(f"{v:>13s}" for v in verdicts))
    for path, tally in tallies.items():
        print(f"{path:{wide}s}  {tally.made:6d}" + "".join(f"{tally[v]:13d}" for v in verdicts))
        for verdict in verdicts:
            total.add(verdict, tally[verdict])
    print(f"{'all':{wide}s}  {total.made:6d}" + "".join(f"{total[v]:13d}" for v in verdicts))
    run = total[KILLED] + total[SURVIVED]
    if run:
        print(
            f"\n{total[KILLED]} of {run} faults in covered lines were noticed: "
            f"{total[KILLED] / run:.1%}",
            end="",
        )
        if options.share < 1.0:
            spread = 1.96 * (total[KILLED] * total[SURVIVED] / run**3) ** 0.5
            print(f" +- {spread:.1%} (a share of {options.share:g}, seed {options.seed})", end="")
        print()


if __name__ == "__main__":
    sys.exit(main())
