"""Sphinx settings of the site that `make docs` builds; `build.py` lays out its source."""

from __future__ import annotations

import re
from typing import Any

#: A bar, or a stretch of code in backticks, which stays.
_BAR = re.compile(r"(`[^`]*`)|\|")
_ACCENT = re.compile(r"<mover[^>]*>\s*<mi>(\w)</mi>\s*<mo[^>]*>(.)</mo>\s*</mover>")
_COMBINING = {"˙": "\u0307", "¨": "\u0308", "^": "\u0302", "ˆ": "\u0302"}
#: What a type checker calls an array of numbers; shapes and units stand in the docstrings.
_ARRAY = re.compile(r"~?(?:numpy\.)?ndarray\[.*?dtype\[[^\]]*\]\]")

project = "legwatt"
author = "legwatt contributors"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]

# Pages are written for a repository's reader: dollars around formulas, headings as link targets.
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
myst_dmath_double_inline = True

# Docstrings: Google style, names in single backticks.
default_role = "code"
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
napoleon_attr_annotations = False
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_default_options = {"members": True, "show-inheritance": True}
add_module_names = False
# Types in signatures are found by their short names, which several rooms may use; the site then
# links the first.
suppress_warnings = ["ref.python"]
python_maximum_signature_line_length = 88
toc_object_entries_show_parents = "hide"

html_theme = "furo"
html_title = "legwatt"
html_show_copyright = False
html_show_sphinx = False
html_copy_source = False
html_show_sourcelink = False
html_math_renderer = "mathml"
html_static_path = ["style"]
html_css_files = ["site.css"]
pygments_style = "friendly"


def _mathml(tex: str, *, block: bool) -> str:
    """A formula as MathML, which browsers show without a script or a network."""
    from docutils.utils.math.latex2mathml import tex2mathml

    # A superscript T is one in any type. Accents are combined with their letter: without a font for
    # mathematics browsers draw those of MathML onto it.
    text = str(tex2mathml(tex.replace("\\mathsf", "\\mathrm"), as_block=block))
    return _ACCENT.sub(_accented, text)


def _accented(match: re.Match[str]) -> str:
    return f'<mi style="font-style: italic">{match[1]}{_COMBINING[match[2]]}</mi>'


def _inline(self: Any, node: Any) -> None:
    from docutils import nodes

    self.body.append(_mathml(node.astext(), block=False))
    raise nodes.SkipNode


def _display(self: Any, node: Any) -> None:
    from docutils import nodes

    self.body.append(f'<div class="math">{_mathml(node.astext(), block=True)}</div>')
    raise nodes.SkipNode


def _as_written(
    app: Any, what: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Docstrings are plain text: |x| is a magnitude, what a module indents is shown as it is."""
    out: list[str] = []
    literal = False
    for line in lines:
        above = [before for before in out if before.strip()]
        if what == "module" and line.startswith("    ") and not literal:
            first = bool(out) and not out[-1].strip()
            literal = first and not (above and above[-1].startswith((" ", "..", ":", "-")))
            said = bool(above) and above[-1].endswith("::")
            out += ["::", ""] if literal and not said else []
        elif line.strip() and not line.startswith(" "):
            literal = False
        out.append(line if literal else _BAR.sub(lambda m: m[1] or "\\|", line))
    lines[:] = out


def _short(
    app: Any, what: str, name: str, thing: object, options: object, given: str, returned: str
) -> tuple[str | None, str | None]:
    """Signatures with `Array` for arrays of any kind of number."""
    return given and _ARRAY.sub("Array", given), returned and _ARRAY.sub("Array", returned)


def setup(app: Any) -> None:
    """Register the renderer of formulas and the reading of docstrings."""
    app.connect("autodoc-process-docstring", _as_written, priority=600)
    app.connect("autodoc-process-signature", _short)
    app.add_html_math_renderer("mathml", (_inline, None), (_display, None))
