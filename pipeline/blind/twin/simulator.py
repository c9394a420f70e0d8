"""Forward simulation: semi-implicit Euler over rigid bodies, motors, friction and ground.

In each step forces are taken at (q_k, v_k), then v_{k+1} = v_k + a dt and
q_{k+1} = q_k + v_{k+1} dt, so that the second difference of the positions is the acceleration that
the forces of sample k made. Rigid joints carry their motor's inertia in the mass matrix, C^T A C
with coupling C; elastic joints have a motor of their own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv

from pipeline.blind.twin.controller import Controller, ControlLoop, Plan
from pipeline.blind.twin.errors import TwinError
from pipeline.blind.twin.laws.bristle import BristleFriction
from pipeline.blind.twin.laws.ground import Footing, Ground
from pipeline.blind.twin.laws.motor import Motors
from pipeline.blind.twin.laws.transmission import transmitted_torque
from pipeline.blind.twin.plant import Plant

Array = NDArray[np.float64]
#: Joint speed at which a simulation counts as run away [rad/s].
_RUNAWAY = 50.0


@dataclass(frozen=True)
class Record:
    """What truly happened, at every step.

    Attributes:
        dt: Step [s].
        position: Joints [rad], shape (N, J).
        velocity: Joints [rad/s], shape (N, J).
        motor: Motors, at the joint [rad], shape (N, J).
        current: [A], shape (N, J).
        voltage: [V], shape (N, J).
        torque: What reaches the links from the actuators [N*m], shape (N, J).
        temperature_rise: Of the windings [K], shape (N, J).
        base: Position and quaternion (x, y, z, w) of a floating base, shape (N, 7), or None.
        foot_force: Of the ground on the feet, world [N], shape (N, L, 3), or None.
        work: Energy [J] that went where, over the whole simulation.
    """

    dt: float
    position: Array
    velocity: Array
    motor: Array
    current: Array
    voltage: Array
    torque: Array
    temperature_rise: Array
    base: Array | None
    foot_force: Array | None
    work: dict[str, float]

    @property
    def imbalance(self) -> float:
        """Energy that appeared from nowhere, over the energy the motors moved [1]."""
        w = self.work
        lost = w["rotor_friction"] + w["gear_friction"] + w["transmission_damping"]
        stored = w["kinetic"] + w["potential"] + w["transmission"]
        gained = w["motor"] + w["extra"] + w["ground"] - lost - stored
        return gained / max(w["moved"], 1e-12)


class Simulation:
    """One run of a plant under its controller."""

    def __init__(
        self,
        plant: Plant,
        controller: Controller,
        plan: Plan,
        *,
        substeps: int,
        ground: Ground | None = None,
    ) -> None:
        """Store the parts.

        Args:
            plant: The machine.
            controller: Its gains.
            plan: What to follow.
            substeps: Steps of the simulation per sample of the plan.
            ground: Under the feet of a floating base.

        Raises:
            TwinError: A floating base without ground, or a fixed one on it.
        """
        if plant.robot.floating != (ground is not None):
            raise TwinError("a floating base needs ground under it, and a fixed one has none")
        self.plant = plant
        self.controller = controller
        self.plan = plan
        self.ground = ground
        self.substeps = substeps
        self.dt = plan.period / substeps

    def run(self) -> Record:
        """Simulate.

        Returns:
            The record, (samples of the plan - 1) * substeps rows.

        Raises:
            TwinError: A joint ran away.
        """
        plant, dt, model = self.plant, self.dt, self.plant.model
        data = model.createData()
        n = len(plant.joints)
        rows = (self.plan.position.shape[0] - 1) * self.substeps
        iv = plant.robot.velocity_index
        iq = plant.robot.position_index
        legs = self._feet() if self.ground else []
        footing = Footing(self.ground, len(legs), dt) if self.ground else None
        out = {
            name: np.empty((rows, n))
            for name in (
                *("position", "velocity", "motor", "current", "voltage", "torque"),
                "temperature_rise",
            )
        }
        base = np.empty((rows, 7)) if footing else None
        foot_force = np.zeros((rows, len(legs), 3)) if footing else None

        loop = ControlLoop(self.controller, self.plan, plant.machine.ratio, plant.coupling)
        motors = Motors(plant, dt)
        rotor = BristleFriction(plant.rotor, dt)
        gear = BristleFriction(plant.gear, dt)
        extras = [(law.joint, law.start(dt)) for law in plant.extra]
        soft = np.flatnonzero(plant.elastic)
        stiff = np.flatnonzero(~plant.elastic)
        inertia = plant.rotor_inertia
        C = plant.coupling
        stiff_rows = C[stiff]
        reflected = stiff_rows.T @ (inertia[stiff, None] * stiff_rows)
        mass_index = np.ix_(iv, iv)

        q = pin.neutral(model)
        if self.plan.base_position is not None:
            q[:3] = self.plan.base_position
        q[iq] = self.plan.position[0]
        v = np.zeros(model.nv)
        theta = C @ q[iq]
        omega = np.zeros(n)
        load = np.zeros(n)
        zero = np.zeros(n)
        work = dict.fromkeys(
            ("motor", "moved", "rotor_friction", "gear_friction", "extra", "ground"), 0.0
        )
        work["transmission_damping"] = 0.0
        energy_0 = self._energy(data, q, v, theta, omega, soft)
        command = zero
        for k in range(rows):
            if k % self.substeps == 0:
                command = loop.command(k // self.substeps, theta)
            pin.computeAllTerms(model, data, q, v)
            rhs = -data.nle
            if footing is not None and base is not None and foot_force is not None:
                pin.updateFramePlacements(model, data)
                jacobian = np.vstack(
                    [
                        pin.getFrameJacobian(model, data, f, pin.LOCAL_WORLD_ALIGNED)[:3]
                        for f in legs
                    ]
                )
                feet = np.array([data.oMf[f].translation for f in legs])
                force = footing.forces(feet, (jacobian @ v).reshape(-1, 3))
                pushed = jacobian.T @ force.ravel()
                rhs += pushed
                foot_force[k] = force
                base[k] = q[:7]
            angle, speed = q[iq], v[iv]
            drive, current, voltage = motors.step(command, omega)
            drag_rotor = rotor.torque(omega, zero)
            dry = None
            if plant.sticking:
                dry = np.zeros(n)
                for spot in plant.sticking:
                    dry[spot.joint] += spot.level(angle[spot.joint])
            drag_gear = gear.torque(speed, load, dry)
            extra = zero
            if extras:
                extra = np.zeros(n)
                for joint, stepper in extras:
                    extra[joint] += stepper.torque(float(angle[joint]), float(speed[joint]))
            shaft = drive - drag_rotor  # at the motors, rigid ones still without their inertia
            if soft.size:
                twist = theta[soft] - C[soft] @ angle
                rate = omega[soft] - C[soft] @ speed
                spring = transmitted_torque(
                    twist, rate, plant.stiffness[soft], plant.damping[soft], plant.gap[soft]
                )
                motor_acceleration = (shaft[soft] - spring) / inertia[soft]
                shaft[soft] = spring
            rhs[iv] += C.T @ shaft - drag_gear + extra
            M = data.M
            M[mass_index] += reflected
            acceleration = dposv(M, rhs)[1]
            # What the links get: rigid motors have spent some on their own inertia.
            reach = shaft.copy()
            reach[stiff] -= inertia[stiff] * (stiff_rows @ acceleration[iv])
            load = C.T @ reach - drag_gear

            out["position"][k] = angle
            out["velocity"][k] = speed
            out["motor"][k] = theta
            out["current"][k] = current
            out["voltage"][k] = voltage
            out["torque"][k] = load
            out["temperature_rise"][k] = motors.temperature_rise

            v_new = v + acceleration * dt
            theta_step = C @ v_new[iv] * dt
            omega_new = C @ v_new[iv]
            if soft.size:
                omega_new[soft] = omega[soft] + motor_acceleration * dt
                theta_step[soft] = omega_new[soft] * dt
                mean_rate = 0.5 * (rate + omega_new[soft] - C[soft] @ v_new[iv])
                work["transmission_damping"] += dt * float(
                    (spring - self._elastic(twist, soft)) @ mean_rate
                )
            mean_motor = 0.5 * (omega + omega_new)
            mean_joint = 0.5 * (speed + v_new[iv])
            power = drive * mean_motor
            work["motor"] += dt * float(power.sum())
            work["moved"] += dt * float(np.abs(power).sum())
            work["rotor_friction"] += dt * float(drag_rotor @ mean_motor)
            work["gear_friction"] += dt * float(drag_gear @ mean_joint)
            work["extra"] += dt * float(extra @ mean_joint)
            if footing is not None:
                work["ground"] += dt * float(pushed @ (0.5 * (v + v_new)))
            v = v_new
            q = pin.integrate(model, q, v * dt)
            theta = theta + theta_step
            omega = omega_new
            if k % 64 == 0 and not np.all(np.abs(v[iv]) < _RUNAWAY):
                worst = plant.joints[int(np.nanargmax(np.abs(v[iv])))]
                raise TwinError(
                    f"joint '{worst}' ran away at t = {k * dt:.4g} s; take smaller steps or a "
                    "stiffer transmission's smaller size"
                )
        energy_1 = self._energy(data, q, v, theta, omega, soft)
        for name in energy_0:
            work[name] = energy_1[name] - energy_0[name]
        return Record(dt=dt, base=base, foot_force=foot_force, work=work, **out)

    def _feet(self) -> list[int]:
        model = self.plant.model
        return [model.getFrameId(leg.foot) for leg in self.plant.robot.spec.legs]

    def _elastic(self, twist: Array, soft: NDArray[np.intp]) -> Array:
        plant = self.plant
        still = np.zeros(soft.size)
        return transmitted_torque(twist, still, plant.stiffness[soft], still, plant.gap[soft])

    def _energy(
        self, data: pin.Data, q: Array, v: Array, theta: Array, omega: Array, soft: NDArray[np.intp]
    ) -> dict[str, float]:
        plant, model = self.plant, self.plant.model
        kinetic = pin.computeKineticEnergy(model, data, q, v)
        kinetic += 0.5 * float(plant.rotor_inertia @ omega**2)
        potential = pin.computePotentialEnergy(model, data, q)
        angle = q[plant.robot.position_index]
        twist = theta[soft] - plant.coupling[soft] @ angle
        half = 0.5 * plant.gap[soft]
        wound = twist - np.clip(twist, -half, half)
        spring = 0.5 * float(plant.stiffness[soft] @ wound**2)
        return {"kinetic": kinetic, "potential": potential, "transmission": spring}
