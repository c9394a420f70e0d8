"""Put known faults into a copy of the code, one at a time, and see whether tests notice.

`make faults`; the faults, and the tests that should notice each, stand in `faults.toml`.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]
FAULTS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))["fault"]
_QUICK = ("-x", "-q", "-m", "not slow", "-p", "no:cacheprovider", "--hypothesis-seed=0")


def copy_of_tree(folder: Path) -> Path:
    """The project without what is generated, in a new folder."""
    ignore = shutil.ignore_patterns("__pycache__", "out", "example")
    for name in ("actuators", "pipeline", "reports", "tests", "urdf"):
        shutil.copytree(ROOT / name, folder / name, ignore=ignore)
    for name in ("pyproject.toml", "Makefile", "README.md"):
        shutil.copyfile(ROOT / name, folder / name)
    return folder


def run_in(tree: Path, words: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Run this interpreter with some arguments in a copy of the tree, which it imports."""
    environment = os.environ | {"PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, *words]
    return subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True)


def noticed(tree: Path, fault: dict[str, str]) -> bool:
    """Whether a test fails with a fault; the copy is as it was afterwards."""
    path = tree / fault["file"]
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace(fault["old"], fault["new"]), encoding="utf-8")
    done = run_in(tree, ["-m", "pytest", *_QUICK, *fault["tests"]])
    path.write_text(text, encoding="utf-8")
    if done.returncode not in (0, 1):  # nothing was tested
        raise SystemExit(done.stdout + done.stderr)
    return done.returncode == 1


def main() -> int:
    """Print which faults are noticed; exit code 1 where one is not."""
    parser = argparse.ArgumentParser(prog="tests.faults", description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", help="only files whose path contains one of these")
    files = parser.parse_args().files or [""]
    chosen = [fault for fault in FAULTS if any(part in fault["file"] for part in files)]
    missed = 0
    with tempfile.TemporaryDirectory() as folder:
        tree = copy_of_tree(Path(folder))
        for fault in chosen:
            found = noticed(tree, fault)
            missed += not found
            word = "noticed" if found else "UNNOTICED"
            print(f"{word}: {fault['file']}: {fault['old']} -> {fault['new']}", flush=True)
    print(f"{len(chosen) - missed} of {len(chosen)} faults were noticed")
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
