"""Torque recomputed from URDF and CSV files alone, with an inverse dynamics written out here."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from pipeline.robot.robot_file import load_robot_file
from tests.command_line import exit_code, rows_of

GRAVITY = np.array([0.0, 0.0, -9.81])


def turn(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Rotations about a unit axis by angles (N,), shape (N, 3, 3)."""
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + s * k + (1 - c) * (k @ k)


def fixed(rpy: list[float]) -> np.ndarray:
    x, y, z = (turn(axis, np.array([a]))[0] for axis, a in zip(np.eye(3), rpy, strict=True))
    return z @ y @ x


def numbers(element: ET.Element | None, key: str, default: str) -> list[float]:
    text = default if element is None else element.get(key, default)
    return [float(x) for x in text.split()]


@dataclass
class Body:
    """A link in the world over time, all (N, 3) but the rotation (N, 3, 3)."""

    place: np.ndarray
    rotation: np.ndarray
    spin: np.ndarray
    spin_rate: np.ndarray
    acceleration: np.ndarray

    def point(self, at: np.ndarray) -> np.ndarray:
        return self.place + self.rotation @ at

    def acceleration_of(self, at: np.ndarray) -> np.ndarray:
        arm = self.rotation @ at
        whirl = np.cross(self.spin, np.cross(self.spin, arm))
        return self.acceleration + np.cross(self.spin_rate, arm) + whirl


class Tables:
    """The CSV files of a walk."""

    def __init__(self, folder: Path) -> None:
        self.rows = {
            name: rows_of(folder / f"walking_{name}.csv")
            for name in ("base", "joint_demand", "contact_forces")
        }

    def of(self, table: str, *headers: str) -> np.ndarray:
        return np.array([[float(row[h]) for h in headers] for row in self.rows[table]])

    def base(self) -> Body:
        roll, pitch, yaw = self.of("base", *(f"base__{a}_rad" for a in ("roll", "pitch", "yaw"))).T
        x, y, z = np.eye(3)
        spin = self.of("base", *(f"base__angular_velocity_{a}_rad_s" for a in "xyz"))
        return Body(
            self.of("base", *(f"base__{a}_m" for a in "xyz")),
            turn(z, yaw) @ turn(y, pitch) @ turn(x, roll),
            spin,
            np.zeros_like(spin),
            self.of("base", *(f"base__acceleration_{a}_m_s2" for a in "xyz")),
        )


def torques(
    urdf: ET.Element, root: str, tables: Tables, feet: dict[str, str]
) -> dict[str, np.ndarray]:
    """Newton and Euler, link by link: what every joint must bear of what hangs on it."""
    joints = {j.find("child").get("link"): j for j in urdf.findall("joint")}  # type: ignore[union-attr]
    links = {link.get("name"): link for link in urdf.findall("link")}
    bodies: dict[str, Body] = {root: tables.base()}
    axes: dict[str, np.ndarray] = {}

    def body(name: str) -> Body:
        if name not in bodies:
            joint = joints[name]
            parent = body(joint.find("parent").get("link"))  # type: ignore[union-attr,arg-type]
            origin = joint.find("origin")
            at = np.array(numbers(origin, "xyz", "0 0 0"))
            rotation = parent.rotation @ fixed(numbers(origin, "rpy", "0 0 0"))
            place, acceleration = parent.point(at), parent.acceleration_of(at)
            spin, rate = parent.spin, parent.spin_rate
            if joint.get("type") != "fixed":
                axis = np.array(numbers(joint.find("axis"), "xyz", "1 0 0"))
                units = ("position_rad", "velocity_rad_s", "acceleration_rad_s2")
                q, v, a = (
                    tables.of("joint_demand", f"{joint.get('name')}__{unit}")[:, 0]
                    for unit in units
                )
                axes[name] = world = rotation @ axis
                rotation = rotation @ turn(axis, q)
                rate = rate + world * a[:, None] + np.cross(spin, world * v[:, None])
                spin = spin + world * v[:, None]
            bodies[name] = Body(place, rotation, spin, rate, acceleration)
        return bodies[name]

    loads = []  # chain of links, where, force and moment that the chain must supply
    for name, link in links.items():
        assert name is not None
        here, inertial = body(name), link.find("inertial")
        if inertial is not None:
            origin, i = inertial.find("origin"), inertial.find("inertia")
            mass = float(inertial.find("mass").get("value"))  # type: ignore[union-attr,arg-type]
            at = np.array(numbers(origin, "xyz", "0 0 0"))
            xx, yy, zz, xy, xz, yz = (
                float(i.get(k)) for k in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
            )  # type: ignore[union-attr,arg-type]
            own = fixed(numbers(origin, "rpy", "0 0 0"))
            own = own @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ own.T
            inertia = here.rotation @ own @ here.rotation.swapaxes(1, 2)
            force = mass * (here.acceleration_of(at) - GRAVITY)
            momentum = np.einsum("nij,nj->ni", inertia, here.spin)
            moment = np.einsum("nij,nj->ni", inertia, here.spin_rate)
            loads.append((name, here.point(at), force, moment + np.cross(here.spin, momentum)))
    for leg, foot in feet.items():
        force = tables.of("contact_forces", *(f"{leg}__force_{a}_N" for a in "xyz"))
        loads.append((foot, body(foot).place, -force, np.zeros_like(force)))

    out = {joints[name].get("name"): np.zeros(len(axis)) for name, axis in axes.items()}
    rest = [np.zeros_like(loads[0][1]) for _ in range(2)]
    for link, place, force, moment in loads:
        name = link
        while name != root:
            if name in axes:
                whole = moment + np.cross(place - body(name).place, force)
                out[joints[name].get("name")] += (axes[name] * whole).sum(axis=1)
            name = joints[name].find("parent").get("link")  # type: ignore[union-attr,assignment]
        rest[0] += force
        rest[1] += moment + np.cross(place, force)
    # Nothing but the ground carries the base.
    np.testing.assert_allclose(rest[0], 0, atol=1e-7)
    np.testing.assert_allclose(rest[1], 0, atol=1e-7)
    return out  # type: ignore[return-value]


@pytest.mark.parametrize(
    "gait",
    [
        (),
        ("name=ripple", "speed=0.05 m/s", "yaw_rate=9 deg/s", "slope_forward=6 deg")
        + ("slope_left=3 deg", "body_pitch=2 deg"),
        ("name=wave", "sway=least", "stability_margin=120 mm", "heading=30 deg"),
    ],
    ids=["tripod", "ripple in a bend on a slope", "wave with sway"],
)
def test_anyone_can_check_torque_from_the_tables_alone(
    root: Path, tmp_path: Path, gait: tuple[str, ...]
) -> None:
    spec = load_robot_file(root / "urdf" / "hexapod.toml")
    options = [word for change in gait for word in ("--set", f"gait.{change}")]
    out = tmp_path / "walk"
    assert exit_code(["walk", "--samples", "51", "--out", str(out), *options]) == 0
    tables = Tables(out)
    feet = {leg.name: leg.foot for leg in spec.legs}
    found = torques(ET.parse(spec.urdf).getroot(), spec.base_link, tables, feet)
    for joint in spec.joints:
        given = tables.of("joint_demand", f"{joint}__torque_Nm")[:, 0]
        np.testing.assert_allclose(found[joint], given, atol=1e-8)
