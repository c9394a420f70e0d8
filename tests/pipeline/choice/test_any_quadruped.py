"""Generated quadrupeds of random proportions: the answer in full chains, and by brute force."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest

import pipeline as lw
from actuators.loading.parts import PACK, load_parts
from actuators.supply import HOUR
from pipeline.choice.asked import Asked
from pipeline.choice.full import lasting, through
from pipeline.choice.group import groups_of
from pipeline.choice.loads import loads_of
from pipeline.choice.missions.mission import read_mission
from pipeline.choice.parts.shelf import Shelf
from pipeline.choice.search import Demanded, shared
from pipeline.choice.track import Account
from tests.pipeline.robot.walkers import robot_text, urdf_text

LEG = (("revolute", "1 0 0"), ("revolute", "0 1 0"), ("revolute", "0 1 0"))
PARTS = (
    "maxon_148867",
    "maxon_634043",
    "maxon_607930",
    "maxon_gp_42_hd_74",
    "maxon_gp_62_a_100",
    "cubemars_ak10_9_v3",
    "hd_csg_25_100",
)
BRAKE = "mitsubishi_hc_mf_053b_13b"
DAY = """mode,share,gait,hold,drivers
walk,0.3,,,
stand,0.5,stand,motor,on
wait,0.2,stand,brake,off
"""


def quadruped(folder: Path, seed: int) -> lw.Machine:
    """Thigh, shank, masses and placements are drawn; symmetric in nothing."""
    rng = np.random.default_rng(seed)
    lengths, mass = cycle([0.1, *rng.uniform(0.3, 0.42, 2)]), rng.uniform(0.2, 1.5)
    urdf = urdf_text([LEG] * 4, seed=seed)
    urdf = re.sub(r" -0\.200\"", lambda _: f' {-next(lengths):.4f}"', urdf)
    total = f"total_mass = {{value = {9 + 16 * mass}"
    text = re.sub("total_mass = {value = [0-9.]+", total, robot_text([LEG] * 4))
    text = text.replace("walking_speed = {value = 0.2", "walking_speed = {value = 0.05")
    text = text.replace("gait_period = {value = 1", "gait_period = {value = 4")
    (folder / "walker.urdf").write_text(urdf.replace('mass value="0.7"', f'mass value="{mass}"'))
    (folder / "walker.toml").write_text(text)
    return lw.load(folder / "walker.toml")


def asked(folder: Path, seed: int, policy: str = "none") -> Asked:
    (folder / "day.csv").write_text(DAY)
    machine = quadruped(folder, seed)
    known = load_parts()
    shelf = Shelf.of({name: known[name] for name in (*PARTS, BRAKE)})
    groups = groups_of(machine.robot.spec)
    account = Account(5.0, policy, 0.4 if policy == "fraction" else 0.0)
    modes = read_mission(folder / "day.csv")
    return Asked(machine, modes, groups, shelf, account, 0.0, known[PACK])


@pytest.mark.parametrize("policy", ["fraction", "bus"])
def test_answer_is_that_of_its_full_chains(tmp_path: Path, policy: str) -> None:
    """Power of a robot by the algebra of the search, and by chains, drivers and supply."""
    own = asked(tmp_path, 4, policy)
    loads = loads_of(own.machine, own.modes)
    design = ("maxon_607930", "maxon_gp_62_a_100")
    built = {
        g: (joints, own.shelf.designs([(*design, BRAKE if k else "")]))
        for k, (g, joints) in enumerate(own.groups.items())
    }
    day = [through(load, built, own.account) for load in loads]
    full = sum(one.total * one.load.mode.hours for one in day) / 24.0
    pairs = [(Demanded.of(g, joints, loads), one) for g, (joints, one) in built.items()]
    power = own.account.hotel + sum(float(d.power(one, own.account)[0]) for d, one in pairs)
    if policy == "bus":
        lost = float(shared(pairs, own.account)[0])
        assert lost == pytest.approx(sum(x.lost * x.load.mode.hours for x in day) / 24.0, rel=1e-9)
        power += lost
    assert full == pytest.approx(power, rel=1e-9)
    pack = replace(own.battery({g: (*design, "") for g in own.groups}), resistance=0.0)
    assert lasting(pack, day, 0.0) == pytest.approx(pack.energy / HOUR / full, rel=1e-9)
    peak = max(one.peak for one in day)
    sagging = replace(pack, resistance=0.01 * pack.full**2 / peak)
    assert 0.9 * lasting(pack, day, 0.0) < lasting(sagging, day, 0.0) < lasting(pack, day, 0.0)
    assert lasting(pack, day, pack.full) == 0.0
