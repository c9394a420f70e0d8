"""A guess as the text of a robot file."""

from __future__ import annotations

import json
from pathlib import Path

import tomlkit

from actuators.arrays import Array
from pipeline.robot.guess.guess import Guess, Pace

_PLACES = 4  # digits of feet and postures [m, rad]


def robot_text(guess: Guess, out: Path) -> str:
    """The robot file of a guess, every guess with its reason under ``[assumed]``.

    `out`: where the file will stand; it names the URDF from there.
    """
    assumed = {"robot.base_link": "the root of the URDF's tree of links"}
    lines = [
        f"# {guess.source.name}, guessed by `python -m pipeline init`. [assumed] says why each",
        "# guess was made: look at the picture beside this file, then correct what is wrong.",
        "",
        "[robot]",
        f"name = {_text(guess.source.name)}",
        f"urdf = {_text(guess.source.reference(out))}",
        f"base_link = {_text(guess.base_link)}",
        'base = "floating"',
    ]
    stance = guess.stance
    levelled = f", feet levelled by up to {1e3 * stance.levelled:.2g} mm"
    for limb, foot, posture in zip(guess.limbs, stance.feet, stance.posture, strict=True):
        key = f"legs.{_key(limb.name)}"
        lines += [
            "",
            f"[{key}]",
            f"joints = [{', '.join(map(_text, limb.joints))}]",
            f"foot = {_text(limb.foot)}",
            f'side = "{"left" if foot[1] >= 0 else "right"}"',
            f"neutral_foot = {_numbers(foot)}",
            f"start_posture = {_numbers(posture[: len(limb.joints)])}",
        ]
        assumed |= {
            f"{key}.joints": "the chain of joints from the base to the foot",
            f"{key}.foot": limb.reason,
            f"{key}.side": "the side of the foot in the stance",
            f"{key}.neutral_foot": stance.reason
            + (levelled if stance.levelled >= 0.5 * 10**-_PLACES else ""),
            f"{key}.start_posture": "the same",
        }
    if guess.held:
        lines += ["", "[held]  # [rad, m]"]
        lines += [f"{_key(joint)} = {value!r}" for joint, value, _ in guess.held]
        assumed |= {f"held.{_key(joint)}": reason for joint, _, reason in guess.held}
    # The slowest of the usual gaits for so many legs; six walk in two tripods.
    gait = {4: "crawl", 6: "tripod"}.get(len(guess.limbs), "wave")
    lines += ["", "[gait]", f'name = "{gait}"', 'transfer_path = "harmonic"', "", "[assumed]"]
    lines += [f"{_text(key)} = {_text(reason)}" for key, reason in assumed.items()]
    text = "\n".join([*lines, *_parameters(guess)]) + "\n"
    if guess.motors:
        text += "\n" + tomlkit.dumps({"actuators": dict(guess.motors)})
    return text


def _parameters(guess: Guess) -> list[str]:
    pace = guess.pace or Pace(0.02, 0.01, 2.0)
    why = (
        "the longest of a row of strokes that every leg can do within its limits"
        if guess.pace
        else "no stroke was found within reach and limits: change the stance"
    )
    mass = float(f"{guess.mass:.6g}")
    lines = _parameter("total_mass", mass, "kg", "derived", "the sum of the URDF's links")
    for name, value, unit, reason in (
        ("foot_stroke", 1e3 * pace.stroke, "mm", why),
        ("foot_lift", 1e3 * pace.lift, "mm", "a share of the stroke"),
        ("gait_period", pace.period, "s", "slow; goes with the root of the hips' height"),
    ):
        number = float(f"{value:.9g}")
        lines += _parameter(name, number, unit, "assumed", "python -m pipeline init")
        low, high = (float(f"{factor * number:.6g}") for factor in (0.5, 2.0))
        lines += [f"reason = {_text(reason)}", f"interval = [{low!r}, {high!r}]"]
    return lines + _parameter("gravity", 9.81, "m/s^2", "datasheet", "usual engineering value")


def _parameter(name: str, value: float, unit: str, basis: str, source: str) -> list[str]:
    head = ["", f"[parameters.{name}]", f"value = {value!r}", f'unit = "{unit}"']
    return [*head, f'basis = "{basis}"', f"source = {_text(source)}"]


def _numbers(values: Array) -> str:
    return "[" + ", ".join(repr(round(float(x), _PLACES) + 0.0) for x in values) + "]"


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _key(name: str) -> str:
    bare = name.isascii() and name.replace("_", "").replace("-", "").isalnum()
    return name if bare else _text(name)
