"""What an actuator is built of: its elements from the motor's terminals to the joint.

The same for any alternative of the actuator files: a block between two named shafts, a line for
each element in it with its numbers, beside each shaft the names that tables and figures give its
energy, torque and speed. Fig. 5 to 7, 9, 11 to 13, 15, 17 and 19 of the paper show that
of its own.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from actuators.chain import JOINT_STAGE, SUPPLY_STAGE
from actuators.elements.element import Element
from actuators.loading.build import Catalog
from reports.figures.stage_energy import stage_symbol
from reports.figures.style import (
    FORWARD,
    GREEN,
    INK,
    QUIET,
    REVERSE,
    SHADE,
    VERMILION,
    house_style,
    new_figure,
)
from reports.typeset import number, unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Laws of the catalogue as a reader knows them, where one line says them.
LAWS = {
    "motor": "motor: U = R I + k ω, Γ = k I",
    "ratio": "ratio: Γ / n, n ω",
    "inertia": "inertia: Γ + J dω/dt",
    "friction": "friction: Γ + (Γ₀ + μ |Γ| + c |ω|) sgn ω",
    "hypoid": "hypoid: Γ / n · (1 ± μ tan β₁) / (1 ± μ tan β₂), + where the motor drives",
    "parallel_spring": "parallel spring: Γ + k (q − q₀)",
    "holding_brake": "holding brake: holds up to its static torque at rest, Γ in motion",
    "second_motor": "second motor: (1 − share) Γ",
}
#: Symbols of the laws' arguments; others are called as in the file.
_SYMBOLS = {
    "ratio": "n", "coulomb": "Γ₀", "load": "μ", "viscous": "c", "inertia": "J", "friction": "μ",
    "pinion_angle": "β₁", "wheel_angle": "β₂", "wheel_radius": "r₂",
    "torque_constant": "k", "resistance": "R",
}  # fmt: skip
_MOTOR_NUMBERS = ("torque_constant", "resistance")
#: [in]: narrow, so that letters can be read where the page is.
_WIDTH, _MARGIN, _LINE, _GAP = 4.8, 0.12, 0.175, 0.5
_NUMBERS_AT, _MARKS_AT = 1.82, 4.0
_NAME_CHARS, _NUMBER_CHARS, _TITLE_CHARS, _WORD_CHARS = 20, 28, 46, 56
_LEGEND_CHARS = 66


@dataclass(frozen=True)
class Part:
    """One element of an actuator, or its motor."""

    name: str  #: In words.
    law: str  #: Key of `LAWS`, or another law's name.
    numbers: tuple[str, ...]  #: Symbol with value and unit, in the order of the file.
    dissipates: bool  #: Whether it turns energy into heat.
    stores: bool  #: Whether it holds energy, kinetic or of a spring.


@dataclass(frozen=True)
class Section:
    """A named stage and the elements between it and the next one towards the joint."""

    stage: str  #: Short name.
    where: str  #: In words.
    parts: tuple[Part, ...] = ()  #: None after the joint, nor between two names of one shaft.

    @property
    def height(self) -> float:
        """Of shaft and block [in]."""
        lines = sum(_LINE * max(map(len, _lines(part))) + 0.04 for part in self.parts)
        return _GAP + (0.12 + lines if self.parts else 0.0)


def chain_sections(catalog: Catalog, name: str) -> list[Section]:
    """An alternative from the supply to the joint."""
    alternative, chain = catalog.alternatives[name], catalog.chain(name)
    words, motor = alternative.stage_names, alternative.motor
    numbers = _numbers(catalog, {n: f"{motor}.{n}" for n in _MOTOR_NUMBERS})
    first = Part("motor", "motor", (catalog.components[motor].title, *numbers), True, False)
    blocks: dict[str, list[Part]] = {SUPPLY_STAGE: [first]}
    for entry, element in reversed(list(zip(alternative.elements, chain.elements, strict=True))):
        if entry.stage:
            blocks[entry.stage] = []
        law = type(element)
        part = Part(
            entry.name.replace("_", " "),
            entry.law,
            _numbers(catalog, entry.arguments),
            dissipates=law.loss is not Element.loss,
            stores=law.stored is not Element.stored,
        )
        blocks[next(reversed(blocks))].append(part)
    blocks[JOINT_STAGE] = []
    return [Section(stage, words[stage], tuple(parts)) for stage, parts in blocks.items()]


def _numbers(catalog: Catalog, references: Mapping[str, str]) -> tuple[str, ...]:
    """Each argument's symbol, value and unit as in its file."""
    out = []
    for argument, reference in references.items():
        given = catalog.parameter(reference)
        unit = "" if given.unit == "1" else unit_text(given.unit)
        unit = unit if unit in ("", "°") else f"\N{NO-BREAK SPACE}{unit}"
        label = _SYMBOLS.get(argument, argument.replace("_", " "))
        out.append(f"{label}\N{NO-BREAK SPACE}{number(given.value_as_written)}{unit}")
    return tuple(out)


@house_style()
def actuator_chain_figure(sections: Sequence[Section], *, title: str, subtitle: str = "") -> Figure:
    """Draw an actuator from the motor's terminals at the top to the joint at the bottom."""
    heading = textwrap.wrap(title, _TITLE_CHARS)
    legend = [
        "down, blue: E(+), towards the joint; up: E(\N{MINUS SIGN}), back from it",
        "at the motor side of an element, Γ and ω being those at its joint side:",
    ]
    for law in dict.fromkeys(part.law for section in sections for part in section.parts):
        legend += textwrap.wrap(LAWS.get(law, ""), _LEGEND_CHARS, subsequent_indent="    ")
    y = _MARGIN + 0.2 * len(heading) + (0.22 if subtitle else 0.05)  # [in]
    height = y + sum(section.height for section in sections) + _LINE * len(legend) + 0.22
    figure = new_figure(height, width=_WIDTH, arranged=False)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(0.0, _WIDTH)
    axes.set_ylim(height, 0.0)  # downwards, in inches
    axes.set_axis_off()
    look: dict[str, Any] = {"va": "top", "ha": "left"}
    axes.text(_MARGIN, _MARGIN, "\n".join(heading), fontsize=10.5, fontweight="bold", **look)
    axes.text(_MARGIN, y - 0.19, subtitle, fontsize=8.5, color=QUIET, **look)
    for section in sections:
        _draw_shaft(axes, section, y)
        if section.parts:
            _draw_block(axes, section, y + _GAP)
        y += section.height
    for k, line in enumerate(legend):
        axes.text(_MARGIN, y + 0.12 + _LINE * k, line, fontsize=8.5, color=QUIET, **look)
    return figure


def _lines(part: Part) -> tuple[list[str], list[str]]:
    """The element's name and its numbers, each over as many lines as they need."""
    text = textwrap.wrap(
        ", ".join(part.numbers), _NUMBER_CHARS, break_long_words=False, break_on_hyphens=False
    )
    return textwrap.wrap(part.name, _NAME_CHARS), text


def _draw_block(axes: Axes, section: Section, y: float) -> None:
    from matplotlib.patches import FancyBboxPatch

    axes.add_patch(
        FancyBboxPatch(
            (_MARGIN, y),
            _MARKS_AT - _MARGIN - 0.05,
            section.height - _GAP,
            boxstyle="round,pad=0,rounding_size=0.05",
            facecolor=SHADE,
            edgecolor=QUIET,
            linewidth=0.8,
        )
    )
    y += 0.08
    for part in section.parts:
        names, numbers = _lines(part)
        look: dict[str, Any] = {"va": "top", "ha": "left", "linespacing": 1.35}
        axes.text(_MARGIN + 0.08, y, "\n".join(names), fontsize=9, fontweight="bold", **look)
        axes.text(_NUMBERS_AT, y, "\n".join(numbers), fontsize=9, **look)
        if part.dissipates:
            _mark(axes, y + 0.07, "heat", VERMILION)
        if part.stores:
            word = "elastic" if part.law == "parallel_spring" else "kinetic"
            _mark(axes, y + 0.07, word, GREEN, back=True)
        y += _LINE * max(len(names), len(numbers)) + 0.04


def _mark(axes: Axes, y: float, word: str, color: str, *, back: bool = False) -> None:
    """What leaves an element sideways, and comes back."""
    ends = (_MARKS_AT - 0.02, _MARKS_AT + 0.15)
    _arrow(axes, ends, (y, y), color, ">")
    if back:
        _arrow(axes, ends[::-1], (y, y), color, "<")
    axes.text(_MARKS_AT + 0.22, y, word, va="center", ha="left", fontsize=8.5, color=color)


def _arrow(
    axes: Axes, x: tuple[float, float], y: tuple[float, float], color: str, head: str
) -> None:
    axes.plot(x, y, color=color, linewidth=1.5, marker=head, markersize=5, markevery=[-1])


def _draw_shaft(axes: Axes, shaft: Section, y: float) -> None:
    """Energy towards the joint and back, and what the shaft's variables are called."""
    ends = (y + 0.06, y + _GAP - 0.06)
    _arrow(axes, (0.55, 0.55), ends, FORWARD, "v")
    _arrow(axes, (0.78, 0.78), ends[::-1], REVERSE, "^")
    names = (
        "U, I"
        if shaft.stage == SUPPLY_STAGE
        else f"{stage_symbol(shaft.stage, 'Γ')}, {stage_symbol(shaft.stage, 'ω')}"
    )
    text = f"{stage_symbol(shaft.stage)}: {names}"
    where = textwrap.shorten(shaft.where, _WORD_CHARS, placeholder=" …")
    look: dict[str, Any] = {"va": "center", "ha": "left"}
    axes.text(1.0, y + 0.35 * _GAP, text, fontsize=9.5, color=INK, **look)
    axes.text(1.0, y + 0.72 * _GAP, where, fontsize=8.5, color=QUIET, **look)
