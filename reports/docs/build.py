"""Builds the site: `python reports/docs/build.py OUT`.

The rooms' pages and an API reference from the docstrings are laid out as Sphinx's source in a
folder beside the result, links turned to what a site has, and built with warnings as errors. The
site needs no server: it is read, searched and its formulas shown straight from the files.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
#: Folders whose pages and packages the site shows, in the order of its menu.
ROOMS = ("urdf", "pipeline", "actuators", "reports")
PACKAGES = ("pipeline", "actuators", "reports")
README = Path("README.md")
#: Pages of other names than README.md.
MORE_PAGES = ("actuators/ERRATA.md", "CHANGELOG.md", "tests/blind/README.md")
_LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s#]+)(#[^)\s]*)?\)")
_FENCE = re.compile(r"^ *```.*?^ *```\s*?$", re.M | re.S)


def pages() -> list[Path]:
    """Every page, relative to the root: the README first, then rooms from the outside in."""
    found = [README]
    for room in ROOMS:
        own = (p.relative_to(ROOT) for p in (ROOT / room).rglob("README.md"))
        found += sorted((p for p in own if p.parts[:2] != ("reports", "out")), key=_order)
    return found + [Path(p) for p in MORE_PAGES if (ROOT / p).exists()]


def _order(page: Path) -> tuple[tuple[str, ...], str]:
    return page.parent.parts, page.name


def modules(package: str) -> Iterator[tuple[str, list[str]]]:
    """Packages below one, itself first, each with its modules' names."""
    for init in sorted((ROOT / package).rglob("__init__.py")):
        folder = init.parent
        name = ".".join(folder.relative_to(ROOT).parts)
        own = sorted(p.stem for p in folder.glob("*.py") if not p.stem.startswith("__"))
        yield name, own


def stage(source: Path) -> None:
    """Lay out Sphinx's source."""
    shown = pages()
    for page in shown:
        target = source / ("index.md" if page == README else page)
        target.parent.mkdir(parents=True, exist_ok=True)
        text = _for_site((ROOT / page).read_text(encoding="utf-8"), page, source)
        text += _menu(page, shown)
        target.write_text(text, encoding="utf-8")
    _write_api(source / "api")
    shutil.copyfile(HERE / "conf.py", source / "conf.py")
    shutil.copytree(HERE / "style", source / "style")


def _menu(page: Path, shown: list[Path]) -> str:
    """Menu entries below a page: those of the folders in its own, in the order it names them."""
    text = (ROOT / page).read_text(encoding="utf-8")
    below = [p for p in shown if p != page and _above(p, shown) == page]
    links = [os.path.relpath(p, page.parent) for p in below]
    places = [text.find(f"({link}") % (len(text) + 1) for link in links]  # unnamed ones last
    entries = [link.removesuffix(".md") for _, link in sorted(zip(places, links, strict=True))]
    out = ["", *_toctree(entries, ":caption: Rooms" if page == README else "")] if entries else []
    if page == README:
        out += _toctree([f"api/{package}" for package in PACKAGES], ":caption: API reference")
    return "\n".join([*out, ""])


def _toctree(entries: list[str], option: str) -> list[str]:
    return ["```{toctree}", ":hidden:", *([option] if option else []), "", *entries, "```", ""]


def _above(page: Path, shown: list[Path]) -> Path:
    """The page of the nearest folder around a page."""
    for folder in page.parents:
        if folder / "README.md" in shown and folder / "README.md" != page:
            return folder / "README.md"
    return README


def _for_site(text: str, page: Path, source: Path) -> str:
    """A page with links to what the site has: pages, API entries, copies of files."""
    out, end = [], 0
    for fence in _FENCE.finditer(text):
        out.append(_LINK.sub(lambda m: _link(m, page, source), text[end : fence.start()]))
        out.append(re.sub(r"^( *)```math", r"\1```{math}", fence[0]))
        end = fence.end()
    out.append(_LINK.sub(lambda m: _link(m, page, source), text[end:]))
    return "".join(out)


def _link(match: re.Match[str], page: Path, source: Path) -> str:
    picture, words, target, anchor = match[1], match[2], match[3], match[4] or ""
    if "://" in target:
        return match[0]
    path = Path(os.path.normpath(page.parent / target))
    if (ROOT / path).is_dir():
        if (ROOT / path / "README.md").exists():
            path /= "README.md"
        elif (ROOT / path / "__init__.py").exists():
            return _to_api(words, page, ".".join(path.parts), ".".join(path.parts))
        else:
            return words
    if path.suffix == ".py":
        return _to_api(
            words, page, ".".join(path.parent.parts), ".".join(path.with_suffix("").parts)
        )
    if path.suffix == ".md":
        path = Path("index.md") if path == README else path
    else:
        copy = source / path
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / path, copy)
    below = os.path.relpath(path, page.parent)
    return f"{picture}[{words}]({below}{anchor})"


def _to_api(words: str, page: Path, package: str, module: str) -> str:
    at = os.path.relpath(f"api/{package}.html", page.parent)
    shown = re.sub(r"`([^`]*)`", r"<code>\1</code>", words)
    return f'<a href="{at}#module-{module}">{shown}</a>'


def _write_api(folder: Path) -> None:
    """One page per package: what it says of itself, then its modules."""
    folder.mkdir(parents=True)
    for top in PACKAGES:
        below = dict(modules(top))
        for name, own in below.items():
            inner = [p for p in below if p.rpartition(".")[0] == name]
            (folder / f"{name}.rst").write_text(_api_page(name, own, inner), encoding="utf-8")


def _api_page(name: str, own: list[str], inner: list[str]) -> str:
    lines = [name, "=" * len(name), "", f".. automodule:: {name}"]
    # What a package passes on is described where it stands; `pipeline` itself is the API.
    lines += ["   :ignore-module-all:"] if "." in name else []
    lines += [""]
    if inner:
        lines += [".. toctree::", "   :maxdepth: 1", "", *(f"   {p}" for p in inner), ""]
    for module in own:
        full = f"{name}.{module}"
        lines += [module, "-" * len(module), "", f".. automodule:: {full}", ""]
    return "\n".join(lines)


def build(out: Path) -> int:
    """Build the site into a folder, which is replaced as a whole where it succeeds.

    Returns:
        Sphinx's exit code.
    """
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=out.parent, prefix=".docs-") as work:
        source, site = Path(work) / "source", Path(work) / "site"
        source.mkdir()
        stage(source)
        call = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-j", "auto"]
        call += ["-d", str(Path(work) / "doctrees"), str(source), str(site)]
        path = os.pathsep.join(p for p in (str(ROOT), os.environ.get("PYTHONPATH", "")) if p)
        code = subprocess.run(
            call, env=os.environ | {"PYTHONPATH": path, "MPLBACKEND": "Agg"}, check=False
        ).returncode
        if code == 0:
            shutil.rmtree(out, ignore_errors=True)
            site.rename(out)
    return code


def main() -> int:
    """Read the arguments and build."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("out", type=Path, help="folder of the site")
    out: Path = parser.parse_args().out
    code = build(out)
    if code == 0:
        print(f"open {out / 'index.html'}")
    return code


if __name__ == "__main__":
    sys.exit(main())
