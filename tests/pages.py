"""What stands in the rooms' pages: links, blocks of code, commands, how-tos."""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOMS = ("urdf", "pipeline", "actuators", "reports")
#: Sections that say how to add something are followed to the letter in a copy of the tree.
HOW_TO = "How to "
PYTHON = ".venv/bin/python"
_LINK = re.compile(r"\]\(([^)\s]+)\)")
_FENCE = re.compile(r"^ *```(\w*)\n(.*?)^ *```\s*?$", re.M | re.S)
_HEADING = re.compile(r"^#{1,4} +(.+)$", re.M)
_PATH = re.compile(r"# (\S+\.(?:py|toml))(, at the end)?\n")
_COPIED = shutil.ignore_patterns(".git", ".venv", "__pycache__", ".*_cache", "out", ".hypothesis")


@dataclass(frozen=True)
class Block:
    """A fenced block of code.

    Attributes:
        page: Relative to the root.
        line: Of its first line.
        language: As fenced.
        text: Without the fences.
        heading: Under which it stands.
    """

    page: Path
    line: int
    language: str
    text: str
    heading: str

    def __str__(self) -> str:
        return f"{self.page}:{self.line}"

    @property
    def file(self) -> tuple[Path, bool] | None:
        """The file it is, by its first line, and whether it goes to that file's end."""
        match = _PATH.match(self.text)
        return (Path(match[1]), bool(match[2])) if match else None


def pages() -> list[Path]:
    """Every page of the project, relative to the root."""
    out = [Path("README.md"), Path("CHANGELOG.md"), Path("tests/blind/README.md")]
    for room in ROOMS:
        found = (p.relative_to(ROOT) for p in (ROOT / room).rglob("*.md"))
        out += sorted(p for p in found if p.parts[:2] != ("reports", "out"))
    return out


def text_of(page: Path) -> str:
    """A page."""
    return (ROOT / page).read_text(encoding="utf-8")


def without_code(text: str) -> str:
    """A page's prose."""
    return _FENCE.sub("", text)


def links(page: Path) -> list[str]:
    """Targets of a page's links that lead into the project."""
    found = _LINK.findall(without_code(text_of(page)))
    return [link for link in found if "://" not in link]


def anchors(text: str) -> set[str]:
    """Anchors of a page's headings, as repositories and the site make them."""
    out = set()
    for heading in _HEADING.findall(without_code(text)):
        plain = re.sub(r"[`*_]|\[|\]\([^)]*\)", "", heading).strip().lower()
        out.add(re.sub(r"[^\w\- ]", "", plain).replace(" ", "-"))
    return out


def blocks(page: Path) -> list[Block]:
    """A page's blocks of code, in order."""
    text = text_of(page)
    headings = [(m.start(), m[1]) for m in _HEADING.finditer(text)]
    fences = [(m.start(), m.end()) for m in _FENCE.finditer(text)]
    headings = [h for h in headings if not any(a <= h[0] < b for a, b in fences)]
    out = []
    for match in _FENCE.finditer(text):
        above = [title for at, title in headings if at < match.start()]
        line = text.count("\n", 0, match.start()) + 2
        out.append(Block(page, line, match[1], match[2], above[-1] if above else ""))
    return out


@dataclass
class Shell:
    """Reads lines of a shell as far as the pages write them: commands, variables, line breaks.

    Attributes:
        variables: Set by lines such as ``D=$LEGWATT_SHARED/data``, by name.
    """

    variables: dict[str, str] = field(default_factory=dict)

    def commands(self, text: str) -> Iterator[list[str]]:
        """Words of each command."""
        for line in text.replace("\\\n", " ").splitlines():
            lexer = shlex.shlex(self._expanded(line), posix=True, punctuation_chars=";&|<>")
            lexer.commenters = "#"
            lexer.whitespace_split = True
            words: list[str] = []
            for word in [*lexer, ";"]:
                if word not in (";", "&&"):
                    words.append(word)
                    continue
                # Values hold variables that a command of the same line reads later.
                while words and re.fullmatch(r"\w+=.*", words[0], re.S) and words[0][0] != "-":
                    name, _, value = words.pop(0).partition("=")
                    self.variables[name] = self._expanded(value)
                if words:
                    yield [w for word in words for w in self._split(word)]
                words = []

    def _expanded(self, text: str) -> str:
        return re.sub(r"\$(\w+)", lambda m: self.variables.get(m[1], m[0]), text)

    def _split(self, word: str) -> list[str]:
        expanded = self._expanded(word)
        return expanded.split() if expanded != word else [word]


def copy_of_tree(folder: Path) -> Path:
    """The project without what is generated, in a new folder."""
    folder.mkdir(parents=True)
    for name in (*ROOMS, "tests"):
        shutil.copytree(ROOT / name, folder / name, ignore=_COPIED)
    for name in ("pyproject.toml", "Makefile", "README.md"):
        shutil.copyfile(ROOT / name, folder / name)
    return folder


def change(tree: Path, block: Block) -> None:
    """Do in a tree what a block that is a file, or a change of one, asks for.

    Raises:
        ValueError: The lines to change do not stand in the file once.
    """
    if block.language == "diff":
        head, *lines = block.text.splitlines()
        path = tree / head.removeprefix("--- ")
        old = "".join(f"{line[1:]}\n" for line in lines if line[:1] in (" ", "-"))
        new = "".join(f"{line[1:]}\n" for line in lines if line[:1] in (" ", "+"))
        text = "\n" + path.read_text(encoding="utf-8")
        times = text.count("\n" + old)
        if times != 1:
            raise ValueError(f"{block}: its lines stand {times} times in {path.name}")
        path.write_text(text.replace("\n" + old, "\n" + new)[1:], encoding="utf-8")
        return
    if block.file is None:
        raise ValueError(f"{block}: the first line does not say which file this is")
    path, at_end = tree / block.file[0], block.file[1]
    body = block.text.split("\n", 1)[1]
    path.parent.mkdir(parents=True, exist_ok=True)
    before = path.read_text(encoding="utf-8") + "\n" if at_end else ""
    path.write_text(before + body, encoding="utf-8")
