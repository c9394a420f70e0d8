"""Joint positions of a leg of three revolute joints whose last two axes are parallel.

With u the direction of axes 2 and 3, turning them leaves the foot's coordinate along u alone: that
gives the first angle, ``A cos q1 + B sin q1 = C``, with two solutions (the leg on this side of its
hip or across it). What remains is a triangle in the plane square to u: the law of cosines gives the
third angle, again with two solutions (the knee's branches), and the second follows. Of the first
angle's solutions the one nearer to a start posture is taken; the knee bends as it does there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.robot.leg_chains import LegChains

_PARALLEL = 1e-12  # sine of the angle between axes 2 and 3: the result is as exact as they are
_ACROSS = 1e-3  # sine of the angle between axes 1 and 2: below, the first angle is ill-determined
#: Sine of an angle below which a start posture stands at the border of two branches.
_UNDECIDED = 1e-6


@dataclass(frozen=True)
class _Planar:
    """What of the geometry the solution needs, for legs that have one.

    Attributes:
        legs: Their indices, shape (M,).
        axis_1: In its own frame, shape (M, 3).
        u: Direction of axes 2 and 3 in the frame that joint 1 turns, shape (M, 3).
        level: The foot's coordinate along u [m], shape (M,).
        hip: Origin of joint 2 in the frame that joint 1 turns [m], shape (M, 3).
        e1, e2: Two directions square to u that with it make a right-handed frame, (M, 3).
        thigh: From joint 2 to joint 3 at q2 = 0, as a complex number in that plane [m], (M,).
        shank: From joint 3 to the foot at q2 = q3 = 0, likewise.
        sign_3: Whether axis 3 points along u (1) or against it (-1), shape (M,).
    """

    legs: NDArray[np.intp]
    axis_1: Array
    u: Array
    level: Array
    hip: Array
    e1: Array
    e2: Array
    thigh: NDArray[np.complex128]
    shank: NDArray[np.complex128]
    sign_3: Array


@lru_cache
def _planar(chains: LegChains) -> _Planar | None:
    if chains.depth < 3:
        return None
    axis_3 = np.einsum("lij,lj->li", chains.rotation[2], chains.axis[2])  # in frame 2
    parallel = np.linalg.norm(np.cross(chains.axis[1], axis_3), axis=1) < _PARALLEL
    u = np.einsum("lij,lj->li", chains.rotation[1], chains.axis[1])  # in frame 1
    across = np.linalg.norm(np.cross(chains.axis[0], u), axis=1) > _ACROSS
    legs = np.flatnonzero(parallel & across & (chains.counts == 3) & ~chains.slides.any(axis=0))
    own, u = chains.of(legs.tolist()), u[legs]
    e1 = np.cross(u, np.eye(3)[np.argmin(np.abs(u), axis=1)])
    e1 /= np.linalg.norm(e1, axis=1, keepdims=True)
    e2 = np.cross(u, e1)
    thigh = np.einsum("lij,lj->li", own.rotation[1], own.offset[2])
    shank = np.einsum("lij,ljk,lk->li", own.rotation[1], own.rotation[2], own.foot)
    return _Planar(
        legs=legs,
        axis_1=own.axis[0],
        u=u,
        level=np.einsum("li,li->l", u, own.offset[1] + thigh + shank),
        hip=own.offset[1],
        e1=e1,
        e2=e2,
        thigh=_in_plane(thigh, e1, e2),
        shank=_in_plane(shank, e1, e2),
        sign_3=np.sign(np.einsum("li,li->l", own.axis[1], axis_3[legs])),
    )


def _in_plane(v: Array, e1: Array, e2: Array) -> NDArray[np.complex128]:
    out: NDArray[np.complex128] = (v * e1).sum(-1) + 1j * (v * e2).sum(-1)
    return out


def closed_form_legs(chains: LegChains, start: Array) -> NDArray[np.intp]:
    """Indices of the legs that have a closed form and whose start posture names their branches.

    Args:
        chains: The legs.
        start: Posture, shape (L, K) [rad].
    """
    planar = _planar(chains)
    if planar is None:
        return np.zeros(0, dtype=np.intp)
    return planar.legs[_knee(planar, start) != 0]


def _knee(planar: _Planar, start: Array) -> Array:
    """On which side of the line from hip to foot the knee lies, (M,): 1, -1, or 0 when on it."""
    bend = planar.sign_3 * start[planar.legs, 2] + np.angle(planar.shank) - np.angle(planar.thigh)
    no_triangle = np.minimum(np.abs(planar.thigh), np.abs(planar.shank)) == 0
    side = np.sin(bend)
    return np.where((np.abs(side) < _UNDECIDED) | no_triangle, 0.0, np.sign(side))


def closed_form(chains: LegChains, legs: NDArray[np.intp], target: Array, start: Array) -> Array:
    """Joint positions that bring the feet of some legs to their targets.

    Args:
        chains: All legs.
        legs: Those from `closed_form_legs`, shape (M,); at least one.
        target: Of their feet in the base frame [m], shape (N, M, 3).
        start: Posture of all legs, shape (L, K) [rad].

    Returns:
        Shape (N, M, 3) [rad]; not a number where a foot is out of reach.
    """
    planar = _planar(chains)
    assert planar is not None
    at = np.searchsorted(planar.legs, legs)
    near = start[legs, :3]
    axis, u = planar.axis_1[at], planar.u[at]
    across = np.cross(axis, u)
    along = (axis * u).sum(-1)
    from_hip = target - chains.offset[0, legs]
    t = np.einsum("lji,nlj->nli", chains.rotation[0, legs], from_hip)
    # Rot(q1)^T t . u = level, with u = along*axis + its part square to the axis.
    a = (t * (u - along[:, None] * axis)).sum(-1)
    b = (t * across).sum(-1)
    c = planar.level[at] - along * (t * axis).sum(-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        middle, half = np.arctan2(b, a), np.arccos(c / np.hypot(a, b))
        off = _wrapped(middle - near[:, 0])  # the solution on the side of the start posture
        q1 = middle - np.where(off > 0, half, -half)
        cos, sin = np.cos(q1)[..., None], np.sin(q1)[..., None]
        # The foot in the frame that joint 1 turns, less joint 2's origin.
        p = t * cos - np.cross(axis, t) * sin + axis * ((t * axis).sum(-1)[..., None] * (1 - cos))
        w = _in_plane(p - planar.hip[at], planar.e1[at], planar.e2[at])
        thigh, shank = planar.thigh[at], planar.shank[at]
        one, other = np.abs(thigh), np.abs(shank)
        cosine = (np.abs(w) ** 2 - one**2 - other**2) / (2 * one * other)
        bend = _knee(planar, start)[at] * np.arccos(cosine)
        q3 = planar.sign_3[at] * (bend - np.angle(shank) + np.angle(thigh))
        q2 = np.angle(w) - np.angle(thigh + shank * np.exp(1j * planar.sign_3[at] * q3))
        q = np.stack([q1, q2, q3], axis=-1)
    return near + _wrapped(q - near)


def _wrapped(angle: Array) -> Array:
    """Into half a turn either way."""
    out: Array = angle - 2 * np.pi * np.round(angle / (2 * np.pi))
    return out
