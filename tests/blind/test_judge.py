"""The judge: what is right, what is wrong, what asks for the class; rates and their intervals."""

from pathlib import Path
from typing import Any

import pytest

from tests.blind.judge import Name, coverage, found, read_names, tables, verdict

MODEL = """
[[edit]]
effect = "coulomb_friction"
place = ["joint_1"]
level = "confirmed"
[edit.parameters.torque]
value = 0.5
unit = "N*m"
interval = [0.4, 0.6]
"""


def answer(folder: Path, options: list[str]) -> dict[str, object]:
    """What any workflow could write; worker processes import it."""
    assert (folder / "given" / options[0]).exists()
    assert not (folder / "given" / "truth.json").exists()
    return {"code": 1, "seconds": 1.0, "message": "", "files": {"model.toml": MODEL}}


def truth(*hidden: dict[str, Any], **changed: Any) -> dict[str, Any]:
    base = {"source": "own", "trial": 0, "kind": "single" if hidden else "empty", "machine": "leg"}
    base |= {"joints": ["joint_1", "joint_2", "joint_3"], "off": 0.0, "rate_Hz": 500.0, "bits": 16}
    base |= {"sides": "joint", "hidden": list(hidden), "friction": {}, "rotors": []}
    return base | changed


def hidden(effect: str, place: str, joint: int = 0, **values: Any) -> dict[str, Any]:
    alike = values.pop("alike", [])
    row = {"effect": effect, "place": [place], "joint": joint, "values": values}
    return row | {"z": 50.0, "visible": True, "alike": alike}


def name(effect: str, *place: str, rivals: tuple[str, ...] = (), **values: float) -> Name:
    spread = {k: (v, v - 0.1, v + 0.1) for k, v in values.items()}
    return Name(effect, place, "confirmed", spread, rivals)


COULOMB = truth(
    hidden("coulomb_friction", "joint_1", torque=0.5), friction={"joint_1": ["coulomb"]}
)
SCALE = truth(hidden("effort_gain", "joint_1__torque_Nm", gain=1.2), machine="pendulum")
ALIKE = truth(hidden("base_tilt", "ground", alike=["position_offset"], roll=0.1, pitch=0.1))
UNEVEN = truth(
    hidden("direction_dependent_friction", "joint_1", positive=1.0, negative=0.5),
    friction={"joint_1": ["coulomb", "asymmetry"]},
)
LOAD = truth(
    hidden("load_dependent_friction", "joint_1", share=0.2, driving=0.25, driven=0.167),
    friction={"joint_1": ["driving", "driven"]},
)
DRY, BODY = ("coulomb_friction", "joint_1"), ("rigid_body_parameters", "link_1")
ROTOR = ("rotor_inertia", "joint_1")
ZERO, GAIN = ("position_offset", "joint_1"), ("effort_gain", "joint_1__torque_Nm")


@pytest.mark.parametrize(
    ("known", "names", "expected", "seen"),
    [
        (COULOMB, [name(*DRY, torque=0.5)], ["right"], True),
        (COULOMB, [name("coulomb_friction", "joint_2", torque=0.5)], ["wrong"], False),
        (truth(), [name(*BODY, mass=1.0)], ["wrong"], None),
        (truth(off=0.03), [name(*BODY, mass=1.0)], ["right"], None),
        (truth(rotors=["joint_1"]), [name(*ROTOR, added=1.0)], ["right"], None),
        (truth(), [name(*ROTOR, added=1.0)], ["wrong"], None),
        (UNEVEN, [name("direction_dependent_friction", "joint_1", positive=1.0)], ["right"], True),
        (UNEVEN, [name(*DRY), name("effort_offset", "joint_1")], ["right", "right"], True),
        (UNEVEN, [name(*DRY, torque=0.75)], ["right"], False),
        (LOAD, [name("backdrive_loss", "joint_1", driving=0.25, driven=0.17)], ["right"], True),
        (SCALE, [name(*GAIN, gain=1.2)], ["wrong"], False),
        (SCALE, [name("link_mass", "link_1", mass=1.2)], ["wrong"], False),
        (SCALE, [name("link_mass", "link_1", rivals=("effort_gain",))], ["class"], True),
        (ALIKE, [name(*ZERO, angle=0.1)], ["wrong"], False),
        (ALIKE, [name(*ZERO, rivals=("base_tilt",), angle=0.1)], ["class"], True),
    ],
)
def test_names_are_judged_straight(known, names, expected, seen):
    got = [verdict(known, one)[0] for one in names]
    assert got == expected
    for one in known["hidden"]:
        assert found(known, one, [*zip(names, got, strict=True)]) == seen


def test_an_interval_covers_what_it_holds_and_one_of_no_width_nothing():
    (one,) = COULOMB["hidden"]
    assert coverage(name(*DRY, torque=0.45), one) == (1, 1)
    thin = Name("coulomb_friction", ("joint_1",), "confirmed", {"torque": (0.4, 0.4, 0.4)})
    assert coverage(thin, one) == (1, 0)
    # Load friction per torque of the motor lies between its shares of the load.
    loss = name("backdrive_loss", "joint_1", driving=0.3, driven=0.1)
    assert coverage(loss, LOAD["hidden"][0]) == (2, 2)


def test_model_file_and_classes_are_read():
    candidates = (
        "effect,joint,place,verdict\n"
        "coulomb_friction,joint_1,joint_1,accepted\n"
        "backdrive_loss,joint_1,joint_1,indistinguishable from coulomb_friction at joint_1\n"
    )
    (named,) = read_names({"model.toml": MODEL, "candidates.csv": candidates})
    assert named.rivals == ("backdrive_loss",)
    assert named.values == {"torque": (0.5, 0.4, 0.6)}
    # Where nothing is found there is no model file.
    assert read_names({"candidates.csv": candidates}) == []


def test_rates_count_what_they_say():
    other = MODEL.replace("coulomb_friction", "viscous_friction").replace("joint_1", "joint_2")
    load = MODEL.replace("coulomb_friction", "link_mass").replace("torque", "mass")
    load = load.replace("joint_1", "link_3").replace("0.5", "2.05")
    outside = truth(hidden("detents", "joint_1"), kind="outside", source="mujoco")
    payload = truth(hidden("link_mass", "link_3", 2, mass=2.0), kind="several")
    every = [(COULOMB, 0, MODEL), (COULOMB, 1, other), (truth(), 0, ""), (truth(), 1, "")]
    every += [(outside, 0, other), (payload, 0, load)]
    run = {"seconds": 1.0, "message": ""}
    answered = [
        {"truth": t, "answer": run | {"code": code, "files": {"model.toml": m} if m else {}}}
        for t, code, m in every
    ]
    out = tables(answered)
    rates = {(r.source, r.rate): (r.hits, r.count) for r in out["rates"].itertuples()}
    assert rates["own", "single right"] == (1, 2)
    assert rates["own", "several right"] == (1, 1)
    assert rates["own", "wrong name confirmed"] == (1, 5)
    assert rates["own", "empty silent"] == (1, 2)
    assert rates["mujoco", "outside not confirmed"] == (0, 1)
    assert rates["mujoco", "outside unexplained"] == (0, 1)
    assert rates["all", "names wrong"] == rates["all", "confirmed names right"] == (2, 4)
    assert rates["all", "intervals cover"] == (1, 2)
    # One interval of one holds the truth: more than 97 %, but not beyond chance.
    assert tables(answered[:1])["rates"].set_index("rate").loc["intervals cover", "reached"]
    shown = out["rates"].set_index(["source", "rate"]).loc[("all", "names wrong")]
    # Newcombe, Statistics in Medicine 17 (1998), method 3.
    assert (shown["low"], shown["high"]) == pytest.approx((0.1500, 0.8500), abs=5e-5)
