"""Stances that no forces can satisfy, named with instant, foot, margin and what to do about it.

Slope, payload and a shift of the body each move the centre of mass over the feet. How far towards
the edge over which the robot tips is a matter of geometry: with and without each of them.
"""

from __future__ import annotations

import numpy as np

from actuators.arrays import Array
from pipeline.dynamics.force_rules import held_by_friction, internal_basis, least_friction
from pipeline.errors import SlidingError, TippingError
from pipeline.motion.gait import body_rotation, gait_of, gait_table
from pipeline.motion.motion import Segment
from pipeline.motion.support import stability_margins, stance_and_centre, support_edges
from pipeline.robot.robot import Robot

#: Less than that towards the edge is no cause [m].
_NOTABLE = 1e-3
#: Share of the largest force: a foot that is exactly unloaded (a tripod at the edge of its
#: stability) still stands, and one on its cone's surface still holds.
_ROUNDING = 1e-9


def refuse_falling(
    robot: Robot, segment: Segment, force: Array, feet: Array, friction_coefficient: float | None
) -> None:
    """Refuse forces that break a bound, as they do only where no forces are within them.

    `force`: on the standing feet, z along the ground's normal [N], shape (N, K, 3). `feet`: in the
    same frame [m], shape (N, K, 3). `friction_coefficient`: None for no limit.

    Raises:
        TippingError: A foot would have to pull.
        SlidingError: The feet would slide.
    """
    normal = force[..., 2]
    lowest = float(normal.min())  # NaN where any force is
    if not np.isfinite(lowest):
        raise TippingError(
            f"the robot tips: in '{segment.name}' the feet stand in one line and carry no moment "
            "across it; stand on feet of both sides"
        )
    slack = _ROUNDING * max(1.0, float(np.abs(normal).max()))
    if lowest < -slack:
        sample, foot = np.argwhere(normal <= lowest + slack)[0]  # the first of those alike
        margin = stability_margins(robot, segment)[sample]
        raise TippingError(
            f"the robot tips at t = {segment.time[sample]:.4g} s ({segment.name}): the foot of leg "
            f"'{segment.stance[foot]}' would have to pull with {-lowest:.1f} N, "
            f"{_margin_and_remedy(robot, segment, int(sample), float(margin))}"
        )
    if friction_coefficient is None:
        return
    beyond = np.hypot(force[..., 0], force[..., 1]) - friction_coefficient * normal
    sliding = np.flatnonzero(beyond.max(axis=1) > slack)
    if sliding.size:
        most, worst = friction_coefficient, int(sliding[0])
        tangential, normal = np.hypot(force[..., 0], force[..., 1]), force[..., 2]
        endless = np.where(tangential > 0, np.inf, 0.0)
        ratio = np.divide(tangential, normal, out=endless, where=normal > 0)
        bases = internal_basis(feet[sliding])
        for row, basis in zip(sliding, bases, strict=True):
            if held_by_friction(force[row], basis, most) is None:
                most, worst = least_friction(force[row], basis, float(ratio[row].max())), int(row)
        foot = segment.stance[int(ratio[worst].argmax())]
        raise SlidingError(
            f"the robot slides at t = {segment.time[worst]:.4g} s ({segment.name}), the foot of "
            f"leg '{foot}' first: no forces hold with a friction coefficient below {most:.3g}, "
            f"{friction_coefficient:g} is given ({most - friction_coefficient:.3g} short); lessen "
            "slope or acceleration, or give the coefficient of a rougher ground"
        )


def _margin_and_remedy(robot: Robot, segment: Segment, sample: int, margin: float) -> str:
    """How much margin there is, what takes it, and what to change so that the robot stands."""
    words = f"static margin {1e3 * margin:.1f} mm"
    if segment.foot_target is None:
        return f"{words}; check which feet stand, or shift the body towards them"
    said = [
        f"{what} takes {1e3 * -inward:.0f} mm ({how})"
        for inward, what, how in sorted(_shifts(robot, segment, sample))
        if inward < -_NOTABLE
    ]
    general = ["spread the feet", "shorten the stroke"]
    if margin > 0:  # the bodies' acceleration tips it
        general.append("walk slower (gait.period)")
    if segment.time.size > 1 and gait_of(robot.spec).margin is None:
        general.append('let the body sway (gait.sway = "least")')
    remedy = f"{', '.join(general[:-1])} or {general[-1]}"
    return f"{words}: {', '.join(said)}; or {remedy}" if said else f"{words}; {remedy}"


def _shifts(robot: Robot, segment: Segment, sample: int) -> list[tuple[float, str, str]]:
    """By how much each cause moves the centre of mass inwards [m], what it is, what to change."""
    table = gait_table(robot.spec)
    rotation = robot.base_rotation(segment.configuration[[sample]])
    turn = np.eye(3) if rotation is None else rotation[0]
    feet, centre = (x[sample] for x in stance_and_centre(robot, segment))
    edges = support_edges(feet[None])
    distance = np.where(edges.used, edges.distance(centre[None, :2]), np.inf)[0]
    inward = edges.inward[0, int(distance.argmin())]
    normal = segment.ground_normal
    height = (centre - feet[0]) @ normal
    slopes = [key for key in ("slope_forward", "slope_left") if getattr(table, key)]
    # Down along the normal instead of plumb: where the centre would stand on level ground.
    found = [(height * (normal - [0, 0, 1 / normal[2]]), "the slope", "lessen", slopes)]
    if table.payload_mass:
        place = turn @ [table.payload_x, table.payload_y, table.payload_z]
        share = table.payload_mass / (robot.mass - table.payload_mass)
        keys = ["payload_mass", *(f"payload_{x}" for x in "xyz" if getattr(table, f"payload_{x}"))]
        found.append((share * (place - centre), "the payload", "change", keys))
    shifts = [key for key in ("body_x", "body_y") if getattr(table, key)]
    ahead = turn @ body_rotation(table).T @ [table.body_x, table.body_y, 0.0]
    found.append((ahead, "the body's shift", "change", shifts))
    return [
        (float(inward @ by[:2]), what, f"{verb} {' or '.join(f'gait.{key}' for key in keys)}")
        for by, what, verb, keys in found
        if keys
    ]
