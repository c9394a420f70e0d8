"""What an effect is: a named edit of a machine, with places, parameters and coordinates."""

from __future__ import annotations

from abc import ABC
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
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
class Size:
    """The size that a number has in practice, one standard deviation before a log is seen."""

    value: float  #: In `of`, or in the number's unit where that is empty.
    of: str  #: What it is a share of, e.g. ``torque/speed``: root mean squares at the joint.
    reason: str  #: Why, with the source.

    def at(self, scales: Values) -> float:
        """In the number's unit, with the scales of the joint and robot by name."""
        over, _, under = self.of.partition("/")
        speed, _, power = under.partition("^")
        size = self.value * (scales[over] if over else 1.0)
        return size / scales[speed] ** int(power or 1) if speed else size


@dataclass(frozen=True)
class Coordinate:
    """A number in which an effect is fitted; at zero the effect is not there."""

    name: str  #: Of the coordinate.
    step: float  #: For finite differences; small against what matters.
    size: Size | None = None  #: In practice.
    signed: bool = False  #: Whether negative values make sense.
    #: Whether the effect is this effect only while this coordinate is not zero.
    required: bool = True


class Form(NamedTuple):
    """A coordinate of another form than the parameter that it tells."""

    name: str  #: Of the coordinate.
    told: Callable[[float], float]  #: The parameter by the coordinate.
    fitted: Callable[[float], float]  #: The coordinate by the parameter.
    signed: bool = True  #: Whether negative coordinates make sense.


#: A factor by how much more than once it is.
MORE: Final = Form("more", lambda more: 1.0 + more, lambda factor: factor - 1.0)


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect; one with a step is a coordinate, or told by one."""

    name: str  #: In the model file.
    unit: str  #: ``"channel"`` stands for the unit of the compared channel.
    low: float  #: Below this the effect makes no sense.
    high: float  #: Above this likewise.
    size: Size | None = None  #: In practice; of the coordinate.
    step: float = 0.0  #: Of the coordinate; 0 where there is none.
    required: bool = True  #: As a coordinate.
    optional: bool = False  #: Whether it may be left out and is zero then.
    form: Form | None = None  #: Of the coordinate, where that is another number.

    @property
    def coordinate(self) -> Coordinate:
        """The number in which it is fitted."""
        name, signed = self.name, self.low < 0.0
        if self.form:
            name, signed = self.form.name, self.form.signed
        return Coordinate(name, self.step, self.size, signed, self.required)


def place_text(place: Sequence[str]) -> str:
    """A place as a reader sees it."""
    if tuple(place) == (EVERY,):
        return "all joints"
    return " with ".join(place) if place else "the whole machine"


#: Every effect by name, in the order in which they were declared.
EFFECTS: Final[dict[str, Effect]] = {}
#: Those that are tried, each in the forms in which it competes; its places say for which machine.
COMPETING: Final[list[Effect]] = []


class Effect(ABC):
    """A kind of thing that a model may lack.

    An effect is fitted in `coordinates`, in which the prediction is linear or nearly so, at given
    `shapes` (Stribeck speed, order of a ripple), and reported in `parameters`. A class with a name
    enters the catalogue, `EFFECTS`; a subclass of the same name is that effect in another form.
    """

    name: str  #: In the field's terms; key of the catalogue.
    #: What it acts on: joint, joint pair, link, ground, effort channels or column.
    place_kind: str = "joint"
    parameters: tuple[Parameter, ...]  #: As written to results and model files.
    #: As fitted; by default the parameters that have a step.
    coordinates: tuple[Coordinate, ...]
    #: Coordinates or parameters that add to attributes of the joint's actuator and sensors.
    adds: tuple[tuple[str, str], ...] = ()
    #: Whether it shows in what a motor takes, and not in a torque that is sensed at the joint.
    electric: bool = False
    excitation: str  #: The motion that shows it, in words.
    #: Whether it replaces, or takes a share of, what stands at its place or acts on it.
    replaces: bool = False
    #: Whether it is tried by itself; others are fitted together for a whole machine.
    competes: bool = True
    #: Whether what it adds does not depend on what else acts at the joint.
    additive: bool = False
    #: Lists of numbers that it has besides.
    tables: tuple[str, ...] = ()
    #: Whether it changes what the files state: it is applied before what is added to them.
    on_stated: bool = False
    #: Whether it changes what stands between joint and motor, which is one drivetrain option's own.
    of_drivetrain: bool = False
    unseen: str = ""  #: Why standing and walking do not see it; empty where they do.

    def __init_subclass__(cls) -> None:
        """Complete the coordinates; enter the catalogue."""
        super().__init_subclass__()
        if "parameters" in vars(cls) and "coordinates" not in vars(cls):
            cls.coordinates = tuple(p.coordinate for p in cls.parameters if p.step)
        if hasattr(cls, "name"):
            cls().enter()

    def enter(self) -> None:
        """Enter the catalogue."""
        EFFECTS.setdefault(self.name, self)
        if self.competes:
            COMPETING.append(self)

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
        more = {of: getattr(joint, of) + x[name] for name, of in self.adds}
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
