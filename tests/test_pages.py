"""What the pages say is so: links lead somewhere, code runs, commands parse, how-tos work."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipeline.commands.main import parser
from tests.faults import copy_of_tree, run_in

ROOT = Path(__file__).parents[1]
PAGES = [
    *sorted(ROOT.glob("*.md")),
    *(p for top in ("urdf", "pipeline", "actuators", "tests") for p in (ROOT / top).rglob("*.md")),
    *(p for p in (ROOT / "reports").rglob("*.md") if "out" not in p.relative_to(ROOT).parts),
]
#: A fenced block, its language first, or a heading.
_PART = re.compile(r"^ *```(\w*)\n(.*?)^ *```[^\S\n]*$|^#{1,4} +([^\n]+)$", re.M | re.S)
#: The first line of a block that is a file, or a change of one.
_FILE = re.compile(r"(?:#|---) (\S+\.(?:py|csv|toml|md))(, at the end)?")
Blocks = list[tuple[str, str]]


def sections() -> dict[str, Blocks]:
    """Language and text of the blocks under each heading that has some."""
    out: dict[str, Blocks] = {}
    for page in PAGES:
        heading = ""
        for language, text, title in _PART.findall(page.read_text(encoding="utf-8")):
            heading = title or heading
            if text:
                out.setdefault(f"{page.relative_to(ROOT)}: {heading}", []).append((language, text))
    return out


SECTIONS = sections()
#: Sections that are followed to the letter in a copy of the tree.
FOLLOWED = [name for name in SECTIONS if re.search(": (How to|From file to answer)", name)]
RUNNING = [
    name
    for name, blocks in SECTIONS.items()
    if name not in FOLLOWED and any(b[0] == "python" and not _FILE.match(b[1]) for b in blocks)
]


def commands(text: str) -> Iterator[list[str]]:
    """Words of each command of a block, variables set in the block put in."""
    variables: dict[str, str] = {}
    for line in text.replace("\\\n", " ").splitlines():
        for command in re.split(r"; |&& ", line.split(" #")[0]):
            full = re.sub(r"\$(\w+)", lambda m: variables.get(m[1], m[0]), command).strip()
            if variable := re.fullmatch(r"(\w+)=(.*)", full):
                variables[variable[1]] = variable[2].strip('"')
            elif full:
                yield shlex.split(full)


def write(tree: Path, text: str) -> None:
    """Do in a tree what a block asks for that is a file or a change of one."""
    head, _, body = text.partition("\n")
    named = _FILE.fullmatch(head)
    assert named, f"the first line does not say which file this is: {head}"
    path = tree / named[1]
    if head.startswith("---"):
        old, new = (
            "".join(f"{line[1:]}\n" for line in body.splitlines() if line[:1] in (" ", sign))
            for sign in "-+"
        )
        before = "\n" + path.read_text(encoding="utf-8")
        assert before.count("\n" + old) == 1, f"{path.name}: {old}"
        body = before.replace("\n" + old, "\n" + new)[1:]
    elif named[2]:
        body = path.read_text(encoding="utf-8") + "\n" + body
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(body, encoding="utf-8")


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_links_lead_to_files_and_headings(page):
    prose = re.sub(r"^ *```.*?^ *```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    for link in re.findall(r"\]\(([^)\s]+)\)", prose):
        if "://" in link:
            continue
        target, _, anchor = link.partition("#")
        path = page.parent / target if target else page
        assert path.exists(), link
        if anchor and path.suffix == ".md":
            titles = [title for *_, title in _PART.findall(path.read_text(encoding="utf-8"))]
            plain = [re.sub(r"\]\([^)]*\)|[^\w\- ]", "", t.lower()) for t in titles]
            assert anchor in [t.replace(" ", "-") for t in plain], link


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the project in which blocks may write."""
    return copy_of_tree(tmp_path_factory.mktemp("pages") / "tree")


@pytest.mark.parametrize("name", RUNNING)
def test_python_runs(name, tree, monkeypatch):
    monkeypatch.chdir(tree)
    for language, text in SECTIONS[name]:
        if _FILE.match(text):
            write(tree, text)
        elif language == "python":
            exec(compile(text, name, "exec"), {"__name__": "__page__"})


@pytest.mark.parametrize("name", SECTIONS)
def test_commands_parse(name):
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for language, text in SECTIONS[name]:
        for words in commands(text) if language in ("sh", "bash") else ():
            if words[0] == "make":
                assert re.search(rf"^{words[1]}:.*##", makefile, re.M), words
                options = next((w[5:] for w in words if w.startswith("ARGS=")), "")
                if not options or words[1] == "blind":
                    continue
                words = ["", "-m", "pipeline", words[1], *shlex.split(options)]
            if words[1:3] == ["-m", "pipeline"]:
                parser().parse_args(words[3:])


@pytest.mark.parametrize("name", [name for name in FOLLOWED if ": How to add" in name])
def test_an_addition_takes_two_files_at_most(name):
    """From one run to the next, tests left out."""
    files: set[str] = set()
    for language, text in SECTIONS[name]:
        if language == "sh":
            assert len(files) <= 2
            files.clear()
        elif (named := _FILE.match(text)) and not named[1].startswith("tests/"):
            files.add(named[1])


@pytest.mark.slow
@pytest.mark.parametrize("name", FOLLOWED)
def test_followed_to_the_letter_it_works(name, tmp_path):
    """Files and changes are made, commands answer (1 is an answer of `gap`), as quoted."""
    tree, said = copy_of_tree(tmp_path / "tree"), ""
    for language, text in SECTIONS[name]:
        if language == "text":
            assert [line for line in text.splitlines() if line not in said] == [], said
        elif language not in ("sh", "bash"):
            write(tree, text)
        else:
            for words in commands(text):
                done = run_in(tree, words[1:])
                allowed = (0, 1) if "gap" in words else (0,)
                assert done.returncode in allowed, f"{words}\n{done.stdout}{done.stderr}"
                said += done.stdout
