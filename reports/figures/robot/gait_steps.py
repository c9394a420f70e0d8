"""The gait in motion as one SVG that needs no script: a cycle of steps shown one after the other.

Each step is a group of shapes; a style sheet shows one group at a time. In print, and for readers
who ask their system for less motion, the first step stands still.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

from reports.figures.robot.outline import outline
from reports.figures.robot.projection import OBLIQUE, TOP, View
from reports.figures.style import BLUE, FAINT, GREEN, INK, QUIET, SHADE, VERMILION, YELLOW, number

Array = NDArray[np.float64]
_WIDTH, _HEIGHT = 950.0, 560.0
#: Left, top, width and height of the panels [px]: the robot, support from above, footfall.
_ROBOT, _ABOVE = (10.0, 62.0, 590.0, 336.0), (625.0, 62.0, 305.0, 336.0)
_FALL = (70.0, 432.0, 860.0, 96.0)
_GREY, _LIGHT = "#8a929a", "#b9c0c7"
#: A cycle is shown in its own time within these bounds [s].
_SHORTEST, _LONGEST = 2.0, 8.0
#: The largest force is drawn this long, and the largest torque as a disc this wide, in sizes of
#: the robot.
_FORCE, _TORQUE = 0.35, 0.045


@dataclass(frozen=True)
class Body:
    """A moving body of the robot, drawn as the outline of its convex hull.

    Attributes:
        leg: The leg it belongs to; empty for the trunk and what it carries.
        points: Corners of its hull in each step, in a frame that follows the robot without
            turning, z up, shape (S, P, 3) [m].
        load: Whether it is no part of the robot but carried by it.
    """

    leg: str
    points: Array
    load: bool = False


@dataclass(frozen=True)
class Steps:
    """One cycle in S steps, all places in a frame that follows the robot without turning.

    Attributes:
        legs: All legs.
        time: Of each step, from 0, shape (S,) [s].
        period: Duration of the cycle [s].
        bodies: What is drawn.
        feet: Shape (S, L, 3) [m].
        stands: Whether a foot stands, shape (S, L).
        force: Of the ground on the feet, shape (S, L, 3) [N].
        joints: Where joints are, shape (S, J, 3) [m].
        torque: At the joints, shape (S, J) [N*m].
        mass_centre: Shape (S, 3) [m].
        margin: Static stability, shape (S,) [m].
        origin: Where the frame is in the world, shape (S, 3) [m].
    """

    legs: tuple[str, ...]
    time: Array
    period: float
    bodies: tuple[Body, ...]
    feet: Array
    stands: NDArray[np.bool_]
    force: Array
    joints: Array
    torque: Array
    mass_centre: Array
    margin: Array
    origin: Array


def gait_steps(steps: Steps, *, title: str, subtitle: str = "") -> str:
    """The SVG's text.

    Args:
        steps: One cycle.
        title: First line.
        subtitle: Second line.
    """
    shown_in = float(np.clip(steps.period, _SHORTEST, _LONGEST))
    count = steps.time.size
    robot, above = (
        _fitted(OBLIQUE, _robot_points(steps), _ROBOT),
        _fitted(TOP, _flat(steps), _ABOVE),
    )
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" '
        f'width="{_WIDTH:g}" height="{_HEIGHT:g}" font-family="DejaVu Sans, Arial, sans-serif" '
        f'font-size="12" fill="{INK}">',
        _style(count, shown_in),
        f'<rect width="{_WIDTH:g}" height="{_HEIGHT:g}" fill="white"/>',
        _text(12, 22, title, size=16, weight="bold"),
        _text(12, 42, "; ".join(w for w in (subtitle, _speed(steps, shown_in)) if w), fill=QUIET),
        '<clipPath id="panel"><rect x="{}" y="{}" width="{}" height="{}"/></clipPath>'.format(
            *_ROBOT
        ),
        *_key(steps),
        *_footfall(steps),
    ]
    for k in range(count):
        delay = shown_in * k / count - (shown_in if k else 0.0)
        lines.append(
            f'<g class="{"k first" if k == 0 else "k"}" style="animation-delay:{delay:.3f}s">'
        )
        lines += [*_ground(steps, k, robot), *_robot(steps, k, robot), *_support(steps, k, above)]
        lines += [_cursor(steps, k), "</g>"]
    return "\n".join([*lines, "</svg>", ""])


def _style(count: int, shown_in: float) -> str:
    return (
        "<style>"
        f".k{{visibility:hidden;animation:show {shown_in:g}s step-end infinite}}"
        f"@keyframes show{{0%{{visibility:visible}}{100 / count:.4f}%{{visibility:hidden}}}}"
        "@media print{.k{animation:none}.first{visibility:visible}}"
        "@media (prefers-reduced-motion:reduce){.k{animation:none}.first{visibility:visible}}"
        "</style>"
    )


def _speed(steps: Steps, shown_in: float) -> str:
    if abs(shown_in - steps.period) < 1e-9:
        return f"one cycle of {number(steps.period)} s at its own speed"
    return f"one cycle of {number(steps.period)} s, shown in {number(shown_in)} s"


class _Fit:
    """From a view's metres to a panel's pixels."""

    def __init__(self, view: View, low: Array, high: Array, panel: Sequence[float]) -> None:
        left, top, width, height = panel
        self.view = view
        self.scale = min(width / (high[0] - low[0]), height / (high[1] - low[1]))
        self.left = left + width / 2 - self.scale * (low[0] + high[0]) / 2
        self.top = top + height / 2 + self.scale * (low[1] + high[1]) / 2

    def __call__(self, points: Array) -> Array:
        """World points to pixels and nearness, shape (..., 3)."""
        seen = self.view.project(points)
        x, y = self.left + self.scale * seen[..., 0], self.top - self.scale * seen[..., 1]
        return np.stack([x, y, seen[..., 2]], axis=-1)


def _fitted(view: View, points: Array, panel: Sequence[float]) -> _Fit:
    seen = view.project(points)[:, :2]
    return _Fit(view, seen.min(axis=0), seen.max(axis=0) + 1e-9, panel)


def _robot_points(steps: Steps) -> Array:
    bodies = [body.points.reshape(-1, 3) for body in steps.bodies]
    tips = (steps.feet + _force_scale(steps) * steps.force).reshape(-1, 3)
    return np.concatenate([*bodies, steps.feet.reshape(-1, 3), tips])


def _flat(steps: Steps) -> Array:
    trunk = [body.points.reshape(-1, 3) for body in steps.bodies if not body.leg]
    points = np.concatenate([steps.feet.reshape(-1, 3), *trunk])
    room = 0.08 * np.ptp(points, axis=0)
    return np.concatenate([points + room, points - room])


def _size(steps: Steps) -> float:
    points = np.concatenate([body.points[0] for body in steps.bodies] + [steps.feet[0]])
    return float(np.ptp(points, axis=0).max())


def _force_scale(steps: Steps) -> float:
    """Metres per newton."""
    largest = float(np.linalg.norm(steps.force, axis=-1).max())
    return _FORCE * _size(steps) / largest if largest > 0 else 0.0


def _robot(steps: Steps, k: int, fit: _Fit) -> Iterable[str]:
    """Bodies from the farthest to the nearest, joints' torques on them, forces in front."""
    drawn = []
    for body in steps.bodies:
        seen = fit(body.points[k])
        if body.leg:
            stands = bool(steps.stands[k, steps.legs.index(body.leg)])
            fill = BLUE if stands else VERMILION
        else:
            fill = YELLOW if body.load else _GREY
        drawn.append((float(seen[:, 2].mean()), _polygon(outline(seen[:, :2]), fill)))
    yield '<g stroke="white" stroke-width="1" stroke-linejoin="round">'
    yield from (text for _, text in sorted(drawn))
    yield "</g>"
    largest = float(np.abs(steps.torque).max()) or 1.0
    for at, torque in zip(fit(steps.joints[k]), steps.torque[k], strict=True):
        radius = _TORQUE * _size(steps) * fit.scale * np.sqrt(abs(float(torque)) / largest)
        if radius > 0.5:
            yield (
                f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="{radius:.1f}" fill="{INK}" '
                'fill-opacity=".55"/>'
            )
    tips = fit(steps.feet[k] + _force_scale(steps) * steps.force[k])
    for foot, tip, stands in zip(fit(steps.feet[k]), tips, steps.stands[k], strict=True):
        if stands:
            yield _arrow(foot, tip)


def _arrow(start: Array, end: Array) -> str:
    """A line with a head at its end [px]."""
    run = end[:2] - start[:2]
    length = float(np.hypot(*run))
    if length < 2:
        return ""
    along, head = run / length, min(9.0, length)
    side, back = np.array([-along[1], along[0]]) * head * 0.4, end[:2] - head * along
    tip = np.array([end[:2], back + side, back - side])
    return (
        f'<path d="M{start[0]:.1f} {start[1]:.1f}L{back[0]:.1f} {back[1]:.1f}" stroke="{GREEN}" '
        f'stroke-width="2.5"/>{_polygon(tip, GREEN)}'
    )


def _ground(steps: Steps, k: int, fit: _Fit) -> Iterable[str]:
    """Lines on the ground across the way, which pass below as the robot moves over them."""
    way = (steps.origin[-1] - steps.origin[0]) * steps.time.size / max(steps.time.size - 1, 1)
    size = _size(steps)
    height = steps.feet[steps.stands][:, 2].min()
    distance = float(np.hypot(*way[:2]))
    if distance < 0.02 * size:
        return
    along = np.array([way[0], way[1], 0.0]) / distance
    across = np.array([-along[1], along[0], 0.0])
    rise = way[2] / distance
    spacing = distance / max(1, round(distance / (0.25 * size)))
    moved = float((steps.origin[k] - steps.origin[0]) @ along)
    middle = steps.feet[:, :, :].reshape(-1, 3).mean(axis=0)
    half = 0.6 * size
    yield f'<g stroke="{FAINT}" stroke-width="1" clip-path="url(#panel)">'
    for j in range(int(np.ceil((moved - half) / spacing)), int((moved + half) / spacing) + 1):
        away = j * spacing - moved
        centre = np.array([middle[0], middle[1], 0.0]) + away * along
        centre[2] = _level(steps, k, centre, height, rise, along)
        a, b = fit(np.array([centre - 0.4 * size * across, centre + 0.4 * size * across]))
        yield f'<path d="M{a[0]:.1f} {a[1]:.1f}L{b[0]:.1f} {b[1]:.1f}"/>'
    yield "</g>"


def _level(steps: Steps, k: int, at: Array, height: float, rise: float, along: Array) -> float:
    """Height of the ground at a place: the lowest foot's, or the slope's through a standing one."""
    if abs(rise) < 1e-6:
        return height
    foot = steps.feet[k][steps.stands[k]][0]
    return float(foot[2] + rise * ((at - foot) @ along))


def _support(steps: Steps, k: int, fit: _Fit) -> Iterable[str]:
    """Trunk, support polygon, feet and centre of mass from above."""
    for body in steps.bodies:
        if not body.leg:
            yield _polygon(outline(fit(body.points[k])[:, :2]), SHADE, f' stroke="{FAINT}"')
    feet = fit(steps.feet[k])[:, :2]
    standing = feet[steps.stands[k]]
    if len(standing) > 2:
        yield _polygon(outline(standing), BLUE, f' fill-opacity=".22" stroke="{BLUE}"')
    for foot, stands in zip(feet, steps.stands[k], strict=True):
        look = f'fill="{BLUE}"' if stands else f'fill="white" stroke="{VERMILION}"'
        yield f'<circle cx="{foot[0]:.1f}" cy="{foot[1]:.1f}" r="4.5" {look}/>'
    x, y = fit(steps.mass_centre[k])[:2]
    yield (
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5.5" fill="white" stroke="{INK}"/>'
        f'<path d="M{x - 5.5:.1f} {y:.1f}h11M{x:.1f} {y - 5.5:.1f}v11" stroke="{INK}"/>'
    )
    yield _text(
        _ABOVE[0] + _ABOVE[2],
        _ABOVE[1] + _ABOVE[3] + 18,
        f"t = {steps.time[k]:.2f} s, stability margin {number(1e3 * float(steps.margin[k]))} mm",
        anchor="end",
        fill=QUIET,
    )


def _key(steps: Steps) -> Iterable[str]:
    x, y = _ROBOT[0] + 2, _ROBOT[1] + _ROBOT[3] + 18
    force = number(float(np.linalg.norm(steps.force, axis=-1).max()))
    torque = number(float(np.abs(steps.torque).max()))
    words = (
        ("standing", BLUE),
        ("in the air", VERMILION),
        (f"ground force up to {force} N", GREEN),
    )
    for text, color in (*words, (f"disc: torque up to {torque} N·m", QUIET)):
        yield _text(x, y, text, size=11, fill=color, weight="bold")
        x += 7.2 * len(text) + 12


def _footfall(steps: Steps) -> Iterable[str]:
    left, top, width, height = _FALL
    row = height / len(steps.legs)
    for i, leg in enumerate(steps.legs):
        y = top + row * (i + 0.5)
        yield _text(left - 8, y + 4, leg.upper(), anchor="end", size=min(11.0, 0.95 * row))
        yield f'<path d="M{left} {y:.1f}h{width}" stroke="{VERMILION}"/>'
        for first, last in _runs(steps.stands[:, i]):
            x, w = left + width * first / steps.time.size, width * (last - first) / steps.time.size
            yield (
                f'<rect x="{x:.1f}" y="{y - 0.32 * row:.1f}" width="{w:.1f}" '
                f'height="{0.64 * row:.1f}" fill="{BLUE}"/>'
            )
    yield _text(left, top + height + 20, "0", fill=QUIET)
    end = f"{number(steps.period)} s"
    yield _text(left + width, top + height + 20, end, anchor="end", fill=QUIET)
    words = "footfall: bar = foot on the ground"
    yield _text(left + width / 2, top + height + 20, words, anchor="middle", fill=QUIET)


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and one after the last of every run of true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _cursor(steps: Steps, k: int) -> str:
    left, top, width, height = _FALL
    x = left + width * (k + 0.5) / steps.time.size
    return f'<path d="M{x:.1f} {top - 4:.1f}v{height + 8:.1f}" stroke="{INK}" stroke-width="1.5"/>'


def _polygon(points: Array, fill: str, more: str = "") -> str:
    corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in points[:, :2])
    return f'<polygon points="{corners}" fill="{fill}"{more}/>'


def _text(
    x: float,
    y: float,
    words: str,
    *,
    size: float = 12.0,
    anchor: str = "start",
    fill: str = INK,
    weight: str = "normal",
) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size:g}" text-anchor="{anchor}" '
        f'fill="{fill}" font-weight="{weight}">{escape(words)}</text>'
    )
