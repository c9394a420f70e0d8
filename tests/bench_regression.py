"""Blind trials of the regression: arms with wrong inertias, friction of any law, coloured noise.

    python -m tests.bench_regression [TRIALS] [SEED]

Every trial hides a law at every joint of an arm whose bodies are 10 to 20 % off, adds white and
coloured noise to the torque, rounds the positions, identifies the first 60 % and scores the rest
beside the best of plain least-squares ladders. Prints one line per trial and the rates.
"""

from __future__ import annotations

import sys

import example_robot_data
import numpy as np
import pinocchio as pin
import scipy.linalg
import scipy.signal
from numpy.typing import NDArray

from pipeline.regression.identify import Options, identify
from pipeline.regression.laws.bodies import parameters, pseudo_inertia, regressor, with_parameters
from pipeline.regression.preprocess import Run, rows
from pipeline.regression.statistics.bandwidth import prepare

Array = NDArray[np.float64]
ARMS = {"ur5": 6, "panda": 7, "z1": 6, "kinova": 6, "xarm7": 7, "double_pendulum": 2}
LAWS = ("C", "V", "CV", "CVL", "SV", "CT", "unknown", "none")


def arm(rng: np.random.Generator) -> pin.Model:
    name = str(rng.choice(list(ARMS)))
    model = example_robot_data.load(name).model
    one = [
        k
        for k in range(1, model.njoints)
        if model.joints[k].nq == 1 and model.joints[k].shortname() != "JointModelPX"
    ][: int(rng.integers(2, ARMS[name] + 1))]
    locked = [k for k in range(1, model.njoints) if k not in one]
    return pin.buildReducedModel(model, locked, pin.neutral(model))


def perturbed(model: pin.Model, rng: np.random.Generator, size: float) -> pin.Model:
    """Bodies P = L L^T become L S S^T L^T: off by `size` in their own scale, and bodies still."""
    out = []
    for ten in parameters(model).reshape(-1, 10):
        p = pseudo_inertia(ten)
        root = scipy.linalg.sqrtm(p + 1e-12 * np.trace(p) * np.eye(4)).real
        s = scipy.linalg.expm(0.5 * size * rng.standard_normal((4, 4)))
        p = root @ s @ s.T @ root.T
        sigma = p[:3, :3]
        inertia = np.trace(sigma) * np.eye(3) - sigma
        out.append([p[3, 3], *p[:3, 3], *inertia[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]])
    return with_parameters(model, np.ravel(out))


def motion(rng: np.random.Generator, t: Array, joints: int) -> Array:
    q = np.zeros((len(t), joints))
    for j in range(joints):
        f = rng.uniform(0.05, 0.6, 5)
        a = rng.uniform(0.1, 0.5, 5) / np.sqrt(f / 0.1)
        q[:, j] = (
            rng.uniform(-0.5, 0.5)
            + np.sin(2 * np.pi * np.outer(t, f) + rng.uniform(0, 6.28, 5)) @ a
        )
    return q


def hidden(rng: np.random.Generator, v: Array, load: Array) -> tuple[str, dict[str, float], Array]:
    law = str(rng.choice(LAWS, p=[0.15, 0.1, 0.25, 0.12, 0.1, 0.08, 0.1, 0.1]))
    scale = float(load.std()) + 0.05
    c, visc = rng.uniform(0.05, 0.3) * scale, rng.uniform(0.03, 0.2) * scale / v.std()
    s, top = np.sign(v), float(np.quantile(np.abs(v), 0.95))
    sizes: dict[str, float] = {}
    f = np.zeros_like(v)
    if law in ("C", "CV", "CVL", "SV", "CT", "unknown"):
        sizes["coulomb"] = c
        f = f + c * s
    if law in ("V", "CV", "CVL", "SV"):
        sizes["viscous"] = visc
        f = f + visc * v
    if law == "CVL":
        sizes["load"] = float(rng.uniform(0.08, 0.25))
        f = f + sizes["load"] * np.abs(load) * s
    if law == "SV":
        f = f + rng.uniform(0.4, 1.0) * c * s * np.exp(
            -((v / (rng.uniform(0.03, 0.15) * top)) ** 2)
        )
    if law == "CT":
        f = f + 2 * c * np.tanh(v / (0.3 * top))
    if law == "unknown":
        f = (
            f
            + c * s * np.exp(-(((np.abs(v) - 0.5 * top) / (0.15 * top)) ** 2))
            + c * np.abs(v) / top
        )
    return law, sizes, f


NAMES = {
    "none": {"none"},
    "C": {"Coulomb"},
    "V": {"viscous"},
    "CV": {"Coulomb and viscous"},
    "CVL": {
        "Coulomb, viscous and load-dependent",
        "Coulomb, viscous and per motor torque",
        "Coulomb, viscous and load-dependent by quadrant",
    },
    "SV": {"Stribeck and viscous"},
    "CT": {"Coulomb and saturating"},
    "unknown": {"a law that is not in the catalogue"},
}


def ladder(train, test, model) -> float:
    """Best test error of plain least-squares rows, pointwise tanh(v / 0.02)."""
    best = np.inf
    at, bt = (regressor(model, r.q, r.v, r.a) for r in (train, test))
    pi = parameters(model)

    def own(x: Array) -> Array:
        z = np.zeros((*x.shape, x.shape[1]))
        z[:, range(x.shape[1]), range(x.shape[1])] = x
        return z

    def build(r, y: Array) -> dict[str, Array]:
        s, rigid = np.tanh(r.v / 0.02), y @ pi
        return {
            "bodies": y,
            "viscous": own(r.v),
            "coulomb": own(s),
            "offset": own(np.ones_like(r.v)),
            "rotor": own(r.a),
            "load": own(np.abs(rigid) * s),
        }

    a, b = build(train, at), build(test, bt)
    order = ["viscous", "coulomb", "offset", "rotor", "load"]
    for base in (True, False):
        for k in range(len(order) + 1):
            names = (["bodies"] if base else []) + order[:k]
            e = test.tau - (0 if base else bt @ pi)
            if names:
                x = np.concatenate([a[n] for n in names], axis=2).reshape(train.tau.size, -1)
                y = (train.tau - (0 if base else at @ pi)).reshape(-1)
                scale = np.linalg.norm(x, axis=0) + 1e-300
                size = np.linalg.lstsq(x / scale, y, rcond=1e-8)[0] / scale
                e = e - np.concatenate([b[n] for n in names], axis=2) @ size
            best = min(best, float(np.sqrt((e**2).mean())))
    return best


def trial(seed: int) -> dict[str, float]:
    rng = np.random.default_rng(seed)
    nominal = arm(rng)
    true = perturbed(nominal, rng, rng.uniform(0.1, 0.2))
    n, rate = nominal.nv, 200.0
    t = np.arange(0, 60, 1 / rate)
    q = motion(rng, t, n)
    v, a = np.gradient(q, t, axis=0), np.gradient(np.gradient(q, t, axis=0), t, axis=0)
    data = true.createData()
    load = np.array([pin.rnea(true, data, *x) for x in zip(q, v, a, strict=True)])
    laws, tau = [], load.copy()
    rotor = np.where(rng.random(n) < 0.5, rng.uniform(0.05, 0.3, n), 0.0)
    for j in range(n):
        rotor[j] *= float(np.abs(load[:, j]).std()) / (a[:, j].std() + 1e-9) * 0.3
        law = hidden(rng, v[:, j], load[:, j])
        laws.append(law)
        tau[:, j] += law[2] + rotor[j] * a[:, j]
    clean = tau.copy()
    level = rng.uniform(0.02, 0.06) * tau.std(axis=0)
    pole = np.exp(-1 / (rate * rng.uniform(0.02, 0.15)))
    slow = scipy.signal.lfilter(
        [np.sqrt(1 - pole**2)], [1, -pole], rng.standard_normal(tau.shape), axis=0
    )
    tau = tau + level * (0.7 * slow + 0.7 * rng.standard_normal(tau.shape))
    step = 2 * np.pi / 2.0 ** int(rng.integers(14, 19))
    seen = np.round(q / step) * step
    cut = int(0.6 * len(t))
    train = prepare([Run(t[:cut], seen[:cut], tau[:cut])], nominal)
    result = identify(train, nominal, options=Options(draws=20, seed=seed))
    test = rows([Run(t[cut:], seen[cut:], tau[cut:])], cutoff=train.cutoff, rate=rate)
    clean_test = rows([Run(t[cut:], seen[cut:], clean[cut:])], cutoff=train.cutoff, rate=rate)
    predicted = result.predict(test.q, test.v, test.a, rate, train.cutoff)
    error = float(np.sqrt(((test.tau - predicted) ** 2).mean()))
    beyond = float(np.sqrt(((clean_test.tau - predicted) ** 2).mean()))
    out = {
        "joints": n,
        "error": error,
        "ladder": ladder(train, test, nominal),
        "beyond": beyond,
        "gap": float(np.sqrt(((clean_test.tau) ** 2).mean())),
        "sigma": result.urdf_uncertainty,
        "right": 0,
        "unknown": 0,
        "unknown_named": 0,
        "confirmed": 0,
        "wrong_confirmed": 0,
        "covered": 0,
        "intervals": 0,
        "couplings": len(result.couplings),
        "empty": 0,
        "empty_silent": 0,
        "rotor_wrong": 0,
        "share_right": 0.0,
    }
    lines = []
    for j, ((law, sizes, _), f) in enumerate(zip(laws, result.friction, strict=True)):
        right = f.law in NAMES[law]
        out["right"] += right
        out["unknown"] += law == "unknown"
        out["empty"] += law == "none"
        out["empty_silent"] += law == "none" and f.law == "none"
        if f.level == "confirmed" and f.law != "none":
            out["confirmed"] += 1
            out["wrong_confirmed"] += not right
            out["unknown_named"] += law == "unknown"
        for term in result.at(f.joint):
            if term.term in ("coulomb", "viscous", "load") and right and term.term in sizes:
                out["intervals"] += 1
                out["covered"] += term.low <= sizes[term.term] <= term.high
            if term.kind == "rotor inertia" and term.level == "confirmed" and rotor[j] == 0:
                out["rotor_wrong"] += 1
        lines.append(f"{law}->{f.law}[{f.share:.2f}{'!' if f.level == 'confirmed' else ''}]")
    print(
        f"{seed} {nominal.name} {n} joints, {train.cutoff:.1f} Hz, {len(train.time)} rows: "
        f"error {error:.4g}, ladder {out['ladder']:.4g}, beyond noise {beyond:.3g} of "
        f"{out['gap']:.3g}, sigma {result.urdf_uncertainty:g}; " + "; ".join(lines),
        flush=True,
    )
    return out


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    outs = [trial(first + k) for k in range(count)]
    total = {k: sum(o[k] for o in outs) for k in outs[0]}
    print(f"joints {total['joints']}: right law {total['right'] / total['joints']:.2f}")
    print(
        f"confirmed {total['confirmed']}, wrong {total['wrong_confirmed']}, "
        f"unknown under another name {total['unknown_named']} of {total['unknown']}, "
        f"rotor inertia confirmed where none is {total['rotor_wrong']}, "
        f"couplings where none is {total['couplings']}"
    )
    print(f"empty joints silent {total['empty_silent']} of {total['empty']}")
    print(f"95 % intervals cover {total['covered']} of {total['intervals']}")
    ratio = [o["error"] / o["ladder"] for o in outs]
    print(f"test error per ladder's best: median {np.median(ratio):.3f}, worst {max(ratio):.3f}")


if __name__ == "__main__":
    main()
