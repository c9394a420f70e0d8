"""Blocks: their evidence by brute force, and what they say of simulated machines."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from pipeline.commands.robots import load
from pipeline.identification.block_columns import (
    CHUNKS,
    KINDS,
    Block,
    BlockData,
    Equation,
    block_data,
)
from pipeline.identification.blocks import BlockFit, fit_blocks
from pipeline.identification.regression.design_matrix import make_data_sets
from pipeline.identification.workflow.compared import compare_logs, load_logs
from pipeline.identification.workflow.options import Order, compared_machine
from tests.blind.machines.trial import make

BALL = np.array([1.0, 0, 0, 0, 0.4, 0, 0.4, 0, 0, 0.4])


def toy(seed: int, rows: int = 400, spring: float = 0.0) -> BlockData:
    """Two joints with Coulomb friction of .5 and 1.0, noise .1, and a body that nothing moves."""
    rng = np.random.default_rng(seed)
    chunk = np.arange(rows) * CHUNKS // rows
    equations = []
    for j, level in enumerate((0.5, 1.0)):
        X = np.zeros((rows, 16))
        X[:, [10 + j, 12 + j, 14 + j]] = rng.normal(size=(rows, 3))
        r = level * X[:, 10 + j] + spring * X[:, 14 + j] + 0.1 * rng.normal(size=rows)
        equations.append(Equation(X, r, chunk))
    joints, ones = ("a", "b"), np.ones(2)
    blocks = [Block("body", ("link",) * 10, np.arange(10), np.ones(10), (0, 1))]
    for k, kind in enumerate(("coulomb", "viscous", "spring")):
        ids = np.arange(10 + 2 * k, 12 + 2 * k)
        blocks.append(Block(kind, joints, ids, ones, (0, 1)))
    return BlockData(tuple(blocks), tuple(equations), BALL[None], joints)


def test_evidence_is_the_marginal_likelihood() -> None:
    data = toy(1, rows=40)
    start = fit_blocks(data)
    scales = np.array([0.0, 0.7, 0.2, 0.0])
    ratios = []
    for noise in (0.1, 0.15, 0.3):
        sigma, free = np.full(2, noise), np.r_[np.zeros(10), np.ones(4), np.zeros(2)] > 0
        fit = BlockFit(data, (0, 1, 2), np.ones(2), sigma, scales, np.zeros(16), free)
        mean = fit.covariance @ fit.system(data.total)[1]
        fit = replace(fit, x=mean)
        exact = 0.0
        for j, e in enumerate(data.equations):
            X = e.X[:, [10 + j, 12 + j]]
            C = X @ np.diag(scales[1:3] ** 2) @ X.T + noise**2 * np.eye(len(X))
            exact += multivariate_normal(np.zeros(len(X)), C).logpdf(e.r)
        ratios.append(fit.evidence - exact)
    assert np.ptp(ratios) < 1e-6
    assert start.data is data


def test_common_law_is_found_at_both_joints_and_nothing_else_is_told() -> None:
    fit = fit_blocks(toy(2))
    table = fit.table()
    told = table[table.told]
    assert list(told.block) == ["coulomb", "coulomb"]
    assert np.allclose(told.value, [0.5, 1.0], atol=0.03)
    assert (told.low < [0.5, 1.0]).all()
    assert (told.high > [0.5, 1.0]).all()
    assert np.allclose(fit.sigma, 0.1, rtol=0.15)
    assert "spring" not in set(table.block)  # rare, and not there
    springs = fit_blocks(toy(2, spring=0.3)).table()
    assert springs[springs.block == "spring"].told.all()


def test_columns_and_scales_do_not_hang_on_order_and_units() -> None:
    data = toy(3)
    halved = tuple(
        replace(e, X=np.where(np.arange(16) == 11, 0.5 * e.X, e.X)) for e in data.equations
    )
    size = np.where(np.arange(2) == 1, 2.0, 1.0)
    blocks = tuple(replace(b, scale=size) if b.kind == "coulomb" else b for b in data.blocks)
    one = fit_blocks(data).table().set_index(["block", "place"])
    other = fit_blocks(replace(data, equations=halved, blocks=blocks)).table()
    other = other.set_index(["block", "place"])
    assert other.value["coulomb", "b"] == pytest.approx(2 * one.value["coulomb", "b"], rel=1e-6)
    assert other.value["coulomb", "a"] == pytest.approx(one.value["coulomb", "a"], rel=1e-6)


def blocks_of(folder: Path, source: str, seed: int, *hide: str) -> tuple[BlockFit, dict]:
    """Blocks of a simulated leg in which something is hidden, and the truth."""
    truth = make(source, seed, 0, folder, machine="leg", effects=hide)
    given = folder / "given"
    logs = {"logs": (given / "log.csv",), "holdout": (given / "test.csv",)}
    order = Order(**logs, mapping=given / "mapping.toml")
    machine = compared_machine(order, load(given / "machine.urdf"))
    compared = compare_logs(machine, machine.model, load_logs(machine, order))
    return fit_blocks(block_data(machine.model, make_data_sets(compared.measurements))), truth


#: Terms of the truth by block.
TERMS = {"coulomb": {"coulomb", "spot", "excess", "asymmetry"}, "viscous": {"viscous"}}


@pytest.mark.parametrize(
    ("hide", "block", "parameter"),
    [
        ("coulomb_friction", "coulomb", "torque"),
        ("rotor_inertia", "rotor", "added"),
        ("time_delay", "delay", "delay"),
        ("quadratic_drag", "drag", "quadratic"),
    ],
)
def test_hidden_law_of_a_leg_has_its_block_and_size(
    tmp_path: Path, hide: str, block: str, parameter: str
) -> None:
    fit, truth = blocks_of(tmp_path, "own", 7, hide)
    (hidden,) = truth["hidden"]
    table = fit.table()
    told = table[table.told & (table.block == block)].set_index("place")
    assert told.value[hidden["place"][0]] == pytest.approx(hidden["values"][parameter], rel=0.15)
    for kind, terms in TERMS.items():
        there = {joint for joint, own in truth["friction"].items() if terms & {*own}}
        assert {*table[table.told & (table.block == kind)].place} <= there


def test_rare_blocks_are_absent_where_nothing_is_hidden(tmp_path: Path) -> None:
    fit, truth = blocks_of(tmp_path, "own", 11)
    assert all(fit.data.blocks[b].law.common for b in fit.active)
    assert all(KINDS[fit.data.blocks[b].kind].common for b in fit.active)
    told = fit.table().query("told and block in ('load', 'rotor')")
    assert told.empty
    assert np.linalg.eigvalsh(_pseudo(fit.bodies()[0]))[0] > 0
    assert truth["hidden"] == []


def _pseudo(ten: np.ndarray) -> np.ndarray:
    from pipeline.simulation.rigid_bodies import pseudo_inertia

    return np.asarray(pseudo_inertia(ten))
