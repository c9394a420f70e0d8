import re
import shutil

import numpy as np
import pytest

from actuators.errors import LegwattError
from actuators.loading.build import CATALOG, load_catalog
from tests.actuators.motions import ALTERNATIVES


def test_shipped_catalogue_builds_four_alternatives_of_ratio_400():
    ratios = {name: chain.ratio for name, chain in load_catalog().chains().items()}
    assert ratios == pytest.approx(dict.fromkeys(ALTERNATIVES, 400.0), rel=1e-9)


@pytest.fixture
def copy(tmp_path):
    return shutil.copytree(CATALOG, tmp_path / "catalog")


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("alternatives.toml", '"hypoid.ratio"', '"hypoid.rato"', "did you mean 'ratio'"),
        ("alternatives.toml", 'law = "hypoid"', 'law = "hipoid"', "unknown law 'hipoid'"),
        ("alternatives.toml", 'friction = "hypoid.friction"\n', "", "lacks its argument"),
        ("alternatives.toml", "motor_re40_24v", "motor_re40_48v", "did you mean 'motor_re40_24v'"),
        ("alternatives.toml", 'stage = "ph"', 'stage = "mp"', "named twice"),
        ("alternatives.toml", 'viscous = "pinion.viscous"\n', "", "used by no alternative"),
        ("alternatives.toml", 'stage = "ph"\n', "", "name the stage, too"),
        ("alternatives.toml", 'stage = "m"\n', "", r"entry \(transmission\) lacks the key 'stage'"),
        ("alternatives.toml", '"rotor_re40.inertia"', '"rotor_re40.coulomb"', "expected inertia"),
        ("alternatives.toml", r"^(\[+)rotor\b", r'\1"../up"', "expected a name of letters"),
        ("planetary.toml", r"value = [\d.]+\n", "value = 13\n", "ratios multiply to"),
    ],
)
def test_typos_give_one_clear_line(copy, file, old, new, message):
    changed, count = re.subn(old, new, (copy / file).read_text(), flags=re.M)
    assert count
    (copy / file).write_text(changed)
    with pytest.raises(LegwattError, match=message) as caught:
        load_catalog(copy)
    assert "\n" not in str(caught.value)


def test_edits_do_not_touch_the_original():
    catalog = load_catalog()
    edited = catalog.replaced("rotor_re40.coulomb", 0.0)
    held = edited.chain("rotor").holding(np.array([4.0]))
    assert held.motor_torque[0] == pytest.approx(0.01)
    assert catalog.parameter("rotor_re40.coulomb").value > 0.0
    with pytest.raises(LegwattError, match="no alternative 'reversibel'.*'reversible'"):
        catalog.chain("reversibel")
    with pytest.raises(LegwattError, match="change them together"):
        catalog.replaced("planetary.ratio", 10.0).chain("irreversible")
