"""What an effect is: a named edit of a machine, with places, parameters and coordinates.

What it is called, its numbers and the motion that shows it stand in `effects.csv`.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any, Final, NamedTuple

from actuators.arrays import Array
from actuators.errors import LegwattError, closest, known, one_line
from pipeline.machine.machine import MachineModel

Place = tuple[str, ...]
Values = Mapping[str, float]
Shapes = list[dict[str, float]]
#: Stands for every joint: one scale of a whole channel, or of all friction.
EVERY: Final = "*"
CHANNEL_UNITS: Final = {"torque": "N*m", "current": "A", "voltage": "V", "power": "W"}


@dataclass(frozen=True, eq=False)
class Measured:
    """What a log holds, in the few numbers by which effects say where and how they could show."""

    channels: tuple[str, ...]  #: Compared efforts, the log's own first.
    #: Whether all components of the ground's forces were measured; None where none was.
    feet: bool | None
    length: float  #: From the first sample to the last [s].
    bandwidth: float  #: Of all series [Hz].
    rest_speed: Array  #: Within which friction passes from one sign to the other, (J,) [rad/s].
    slow: Array  #: Speed above which 70 % of the samples lie, (J,) [rad/s].
    fast: Array  #: ... and 2 %.
    travel: Array  #: Of each joint, (J,) [rad].
    effort: Array  #: Root mean square of the first channel where rows have a say, (J,).
    kelvin: Array | None  #: Mean temperature of each joint, (J,) [K]; None where none was measured.


@dataclass(frozen=True)
class Coordinate:
    """A number in which an effect is fitted; at zero the effect is not there."""

    name: str  #: Of the coordinate.
    step: float  #: For finite differences; small against what matters.
    signed: bool = False  #: Whether negative values make sense.
    #: Whether the effect is this effect only while this coordinate is not zero.
    required: bool = True
    #: In practice, one standard deviation before a log is seen, as a share of `of`; 0 for none.
    size: float = 0.0
    of: str = ""  #: Such as ``torque/speed``: root mean squares at the joint; empty for its unit.

    def sized(self, scales: Values) -> float:
        """Its size in practice, with the scales of the joint and robot by name."""
        over, _, under = self.of.partition("/")
        speed, _, power = under.partition("^")
        size = self.size * (scales[over] if over else 1.0)
        return size / scales[speed] ** int(power or 1) if speed else size


class Form(NamedTuple):
    """A coordinate of another form than the parameter that it tells."""

    name: str  #: Of the coordinate.
    told: Callable[[float], float]  #: The parameter by the coordinate.
    fitted: Callable[[float], float]  #: The coordinate by the parameter.
    signed: bool = True  #: Whether negative coordinates make sense.


#: Forms by what `effects.csv` calls them: a factor by how much more than once it is, a torque
#: constant's relative error by how much more current or, below nothing, back-EMF it asks for, a
#: stiffness by its reciprocal.
FORMS: Final = {
    "more": Form("more", lambda more: 1.0 + more, lambda factor: factor - 1.0),
    "constant": Form(
        "more",
        lambda more: 1.0 / (1.0 + more) - 1.0 if more > 0.0 else -more,
        lambda relative: -relative / (1.0 + relative) if relative < 0.0 else -relative,
    ),
    "compliance": Form("compliance", lambda c: 1.0 / max(c, 1e-12), lambda k: 1.0 / k, False),
}


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect, as results and model files have it."""

    name: str
    unit: str  #: ``"channel"`` stands for the unit of the compared channel.
    low: float  #: Below this the effect makes no sense.
    high: float  #: Above this likewise.
    optional: bool  #: Whether it may be left out and is zero then.
    form: Form | None  #: Of its coordinate, where that is another number.


def place_text(place: Sequence[str]) -> str:
    """A place as a reader sees it."""
    if tuple(place) == (EVERY,):
        return "all joints"
    return " with ".join(place) if place else "the whole machine"


#: Rows of `effects.csv` by their headers.
Rows = Sequence[Mapping[str, str]]
#: Every effect by name, in the order of `effects.csv`.
EFFECTS: Final[dict[str, Effect]] = {}
#: Those that are tried, each in the forms in which it competes; its places say for which machine.
COMPETING: Final[list[Effect]] = []
#: Classes of effects by the name that they have, or by the role that rows give them.
CLASSES: Final[dict[str, list[type[Effect]]]] = {}


class Effect:
    """A kind of thing that a model may lack: rows of `effects.csv`, and what it does to a machine.

    An effect is fitted in `coordinates`, in which the prediction is linear or nearly so, at given
    `shapes` (Stribeck speed, order of a ripple), and reported in `parameters`. By itself it adds to
    attributes of the joint's actuator and sensors; a class with its name says what it does else,
    several with one name are forms of it.
    """

    name: str = ""  #: In the field's terms; key of the catalogue.
    fits: tuple[str, ...] = ()  #: Coordinates of this form; all by default.
    fixed: tuple[str, ...] = ()  #: Parameters that are known before the search.
    #: Lists of numbers that it has besides.
    tables: tuple[str, ...] = ()

    def __init_subclass__(cls) -> None:
        """Enter the classes."""
        super().__init_subclass__()
        CLASSES.setdefault(cls.name, []).append(cls)

    def __init__(self, rows: Rows) -> None:
        about, *numbers = rows
        self.name, roles = about["effect"], about["role"].split()
        #: Whether it is tried by itself; others are fitted together for a whole machine.
        self.competes = "alone" not in roles
        #: Whether what it adds does not depend on what else acts at the joint.
        self.additive = "additive" in roles
        #: Whether it shows in what a motor takes, and not in a torque that is sensed at the joint.
        self.electric = "electric" in roles
        #: Whether it replaces, or takes a share of, what stands at its place or acts on it.
        self.replaces = "replaces" in roles
        #: Whether it changes what the files state: it is applied before what is added to them.
        self.on_stated = "on_stated" in roles
        #: Whether it changes what stands between joint and motor, one drivetrain option's own.
        self.of_drivetrain = "of_drivetrain" in roles
        #: What it acts on: joint, joint pair, link, ground, effort channels or column.
        self.place_kind = about["of"]
        self.excitation = about["words"]  #: The motion that shows it, in words.
        #: Why standing and walking do not see it; empty where they do.
        self.unseen = about["unseen"]
        #: As written to results and model files.
        self.parameters = tuple(_parameter(row) for row in numbers if row["unit"])
        every = {c.name: c for c in (_coordinate(row) for row in numbers if row["step"])}
        self.coordinates = tuple(every[name] for name in self.fits or every)  #: As fitted.
        #: Numbers, as fitted where they are, to the attribute or term of a law that they are.
        self.acts = {_fitted_name(row): row["acts"] for row in numbers if row["acts"]}

    def places(self, model: MachineModel, m: Measured) -> list[Place]:
        """Where in this machine and log the effect could be; one place has its kind's name."""
        if self.place_kind == "link":
            links = model.robot.links.items()
            return [(link,) for link, joint in links if observable(model, m, joint)]
        if self.place_kind != "joint":
            return [(self.place_kind,)]
        if self.electric and "torque" in m.channels:
            return []
        return [(a.name,) for a in model.actuators if a.motor is not None or not self.electric]

    def shapes(self, model: MachineModel, m: Measured, place: Place) -> Shapes:
        """Values of the nonlinear parameters to try first; one empty set where there are none."""
        return [{}]

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """The machine with the effect at coordinates `x` and shape `shape`."""
        joint = model.actuator(place[0])
        more = {of: getattr(joint, of) + x[name] for name, of in self.acts.items()}
        return self.at_joint(model, place, **more, **shape)

    @staticmethod
    def at_joint(model: MachineModel, place: Place, **changes: Any) -> MachineModel:
        """A machine with other attributes of the actuator and sensors of a joint."""
        return model.with_actuator(replace(model.actuator(place[0]), **changes))

    def physical(self, x: Values, shape: Values) -> dict[str, float]:
        """Coordinates and shape as parameters."""
        values = {**x, **shape}
        for p in self.parameters:
            if p.form and p.form.name in x:
                values[p.name] = p.form.told(values.pop(p.form.name))
        return values

    def internal(self, values: Values) -> tuple[dict[str, float], dict[str, float]]:
        """Parameters as coordinates and shape."""
        numbers = {n: float(v) for n, v in values.items()}
        for p in self.parameters:
            if p.form and p.name in numbers:
                numbers[p.form.name] = p.form.fitted(numbers.pop(p.name))
        x = {c.name: numbers.pop(c.name) for c in self.coordinates if c.name in numbers}
        return x, numbers

    def plausible(self, model: MachineModel, place: Place, x: Values, shape: Values) -> bool:
        """Whether an estimate lies inside the bounds of what can be."""
        values = self.physical(x, shape)
        stated = [p for p in self.parameters if p.name in values or not p.optional]
        return all(p.low <= values[p.name] <= p.high for p in stated)

    def known(self, values: Values, spread: Values) -> float | None:
        """How well a log has shown bodies or friction by values and spread, relative, or None."""
        return None

    def apply(self, model: MachineModel, place: Place, values: Values) -> MachineModel:
        """The machine with the effect at the given parameters.

        Raises:
            LegwattError: A parameter is missing, unknown or out of bounds. The place does not
                exist.
        """
        self.refuse_other_names(values)
        for p in (p for p in self.parameters if p.name in values):
            if not p.low <= (x := values[p.name]) <= p.high:
                limits = f"{p.low:g} to {p.high:g} {p.unit}"
                raise LegwattError(f"{self.name}: {p.name} = {x:g} lies outside {limits}")
        return self.edit(model, place, *self.internal(values))

    def refuse_other_names(self, names: Collection[str]) -> None:
        """Refuse parameters that are not the effect's, and the lack of one.

        Raises:
            LegwattError: Names it; offers the closest match.
        """
        every = [*(p.name for p in self.parameters), *self.tables]
        for name in (name for name in names if name not in every):
            said = f"'{one_line(name)}': {closest(name, every)}"
            raise LegwattError(f"{self.name} has no parameter {said}")
        for p in self.parameters:
            if p.name not in names and not p.optional:
                raise LegwattError(f"{self.name} needs the parameter '{p.name}'")

    def unit(self, parameter: str, channel: str) -> str:
        """Unit of a parameter in a log whose compared channel is `channel`."""
        unit = next(p.unit for p in self.parameters if p.name == parameter)
        return CHANNEL_UNITS[channel] if unit == "channel" else unit


def observable(model: MachineModel, m: Measured, joint: str) -> bool:
    """Whether a log depends on the body at a joint: of a base on measured feet only torques do."""
    base = model.robot.floating and model.rigid.getJointId(joint) == 1
    return not (base and m.feet) or m.channels == ("torque",)


def _fitted_name(row: Mapping[str, str]) -> str:
    return FORMS[row["told_by"]].name if row["told_by"] else row["number"]


def _parameter(row: Mapping[str, str]) -> Parameter:
    low, high = (float(row[end]) for end in ("low", "high"))
    optional, form = "optional" in row["role"], FORMS.get(row["told_by"])
    return Parameter(row["number"], row["unit"], low, high, optional, form)


def _coordinate(row: Mapping[str, str]) -> Coordinate:
    form = FORMS.get(row["told_by"])
    signed = form.signed if form else not row["unit"] or float(row["low"]) < 0.0
    step, required = float(row["step"]), "spare" not in row["role"]
    size = float(row["size"]), row["of"]
    return Coordinate(_fitted_name(row), step, signed, required, *size)


def enter() -> None:
    """Enter the effects of `effects.csv`, each in the classes that have its name or its role."""
    with Path(__file__).with_name("effects.csv").open(encoding="utf-8", newline="") as file:
        for name, group in groupby(csv.DictReader(file), lambda row: row["effect"]):
            rows = [*group]
            roles = [role for role in rows[0]["role"].split() if role in CLASSES]
            forms = [of(rows) for of in CLASSES.get(roles[0] if roles else name, [Effect])]
            EFFECTS[name] = forms[0]
            COMPETING.extend(form for form in forms if form.competes)


def effect_named(name: str) -> Effect:
    """An effect of the catalogue.

    Raises:
        LegwattError: Unknown name; the message offers the closest one.
    """
    return EFFECTS[known("no effect", name, EFFECTS)]


def told_apart(*names: str) -> str:
    """Which motion shows each of some effects that a log cannot tell apart, in words."""
    each = dict.fromkeys(names)  # one effect at two places has one motion
    return "a motion " + ", one ".join(f"that {EFFECTS[n].excitation} shows {n}" for n in each)
