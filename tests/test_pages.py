"""What the rooms' pages say is so: links lead somewhere, code runs, how-tos work."""

from __future__ import annotations

import argparse
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path

import pytest
from pygments.lexers import find_lexer_class_by_name

from pipeline.cli.main import parser
from pipeline.identification.workflow.options import STEPS
from tests.blind.__main__ import parser as blind_parser
from tests.pages import (
    HOW_TO,
    PYTHON,
    ROOT,
    Block,
    Shell,
    anchors,
    blocks,
    change,
    copy_of_tree,
    links,
    pages,
    text_of,
)

PAGES = pages()
BLOCKS = [block for page in PAGES for block in blocks(page)]
SHELL = ("sh", "bash")
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
#: Blocks by section.
SECTIONS = [list(own) for _, own in groupby(BLOCKS, lambda b: (b.page, b.heading))]
HOW_TOS = [own for own in SECTIONS if own[0].heading.startswith(HOW_TO)]
#: The same for logs, in which a command may answer no.
FROM_FILE_TO_ANSWER = [s for s in SECTIONS if s[0].heading.startswith("From file to answer")]
RUNNING = [
    own
    for own in SECTIONS
    if own not in HOW_TOS and any(b.language == "python" and not b.file for b in own)
]
#: Verbs behind targets that hand them their options.
VERBS = {"reports": ["reports"], "gap": ["gap", "LOG"], "blind": []}
#: Options that name what a command writes.
WRITES = ("out", "sealed")
ROOMS_WITH_PAGES = [
    path.parent.relative_to(ROOT)
    for path in sorted(ROOT.glob("pipeline/*/__init__.py"))
    if path.parent.name != "examples"
]


def name_of(value: object) -> str:
    return str(value[0]) if isinstance(value, list) else str(value)


def test_the_site_can_show_every_block() -> None:
    """Sphinx colours a block by its language and stops where Pygments knows none of that name."""
    fenced = {b.language for b in BLOCKS if b.language} - {"math"}  # MyST's own
    assert {"python", "toml"} <= fenced
    for name in fenced:
        find_lexer_class_by_name(name)


# --- links ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_links_lead_to_files_and_headings(page: Path) -> None:
    broken = []
    for link in links(page):
        target, _, anchor = link.partition("#")
        path = (ROOT / page.parent / target) if target else ROOT / page
        lost = anchor and path.suffix == ".md" and anchor not in anchors(path.read_text("utf-8"))
        if not path.exists() or lost:
            broken.append(link)
    assert not broken


@pytest.mark.parametrize("room", ROOMS_WITH_PAGES, ids=str)
def test_every_room_has_a_page_of_a_screen(room: Path) -> None:
    page = ROOT / room / "README.md"
    assert page.exists()
    assert page.read_text(encoding="utf-8").startswith("# ")
    assert page in [(ROOT / p) for p in PAGES]


def test_every_page_is_reached_from_the_readme() -> None:
    seen, left = set(), [Path("README.md")]
    while left:
        page = left.pop()
        if page in seen:
            continue
        seen.add(page)
        for link in links(page):
            path = ROOT / page.parent / link.partition("#")[0]
            path = path / "README.md" if path.is_dir() else path
            if path.suffix == ".md" and path.exists():
                left.append(path.resolve().relative_to(ROOT))
    assert set(PAGES) <= seen


def test_the_readme_is_short() -> None:
    assert len(text_of(Path("README.md")).splitlines()) <= 130


# --- python ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the project in which blocks may write."""
    return copy_of_tree(tmp_path_factory.mktemp("pages") / "tree")


@pytest.mark.parametrize("section", RUNNING, ids=name_of)
def test_python_runs(section: list[Block], tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tree)
    for block in section:
        if block.file:
            change(tree, block)
        elif block.language == "python":
            exec(compile(block.text, str(block), "exec"), {"__name__": "__page__"})


# --- commands -------------------------------------------------------------------------------------


def commands(page: Path) -> Iterator[tuple[str, list[str]]]:
    shell = Shell()
    for block in blocks(page):
        if block.language in SHELL:
            for words in shell.commands(block.text):
                yield str(block), words


def parsed(words: list[str], program: str = "pipeline") -> argparse.Namespace:
    try:
        return (blind_parser() if program == "tests.blind" else parser()).parse_args(words)
    except SystemExit as stop:
        raise AssertionError(f"the command line refuses {shlex.join(words)}") from stop


def check_make(words: list[str]) -> None:
    """Targets and variables are the Makefile's, options in ARGS the verb's."""
    targets = [word for word in words if "=" not in word]
    for target in targets:
        assert re.search(rf"^{re.escape(target)}:.*##", MAKEFILE, re.M), f"make {target}"
    for word in words:
        name, equals, value = word.partition("=")
        if not equals:
            continue
        assert re.search(rf"^{name} +[?:]=", MAKEFILE, re.M), f"make has no {name}="
        if name == "ARGS" and targets[0] in VERBS:
            program = "tests.blind" if targets[0] == "blind" else "pipeline"
            parsed([*VERBS[targets[0]], *shlex.split(value)], program)


def read_by(options: argparse.Namespace) -> list[Path]:
    """Files that a command reads."""
    out = []
    for name, value in vars(options).items():
        values = value if isinstance(value, list) else [value]
        out += [v for v in values if isinstance(v, Path) and name not in WRITES]
    if options.verb == "gap":
        items = options.items[1:] if options.items[0] in STEPS else options.items
        out += [Path(item) for item in items]
    return out


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_commands_name_verbs_options_and_files_that_exist(page: Path) -> None:
    made = {b.file[0] for b in blocks(page) if b.file}
    written = {Path("reports/out/gap")}  # by `make gap`
    written |= {Path(p) for b in blocks(page) for p in re.findall(r'"(reports/out/[^"]*)"', b.text)}
    for where, words in commands(page):
        if words[0] == "make":
            check_make(words[1:])
            continue
        if words[:3] == [PYTHON, "-m", "tests.blind"]:
            written.add(parsed(words[3:], words[2]).write)
            continue
        if words[:3] != [PYTHON, "-m", "pipeline"]:
            known = {"git", "cd", "head", PYTHON}
            assert words[0] in known, f"{where}: {words[0]} is no command of this project"
            continue
        options = parsed(words[3:])
        for path in read_by(options):
            given = str(path).startswith("$LEGWATT_SHARED")
            own = any(out == path or out in path.parents for out in written)
            known = given or own or path in made or (ROOT / path).exists()
            known = known or list(ROOT.glob(str(path)))
            assert known, f"{where}: {path} is not there"
        written |= {getattr(options, name) for name in WRITES if getattr(options, name, None)}


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_options_and_targets_in_the_text_exist(page: Path) -> None:
    text = text_of(page)
    helped = parser().format_help() + blind_parser().format_help()
    for action in parser()._subparsers._group_actions[0].choices.values():  # type: ignore[union-attr]
        helped += action.format_help()
    for option in set(re.findall(r"(?<![-\w])--[a-z][a-z-]+", text)):
        assert option in helped or option == "--help", option
    for target in set(re.findall(r"`make ([a-z-]+)", text)):
        assert re.search(rf"^{target}:.*##", MAKEFILE, re.M), target


def run_in(tree: Path, words: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """A command of a page in a copy of the tree, by this interpreter."""
    return subprocess.run(
        [sys.executable, *words[1:]],
        cwd=tree,
        env=os.environ | {"PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
@pytest.mark.parametrize("section", FROM_FILE_TO_ANSWER, ids=name_of)
def test_logs_go_from_file_to_answer_to_the_letter(section: list[Block], tmp_path: Path) -> None:
    """Commands in order, each with an answer (exit code 0, or 1 for no), which the page quotes."""
    said = ""
    tree = copy_of_tree(tmp_path / "tree")
    for block in section:
        if block.file:
            change(tree, block)
        elif block.language in SHELL:
            for words in Shell().commands(block.text):
                run = run_in(tree, words)
                assert run.returncode in (0, 1), f"{block}: {shlex.join(words)}\n{run.stderr}"
                assert run.stderr == "", f"{block}: {shlex.join(words)}"
                said += run.stdout
        elif block.language == "text":
            assert [line for line in block.text.splitlines() if line not in said] == [], said


# --- how-tos --------------------------------------------------------------------------------------


def test_there_is_a_how_to_for_everything_that_people_add() -> None:
    said = " ".join(own[0].heading for own in HOW_TOS)
    for thing in ("effect", "element", "alternative", "robot", "gait", "table", "figure"):
        assert thing in said, thing


@pytest.mark.parametrize("how_to", HOW_TOS, ids=name_of)
def test_how_to_works_to_the_letter(how_to: list[Block], tmp_path: Path) -> None:
    tree = copy_of_tree(tmp_path / "tree")
    for block in how_to:
        if block.language not in SHELL:
            change(tree, block)
            continue
        for words in Shell().commands(block.text):
            assert words[0] == PYTHON, f"{block}: a how-to runs {PYTHON} only"
            run = run_in(tree, words)
            assert run.returncode == 0, f"{block}: {shlex.join(words)}\n{run.stdout}{run.stderr}"
    for check in (["check"], ["format", "--check"]):
        run = subprocess.run(
            [sys.executable, "-m", "ruff", *check, "--no-cache", "."],
            cwd=tree,
            capture_output=True,
            text=True,
            check=False,
        )
        assert run.returncode == 0, f"{how_to[0]}: {run.stdout}{run.stderr}"
