"""The gait in motion as one SVG that needs no script: a cycle of steps shown one after the other.

Each step is a group of shapes; a style sheet shows one group at a time. In print, and for readers
who ask their system for less motion, the first step stands still.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from html import escape

import numpy as np

from actuators.arrays import Array
from reports.figures.robot.projection import OBLIQUE, TOP, View
from reports.figures.robot.solids import hull_points, outline, reach
from reports.figures.style import BLUE, FAINT, GREEN, INK, QUIET, SHADE, VERMILION, YELLOW
from reports.figures.walk import Steps
from reports.typeset import number

_WIDTH, _HEIGHT = 950.0, 560.0
Panel = tuple[float, float, float, float]
#: Left, top, width and height of the panels [px]: the robot, support from above, footfall.
_ROBOT, _ABOVE = (10.0, 62.0, 590.0, 336.0), (625.0, 62.0, 305.0, 336.0)
_FALL = (70.0, 432.0, 860.0, 96.0)
_GREY = "#8a929a"
#: A cycle is shown in its own time within these bounds [s].
_SHORTEST, _LONGEST = 2.0, 8.0
#: The largest force is drawn this long, and the largest torque as a disc this wide, in sizes of
#: the robot.
_FORCE, _TORQUE = 0.35, 0.045
#: Corners of a body nearer than this share of the robot's size are drawn as one.
_CELL = 0.012


def gait_steps(steps: Steps, *, title: str, subtitle: str = "") -> str:
    """The SVG's text."""
    shown_in = float(np.clip(steps.period, _SHORTEST, _LONGEST))
    pace = "at its own speed"
    if abs(shown_in - steps.period) >= 1e-9:
        pace = f"shown in {number(shown_in)} s"
    comma = "," if pace.startswith("shown") else ""
    words = f"one cycle of {number(steps.period)} s{comma} {pace}"
    picture, count = _Picture(steps), steps.time.size
    x, y, width, height = _ROBOT
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" '
        f'width="{_WIDTH:g}" height="{_HEIGHT:g}" font-family="DejaVu Sans, Arial, sans-serif" '
        f'font-size="12" fill="{INK}">',
        "<style>"
        f".k{{visibility:hidden;animation:show {shown_in:g}s step-end infinite}}"
        f"@keyframes show{{0%{{visibility:visible}}{100 / count:.4f}%{{visibility:hidden}}}}"
        "@media print{.k{animation:none}.first{visibility:visible}}"
        "@media (prefers-reduced-motion:reduce){.k{animation:none}.first{visibility:visible}}"
        "</style>",
        f'<rect width="{_WIDTH:g}" height="{_HEIGHT:g}" fill="white"/>',
        _text(12, 22, title, size=16, weight="bold"),
        _text(12, 42, "; ".join(w for w in (subtitle, words) if w), fill=QUIET),
        f'<clipPath id="panel"><rect x="{x}" y="{y}" width="{width}" height="{height}"/>'
        "</clipPath>",
        *picture.key(),
        *picture.footfall(),
    ]
    for k in range(count):
        delay = shown_in * k / count - (shown_in if k else 0.0)
        kind = "k" if k else "k first"
        lines += [
            f'<g class="{kind}" style="animation-delay:{delay:.3f}s">',
            *picture.ground(k),
            *picture.robot(k),
            *picture.support(k),
            picture.cursor(k),
            "</g>",
        ]
    return "\n".join([*lines, "</svg>", ""])


class _Fit:
    """From a view's metres to a panel's pixels."""

    def __init__(self, view: View, points: Array, panel: Panel) -> None:
        seen = view.project(points)[:, :2]
        low, high = seen.min(axis=0), seen.max(axis=0) + 1e-9
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


class _Picture:
    """Shapes of each step in SVG."""

    def __init__(self, steps: Steps) -> None:
        self.steps = steps
        largest = float(np.linalg.norm(steps.force, axis=-1).max())
        points = np.concatenate([hull[0] for hull in self.hulls] + [steps.feet[0]])
        self.size = float(np.ptp(points, axis=0).max())
        per_newton = _FORCE * self.size / largest if largest > 0 else 0.0
        self.tips = steps.feet + per_newton * steps.force
        feet = steps.feet.reshape(-1, 3)
        bodies = [hull.reshape(-1, 3) for hull in self.hulls]
        everything = np.concatenate([*bodies, feet, self.tips.reshape(-1, 3)])
        trunks = [h for h, body in zip(bodies, steps.bodies, strict=True) if not body.leg]
        flat = np.concatenate([feet, *trunks])
        room = 0.08 * np.ptp(flat, axis=0)
        self.fit = _Fit(OBLIQUE, everything, _ROBOT)
        self.above = _Fit(TOP, np.concatenate([flat + room, flat - room]), _ABOVE)

    @cached_property
    def hulls(self) -> list[Array]:
        """Corners of every body's convex hull in each step, shape (S, P, 3) [m]."""
        bodies = self.steps.bodies
        cell = _CELL * reach([solid for body in bodies for solid in body.solids])
        out = []
        for body in bodies:
            corners = hull_points(np.concatenate([s.corners for s in body.solids]), cell)
            out.append(corners @ body.rotation.transpose(0, 2, 1) + body.position[:, None])
        return out

    def robot(self, k: int) -> Iterator[str]:
        """Bodies from the farthest to the nearest, joints' torques on them, forces in front."""
        steps, drawn = self.steps, []
        for body, hull in zip(steps.bodies, self.hulls, strict=True):
            seen = self.fit(hull[k])
            fill = YELLOW if body.load else _GREY
            if body.leg:
                fill = BLUE if steps.stands[k, steps.legs.index(body.leg)] else VERMILION
            drawn.append((float(seen[:, 2].mean()), _polygon(outline(seen[:, :2]), fill)))
        yield '<g stroke="white" stroke-width="1" stroke-linejoin="round">'
        yield from (text for _, text in sorted(drawn))
        yield "</g>"
        share = np.abs(steps.torque[k]) / (float(np.abs(steps.torque).max()) or 1.0)
        radii = _TORQUE * self.size * self.fit.scale * np.sqrt(share)
        for at, radius in zip(self.fit(steps.places[k]), radii, strict=True):
            if radius > 0.5:
                yield (
                    f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="{radius:.1f}" fill="{INK}" '
                    'fill-opacity=".55"/>'
                )
        ends = zip(self.fit(steps.feet[k]), self.fit(self.tips[k]), steps.stands[k], strict=True)
        yield from (_arrow(foot, tip) for foot, tip, stands in ends if stands)

    def ground(self, k: int) -> Iterator[str]:
        """Lines on the ground across the way, which pass below as the robot moves over them."""
        steps, size = self.steps, self.size
        way = (steps.origin[-1] - steps.origin[0]) * steps.time.size / max(steps.time.size - 1, 1)
        distance = float(np.hypot(*way[:2]))
        if distance < 0.02 * size:
            return
        along = np.array([way[0], way[1], 0.0]) / distance
        across = np.array([-along[1], along[0], 0.0])
        rise, half = way[2] / distance, 0.6 * size
        spacing = distance / max(1, round(distance / (0.25 * size)))
        moved = float((steps.origin[k] - steps.origin[0]) @ along)
        middle = steps.feet.reshape(-1, 3).mean(axis=0) * [1, 1, 0]
        standing = steps.feet[k][steps.stands[k]]
        yield f'<g stroke="{FAINT}" stroke-width="1" clip-path="url(#panel)">'
        for j in range(int(np.ceil((moved - half) / spacing)), int((moved + half) / spacing) + 1):
            centre = middle + (j * spacing - moved) * along
            if abs(rise) < 1e-6:  # the lowest foot's height, else the slope's through a foot
                centre[2] = steps.feet[steps.stands][:, 2].min()
            else:
                centre[2] = standing[0, 2] + rise * ((centre - standing[0]) @ along)
            a, b = self.fit(np.array([centre - 0.4 * size * across, centre + 0.4 * size * across]))
            yield f'<path d="M{a[0]:.1f} {a[1]:.1f}L{b[0]:.1f} {b[1]:.1f}"/>'
        yield "</g>"

    def support(self, k: int) -> Iterator[str]:
        """Trunk, support polygon, feet and centre of mass from above."""
        steps = self.steps
        for body, hull in zip(steps.bodies, self.hulls, strict=True):
            if not body.leg:
                edge = f' stroke="{FAINT}"'
                yield _polygon(outline(self.above(hull[k])[:, :2]), SHADE, edge)
        feet = self.above(steps.feet[k])[:, :2]
        standing = feet[steps.stands[k]]
        if len(standing) > 2:
            yield _polygon(outline(standing), BLUE, f' fill-opacity=".22" stroke="{BLUE}"')
        for foot, stands in zip(feet, steps.stands[k], strict=True):
            look = f'fill="{BLUE}"' if stands else f'fill="white" stroke="{VERMILION}"'
            yield f'<circle cx="{foot[0]:.1f}" cy="{foot[1]:.1f}" r="4.5" {look}/>'
        x, y = self.above(steps.mass_centre[k])[:2]
        yield (
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5.5" fill="white" stroke="{INK}"/>'
            f'<path d="M{x - 5.5:.1f} {y:.1f}h11M{x:.1f} {y - 5.5:.1f}v11" stroke="{INK}"/>'
        )
        left, top, width, height = _ABOVE
        margin = number(1e3 * float(steps.margin[k]))
        words = f"t = {steps.time[k]:.2f} s, stability margin {margin} mm"
        yield _text(left + width, top + height + 18, words, anchor="end", fill=QUIET)

    def key(self) -> Iterator[str]:
        """What colours mean, and the largest force and torque."""
        x, y = _ROBOT[0] + 2, _ROBOT[1] + _ROBOT[3] + 18
        force = number(float(np.linalg.norm(self.steps.force, axis=-1).max()))
        torque = number(float(np.abs(self.steps.torque).max()))
        for text, color in (
            ("standing", BLUE),
            ("in the air", VERMILION),
            (f"ground force up to {force} N", GREEN),
            (f"disc: torque up to {torque} N·m", QUIET),
        ):
            yield _text(x, y, text, size=11, fill=color, weight="bold")
            x += 7.2 * len(text) + 12

    def footfall(self) -> Iterator[str]:
        """A row for each leg, with bars while it stands."""
        steps, (left, top, width, height) = self.steps, _FALL
        row = height / len(steps.legs)
        for i, leg in enumerate(steps.legs):
            y = top + row * (i + 0.5)
            yield _text(left - 8, y + 4, leg.upper(), anchor="end", size=min(11.0, 0.95 * row))
            yield f'<path d="M{left} {y:.1f}h{width}" stroke="{VERMILION}"/>'
            changes = np.diff(np.concatenate([[0], steps.stands[:, i].astype(int), [0]]))
            for first, last in np.flatnonzero(changes).reshape(-1, 2):
                x, w = (width * samples / steps.time.size for samples in (first, last - first))
                yield (
                    f'<rect x="{left + x:.1f}" y="{y - 0.32 * row:.1f}" width="{w:.1f}" '
                    f'height="{0.64 * row:.1f}" fill="{BLUE}"/>'
                )
        below = top + height + 20
        yield _text(left, below, "0", fill=QUIET)
        yield _text(left + width, below, f"{number(steps.period)} s", anchor="end", fill=QUIET)
        words = "footfall: bar = foot on the ground"
        yield _text(left + width / 2, below, words, anchor="middle", fill=QUIET)

    def cursor(self, k: int) -> str:
        """Where in the cycle a step is."""
        left, top, width, height = _FALL
        x = left + width * (k + 0.5) / self.steps.time.size
        line = f"M{x:.1f} {top - 4:.1f}v{height + 8:.1f}"
        return f'<path d="{line}" stroke="{INK}" stroke-width="1.5"/>'


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
