"""One way to write numbers and units: for readers on pages and figures, as words in headers."""

import math
import re

MINUS, DOT, TIMES = "\N{MINUS SIGN}", "\N{MIDDLE DOT}", "\N{MULTIPLICATION SIGN}"
_RAISED = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_SYMBOLS = {"ohm": "Ω", "deg": "°", "degC": "°C"}
#: Below and from here on a power of ten is written out.
_SMALL, _LARGE = 1e-4, 1e6


def number(value: float, digits: int = 3) -> str:
    """A number as it is where it is short, else rounded to significant digits, zeros kept.

    A true minus sign; a power of ten only far from 1. So 0.6, as it stands in a file, is ``0.6``,
    and 0.59996 with three digits is ``0.600``: who sees zeros at the end sees a rounded number.
    """
    value = float(value)
    if not math.isfinite(value):
        return "\N{EN DASH}" if math.isnan(value) else f"{MINUS if value < 0 else ''}\N{INFINITY}"
    if value == 0:
        return "0"
    short = f"{value:.{digits}g}"
    rounded = short if float(short) == value else f"{value:#.{digits}g}"
    size = abs(float(rounded))
    if size < _SMALL or size >= _LARGE:
        mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
        if float(short) == value and "." in mantissa:
            mantissa = mantissa.rstrip("0").rstrip(".")
        text = f"{mantissa}{TIMES}10{str(int(exponent)).translate(_RAISED)}"
    elif "e" in rounded:  # more digits before the point than are significant
        text = f"{float(rounded):.0f}"
    else:
        text = rounded.rstrip(".")
    return text.replace("-", MINUS)


def unit_text(unit: str) -> str:
    """A unit as people write it: ``N*m`` is ``N·m``, ``rad/s^2`` is ``rad/s²``."""
    text = re.sub(r"\^(-?\d)", lambda match: match[1].translate(_RAISED), unit)
    text = re.sub(r"[A-Za-z]+", lambda match: _SYMBOLS.get(match[0], match[0]), text)
    return text.replace("*", DOT)


def unit_suffix(unit: str) -> str:
    """A unit as a word in a header: ``"N*m"`` is ``Nm``, ``"rad/s^2"`` is ``rad_s2``."""
    if unit in ("", "1"):
        return ""
    return unit.replace("*", "").replace("/", "_").replace("^", "")


def percent(share: float, digits: int = 0) -> str:
    """A share in percent."""
    return f"{100 * share:.{digits}f} %"
