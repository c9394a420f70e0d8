"""Bodies that were stretched, moved and made heavier stay bodies, in whatever axes."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from pipeline.machine.bodies import strained

#: A rod of 2 kg and 0.6 m along z, nearly without thickness.
ROD = pin.Inertia.FromBox(2.0, 0.01, 0.01, 0.6)


def _parts(body: pin.Inertia) -> tuple[float, np.ndarray, np.ndarray]:
    return body.mass, np.array(body.lever), np.array(body.inertia)


def test_its_entries_are_mass_stretch_and_displacement() -> None:
    heavier, _, inertia = _parts(strained(ROD, [0, 0, 0, np.log(1.2), 0, 0, 0, 0, 0, 0]))
    assert heavier == pytest.approx(2.4)
    assert inertia == pytest.approx(1.2 * np.array(ROD.inertia))
    mass, centre, inertia = _parts(strained(ROD, [0, 0, 0, 0, 0, 0, 0, 0.1, 0, 0]))
    assert mass == pytest.approx(2.0)
    # A slender body moves sideways as far as along itself: in its longest radius of gyration.
    assert centre == pytest.approx([0.1 * 0.6 / np.sqrt(12), 0, 0])
    assert inertia == pytest.approx(np.array(ROD.inertia))
    longer = strained(ROD, [0, 0, np.log(1.5), 0, 0, 0, 0, 0, 0, 0])
    assert np.array(longer.inertia) == pytest.approx(
        np.array(pin.Inertia.FromBox(2.0, 0.01, 0.01, 0.9).inertia)
    )


@pytest.mark.parametrize("seed", range(2))
def test_axes_and_origin_of_a_body_are_of_no_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    body = pin.SE3.Random().act(pin.Inertia.FromBox(2.0, 0.1, 0.3, 0.6))
    turn = pin.SE3(pin.Quaternion(rng.standard_normal(4)).normalized().matrix(), np.zeros(3))
    away = pin.SE3(np.eye(3), rng.standard_normal(3))
    E, d, a = rng.standard_normal((3, 3)), rng.standard_normal(3), float(rng.standard_normal())
    E = 0.2 * (E + E.T)

    def changed(of: pin.Inertia, E: np.ndarray, d: np.ndarray) -> np.ndarray:
        diagonal, beside = np.diag(E), E[[0, 0, 1], [1, 2, 2]]
        return np.array(strained(of, [*diagonal, a, *beside, *d]).toDynamicParameters())

    here = changed(body, E, d)
    R = turn.rotation
    turned = pin.Inertia.FromDynamicParameters(changed(turn.act(body), R @ E @ R.T, R @ d))
    assert turn.actInv(turned).toDynamicParameters() == pytest.approx(here)
    moved = pin.Inertia.FromDynamicParameters(changed(away.act(body), E, d))
    assert away.actInv(moved).toDynamicParameters() == pytest.approx(here)
    assert np.linalg.eigvalsh(pin.PseudoInertia.FromDynamicParameters(here).toMatrix()).min() > 0.0
