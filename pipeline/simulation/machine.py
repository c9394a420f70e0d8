"""A machine: its files, numbers that differ for one run, and what is built of them.

A machine is never changed: its methods return another one, which keeps what the change leaves.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import InitVar, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from actuators.chain import Chain
from actuators.checked import checked, finite, write_text
from actuators.energy import supply
from actuators.errors import LegwattError, closest, known, one_line, some
from actuators.loading.build import CATALOG, Catalog, load_catalog
from actuators.parameters import dimension, quantity, to_si
from pipeline.dynamics.contact_forces import GroundForces
from pipeline.dynamics.joint_demand import JointDemand, motion_demand, segment_demand
from pipeline.effects.base import effect_named, place_text
from pipeline.effects.model_file import (
    Edit,
    ModelFile,
    apply_edits,
    assumed,
    model_text,
    new_model_file,
    read_model_file,
)
from pipeline.machine.machine import Drivetrains, MachineModel, drivetrains_of
from pipeline.machine.own_actuators import (
    AS_BUILT,
    Motors,
    OwnActuators,
    actuator_folder,
    own_actuators,
)
from pipeline.motion.gait import changed_table, gait_keys, gait_of, gait_table, with_payload
from pipeline.motion.walking import (
    DEFAULT_SAMPLES,
    stability_margins,
    standing_posture,
    walking_motion,
)
from pipeline.robot.check import check_robot, refused, source_of
from pipeline.robot.robot import Robot, load_robot, read_spec
from pipeline.robot.robot_file import (
    DEFAULT_ROBOT,
    GAIT_NUMBERS,
    RobotSpec,
    check_parameters,
    leg_list,
)
from pipeline.robot.urdf import MOVING, parse_elements
from pipeline.simulation.walk_stand import IDEAL, USUAL, Demand, Standing, Walking, WalkOptions

if TYPE_CHECKING:
    from collections.abc import Callable

    from pipeline.motion.motion import Motion

#: What a change of the table ``[gait]`` begins with.
GAIT: Final = "gait."
STANDING_FEET: Final = "standing.feet"
TOTAL_MASS: Final = "total_mass"


def with_changes(
    spec: RobotSpec, catalog: Catalog, changes: Mapping[str, object]
) -> tuple[RobotSpec, Catalog]:
    """Robot file and catalogue with changed numbers.

    `changes`: key to value, a number or its text, in the unit that the key's file writes.

    Raises:
        LegwattError: No such number, or none that can be; names it and the closest match.
    """
    for key, value in changes.items():
        try:
            if key.startswith(GAIT):
                table = changed_table(spec.gait, key.removeprefix(GAIT), value)
                spec = spec.model_copy(update={"gait": table})
                gait_table(spec)
            elif key == STANDING_FEET:
                standing = {"feet": _feet(spec, value)}
                spec = spec.model_copy(update={"standing": standing})
            else:
                spec, catalog = _with_number(spec, catalog, key, value)
        except LegwattError as error:
            reason = str(error).removeprefix(f"{spec.path}: ")
            raise LegwattError(f"{one_line(key)}={one_line(value)}: {reason}") from None
    if changes:  # two numbers that bind each other may change together
        check_parameters(spec.parameters, spec.robot.build, "changed numbers")
        for key in GAIT_NUMBERS.intersection(changes):
            _refuse_without_effect(spec, key)
    return spec, catalog


def _with_number(
    spec: RobotSpec, catalog: Catalog, key: str, value: object
) -> tuple[RobotSpec, Catalog]:
    """A number of the robot file or of an actuator, in the unit that its file writes."""
    numbers = {p.name: p for p in spec.parameters.rows()}
    numbers |= {f"{component}.{p.name}": p for component, p in catalog.rows()}
    if key not in numbers:
        hint = closest(key, [*gait_keys(), STANDING_FEET, *numbers])
        if not hint.startswith("did"):  # all names fill several screens
            hint = "parameters.csv of any run lists all names"
        raise LegwattError(f"there is no such number; {hint}")
    if key == TOTAL_MASS and not spec.robot.build:
        raise LegwattError(
            f"the bodies of this robot are those of {spec.urdf.name}, which it does not "
            "change; change masses there, or put a load on with gait.payload_mass='2 kg'"
        )
    unit = numbers[key].unit
    try:
        number = to_si(finite(float(value)), unit)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        number = quantity(value, dimension(unit))
    if key in spec.parameters:
        return spec.with_parameters({key: number}), catalog
    return spec, catalog.replaced(key, number)


def _feet(spec: RobotSpec, value: object) -> tuple[str, ...]:
    """Legs to stand on: ``all``, names in a text, or a list of them."""
    feet = [*spec.leg_names] if value == "all" else value
    if isinstance(feet, str):
        feet = [name.strip(" []\"'") for name in feet.split(",")]
    try:
        return leg_list(feet, [*spec.leg_names], STANDING_FEET)
    except LegwattError as error:
        raise LegwattError(f"{error}; expected such as LEG,LEG,LEG or all") from None


def _refuse_without_effect(spec: RobotSpec, key: str) -> None:
    """Refuse a number of the robot file that ``[gait]`` states in other words."""
    try:
        other = spec.with_parameters({key: 1.01 * spec.parameters[key]})
        one, two = ((g.period, *g.twist, *g.stride, g.lift) for g in map(gait_of, (spec, other)))
    except LegwattError:
        return  # numbers that contradict each other are in use
    if one == two:
        raise LegwattError(
            f"{key}: it changes nothing, the gait has numbers of its own in its place; change "
            "those of gait.stroke, gait.lift, gait.period, gait.speed that are stated"
        )


@dataclass(frozen=True, eq=False)
class Machine:
    """A robot, its actuators, and the effects that a log showed it to have."""

    path: Path  #: Robot file, or the URDF of a robot on a fixed base.
    #: The robot file's contents, without changes, or what one would say of the URDF.
    written: RobotSpec = field(repr=False)
    written_catalog: Catalog = field(repr=False)  #: Actuators as their files state them.
    actuator_folder: Path | None = None  #: Of the user's own; None for the project's catalogue.
    model_file: ModelFile | None = field(default=None, repr=False)  #: Effects; None without.
    model_path: Path | None = None  #: Where they were read; None without a file.
    #: Numbers that differ from the files', by name.
    changes: Mapping[str, object] = field(default_factory=dict)
    options: WalkOptions = USUAL  #: How it stands and walks.
    alternative: str = ""  #: Drivetrain with which logs are compared; empty for none.
    tolerant: bool = False  #: Whether bodies beyond the triangle inequality are only told of.
    #: A machine of the same files, of which what stays is not built again.
    before: InitVar[Machine | None] = None
    #: The actuators with changed numbers, and what single joints have of their own.
    own: OwnActuators = field(init=False, repr=False)
    #: The robot without the payload of its gait, and with it.
    unloaded: Robot = field(init=False, repr=False)
    robot: Robot = field(init=False, repr=False)
    body_warnings: tuple[str, ...] = field(init=False, repr=False)  #: On the robot's bodies.

    def __post_init__(self, before: Machine | None) -> None:
        spec, catalog = with_changes(self.written, self.written_catalog, self.changes)
        own, bodies = None, spec
        old = None if before is None else before.unloaded
        if old is not None:  # no body hangs on the gait and the standing feet
            same = {"gait": old.spec.gait, "standing": old.spec.standing}
            bodies = spec.model_copy(update=same)
        if before is not None and old is not None and bodies == old.spec:
            robot = old if spec == old.spec else replace(old, spec=spec)
            warnings = before.body_warnings
            own = before.own if catalog is before.catalog else None
        else:
            robot = load_robot(spec)
            tolerant = self.tolerant or not spec.sources  # with a URDF alone logs are compared
            found, where = check_robot(robot), source_of(robot)
            warnings = refused(found, where, tolerant=tolerant)
        loaded = before.robot if before is not None and robot is old else with_payload(robot)
        own = own or own_actuators(spec, catalog)
        built = {"own": own, "unloaded": robot, "robot": loaded, "body_warnings": warnings}
        vars(self).update(built)

    def __str__(self) -> str:
        """Robot, drivetrain options, effects and numbers that differ, a line each."""
        edits = self.edits
        changed = ", ".join(f"{key}={value}" for key, value in self.changes.items())
        legs = f", legs {', '.join(self.robot.leg_names)}" if self.robot.leg_names else ""
        lines = [f"machine of {self.path}"]
        lines.append(f"{self.edited.mass:.4g} kg, {len(self.robot.joints)} joints{legs}")
        lines.append(f"drivetrain options: {', '.join(self.catalog.alternatives)}")
        lines += [some([f"{e.effect} at {', '.join(e.place)}" for e in edits], 4)] * bool(edits)
        return "\n".join([*lines, f"changed: {changed}"] if changed else lines)

    # What it is built of

    @property
    def edits(self) -> tuple[Edit, ...]:
        """The effects, in order."""
        return self.model_file.edits if self.model_file else ()

    @cached_property
    def edited(self) -> Robot:
        """The robot with what the effects change in bodies and ground."""
        rigid = self._edited.rigid
        return self.robot if rigid is self.robot.model else replace(self.robot, model=rigid)

    @property
    def catalog(self) -> Catalog:
        """Actuator components and alternatives."""
        return self.own.catalog

    @property
    def drivetrain(self) -> str:
        """The alternative that effects are taken to belong to where nothing says so."""
        others = [name for name in self.catalog.alternatives if name != IDEAL]
        if not (self.own.usual or others):
            raise LegwattError(
                "effects need an actuator with a motor of its own; add an alternative"
            )
        return self.own.usual or others[0]

    def _bare(self, alternative: str) -> MachineModel:
        """Robot, actuators and sensors before the effects.

        `alternative`: drivetrain option; empty where a log's torque is the actuators' own.
        """
        none = drivetrains_of(Chain(""), self.robot.joints)
        return MachineModel(self.robot, self.own.actuators(alternative) if alternative else none)

    @cached_property
    def _edited(self) -> MachineModel:
        """With the effects, and the drivetrain option that they belong to."""
        file = self.model_file
        bare = self._bare((file.alternative or self.drivetrain) if file else "")
        return apply_edits(bare, self.edits)

    def counts_in(self, alternative: str) -> bool:
        """Whether all that the effects change in actuators counts in a drivetrain option.

        The ideal one has no losses by definition; there is nothing to report about it.
        """
        of = self.model_file.alternative if self.model_file else ""
        return alternative in (IDEAL, of) or not self._of_drivetrain

    @property
    def _of_drivetrain(self) -> list[Edit]:
        """Effects between joint and motor.

        Found against a motor's data sheet alone, they are all that the machine's gears lose. Other
        options have gears with losses of their own in the catalogue, to which they cannot be added.
        """
        return [edit for edit in self.edits if effect_named(edit.effect).of_drivetrain]

    @property
    def forces(self) -> GroundForces:
        """How the ground's forces are chosen; the gait's friction coefficient counts by default."""
        mu = self.options.friction_coefficient
        if mu is None and self.robot.spec.floating:
            mu = gait_table(self.robot.spec).friction_coefficient
        return GroundForces(self.options.forces, mu)

    @cached_property
    def motion(self) -> Motion | None:
        """A motion of the user's in place of the gait; None to walk."""
        if self.options.motion is None:
            return None
        from pipeline.simulation.own_motion import read_motion  # pandas, where it is needed

        given = self.options.motion
        return read_motion(Path(given) if isinstance(given, str) else given, self.edited)

    @cached_property
    def _chains(self) -> Mapping[str, Drivetrains]:
        out = dict(self.own.every)
        for name in (name for name in out if self.edits and name != IDEAL):
            left = [] if self.counts_in(name) else self._of_drivetrain
            edits = [edit for edit in self.edits if edit not in left]
            out[name] = apply_edits(self._bare(name), edits).drivetrains
        return out

    def chains(self, *names: str) -> dict[str, Drivetrains]:
        """Drivetrains with their effects, by name; all by default."""
        every = self._chains
        return {n: every[known("no alternative", n, every)] for n in names or every}

    def beside_ideal(self, actuator: str | None) -> dict[str, Drivetrains]:
        """One drivetrain beside the ideal one, to which ratios refer; all where none is named."""
        if actuator is None:
            return self.chains()
        self.chains(actuator)  # refuses one that there is not
        return self.chains(*(n for n in self.catalog.alternatives if n in (IDEAL, actuator)))

    @property
    def motors(self) -> Motors:
        """Whose motors drive the joints, and what they weigh.

        Those of the alternative with which logs are compared, else as it is built, else all.
        """
        own, components = self.own, self.catalog.components
        usual = self.alternative or own.usual
        names = [usual] if usual else [*self.catalog.alternatives]
        joints = self.robot.joints
        rows = [own.actuators(n).joints for n in names]
        ratios = [joint.ratio for row in rows for joint in row]
        mass = np.array([[j.motor.mass if j.motor else 0.0 for j in row] for row in rows])
        built = own.built.values() if usual == AS_BUILT else names
        titles = (components[self.catalog.alternatives[name].motor].title for name in built)
        return Motors(
            titles=tuple(dict.fromkeys(titles)),
            joints=len(joints),
            ratio=(min(ratios), max(ratios)),
            mass=(float(mass.min()), float(mass.max())),
            total=float(mass.sum(axis=1).max()) if (mass > 0).all() else 0.0,
            robot=self.edited.mass,
            stated=self.actuator_folder is not None or own.stated,
        )

    # What it does

    def stand(self, chains: Mapping[str, Drivetrains]) -> Standing:
        """Stand still on the robot file's standing feet and hold."""
        segment = standing_posture(self.edited)
        demand, contacts = segment_demand(self.edited, segment, forces=self.forces)
        assert contacts is not None
        demand = self._beside_drives(demand)
        torque, position = demand.torque[0], demand.position[0]
        holding = {name: chain.holding(torque, position) for name, chain in chains.items()}
        return Standing(segment, demand, contacts, holding)

    def demand(self, motion: Motion | None = None) -> Demand:
        """What a motion demands of the actuators, by the ground's forces and by the effects.

        `motion`: its own, or one cycle of the gait, by default.
        """
        motion = motion or self.motion or walking_motion(self.edited, samples=self.options.samples)
        of = motion_demand(self.edited, motion, forces=self.forces)
        parts = tuple(map(self._beside_drives, of.segments))
        return Demand(parts, of.contacts, motion, self.edited.sliding_joints)

    def _beside_drives(self, demand: JointDemand) -> JointDemand:
        """What springs and ripples beside the drives leave to them."""
        torque = np.array(demand.torque)
        for k, actuator in enumerate(self._edited.actuators):
            torque[:, k] = actuator.drive_load(demand.position[:, k], torque[:, k])
        return replace(demand, torque=torque)

    def walk(self, chains: Mapping[str, Drivetrains]) -> Walking:
        """Walk one gait cycle, or move as its own motion says."""
        demand = self.demand()
        results = {name: chain.inverse(demand.series) for name, chain in chains.items()}
        steady = demand.motion.segments if self.edited.floating else ()
        margins = tuple(stability_margins(self.edited, segment) for segment in steady)
        supplies = {n: supply(r, self.options.regeneration) for n, r in results.items()}
        return Walking(demand, margins, results, supplies)

    # What logs are compared with

    @cached_property
    def bare_model(self) -> MachineModel:
        """Bodies, actuators and sensors before the effects, with the drivetrain `alternative`."""
        return self._bare(self.alternative)

    @cached_property
    def model(self) -> MachineModel:
        """The same with the effects of the model file."""
        return apply_edits(self.bare_model, self.edits)

    @cached_property
    def stated_file(self) -> ModelFile:
        """A model file of this machine as it is: with hashes of today, edits where there are."""
        old = self.model_file
        new = new_model_file(self.path, self.alternative, self.actuator_folder or CATALOG)
        update = {"edits": old.edits, "noise": old.noise} if old else {}
        return new.model_copy(update=update)

    @cached_property
    def mimics(self) -> dict[str, str]:
        """Moving joints that mimic another, to the other's name; no log may move them."""
        joints = parse_elements(self.robot.urdf, str(self.path)).findall("joint")
        pairs = [(j.get("name", ""), j.find("mimic")) for j in joints if j.get("type") in MOVING]
        return {name: mimic.get("joint", "") for name, mimic in pairs if mimic is not None}

    # What a reader should know

    @property
    def inputs(self) -> tuple[Path, ...]:
        """Every file that was read."""
        spec = self.robot.spec
        files = [*spec.sources, *([] if spec.robot.build else [spec.urdf])]
        if spec.sources or self.alternative:
            files += sorted((self.actuator_folder or CATALOG).glob("*.toml"))
        moved = self.options.motion
        more = (self.model_path, moved if isinstance(moved, str | Path) else None)
        return (*files, *(Path(file) for file in more if file))

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a reader of the numbers should know of the robot and the effects."""
        file = self.model_file
        if file is None:
            return self.body_warnings
        names = dict.fromkeys(edit.effect for edit in file.edits)
        unseen = {name: effect_named(name).unseen for name in names}
        left = [f"{name} is left out: {why}" for name, why in unseen.items() if why]
        if of := ", ".join(dict.fromkeys(place_text(edit.place) for edit in self._of_drivetrain)):
            against = f"'{file.alternative}'" if file.alternative else "no actuator at all"
            left.append(
                f"what was found of the drivetrain of {of} was found against {against} and counts "
                "there alone: other actuators have gears with losses of their own, to which it "
                "cannot be added"
            )
        return (*self.body_warnings, *file.changed, *left)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What of the files a reader of a comparison with logs should know."""
        numbers = ", ".join(f"{key}={value}" for key, value in self.changes.items())
        told = f"numbers changed for this run alone: {numbers}; a model file does not hold them"
        old = self.model_file.changed if self.model_file else ()
        return (*[told] * bool(self.changes), *self.body_warnings, *old)

    @property
    def record(self) -> dict[str, Any]:
        """What the record of a run says of the machine and how it walks."""
        moved, spec = self.options.motion, self.robot.spec
        options = self.options.model_dump(exclude={"motion"}, exclude_none=True)
        if moved is not None:
            options["motion"] = str(moved) if isinstance(moved, str | Path) else "a table"
        if self.forces.friction_coefficient is not None:
            options["friction_coefficient"] = self.forces.friction_coefficient
        return {
            "urdf_sha256": hashlib.sha256(self.robot.urdf.encode()).hexdigest(),
            "options": {
                "set": [f"{key}={value}" for key, value in self.changes.items()],
                **options,
                "transfer_path": gait_table(spec).transfer_path,
                "effects": [edit.effect for edit in self.edits],
            },
            "conventions": "SI units; x forward, y left, z up; torque and velocity positive in the "
            "joint's direction; electrical power positive from supply to motor",
            "zero_pose": spec.robot.zero_pose,
            "warnings": list(self.remarks),
        }

    # Other machines

    def walking(self, **options: Any) -> Machine:
        """The same machine, to stand and walk with these options; see `WalkOptions`."""
        given = {name: value for name, value in options.items() if value is not None}
        made = checked(WalkOptions, given, "walking")
        if made.motion is not None and made.samples != DEFAULT_SAMPLES:
            raise LegwattError(
                f"samples {made.samples}: a motion of its own has the samples of its file"
            )
        if made.motion is None and not self.robot.floating:
            raise LegwattError(
                f"{self.path}: a robot on a stand neither stands nor walks; give its joints' "
                "motion to walk by, or a robot file with a floating base, as `init` writes it"
            )
        out = self._but("motion", options=made)
        _ = out.motion, out.forces
        return out

    def _but(self, *stale: str, **new: Any) -> Machine:
        """The same with other attributes, without what was computed of them."""
        out = copy(self)
        for name in stale:
            vars(out).pop(name, None)
        vars(out).update(new)
        return out

    def with_values(self, values: Mapping[str, object]) -> Machine:
        """The same machine with other numbers; no file is read for an actuator's or the gait's.

        `values`: name of a number to its value, in the unit its file writes: ``hip_spacing``,
        ``harmonic_drive.load``; what ``[gait]`` states, ``gait.slope_forward``, with its unit in
        the text (``"5 deg"``); ``standing.feet``.

        Raises:
            LegwattError: No such number, or a value that cannot be.
        """
        return replace(self, changes={**self.changes, **values}, before=self)

    def with_effect(
        self,
        effect: str,
        place: str | Sequence[str],
        values: Mapping[str, float],
        *,
        alternative: str | None = None,
    ) -> Machine:
        """The same machine with one effect more, as a model file states it.

        Args:
            effect: Of the catalogue of effects, e.g. ``coulomb_friction``.
            place: Joint, joints, link or ground.
            values: The effect's parameters by name, in SI units.
            alternative: Drivetrain option it belongs to; that of the effects that are there, the
                robot file's, or the first that is not ideal, by default.

        Raises:
            LegwattError: No such effect, parameter or place, or a value out of bounds.
        """
        places = (place,) if isinstance(place, str) else tuple(place)
        edit = assumed(effect, places, values, "set by with_effect")
        old = self.model_file
        name = alternative or (old.alternative if old else self.drivetrain)
        file = new_model_file(self.path, name, self.actuator_folder or CATALOG)
        return self.with_model(file.with_edits([*self.edits, edit]))

    def with_model(self, file: ModelFile) -> Machine:
        """The same machine with these effects in place of its own."""
        out = replace(self, model_file=file, model_path=None, before=self)
        _ = out.edited
        return out

    def with_robot(self, change: Callable[[Robot], Robot]) -> Machine:
        """The same machine with other bodies, the effects on them kept."""
        stale = ("_chains", "bare_model", "model", "motion")
        return self._but(*stale, robot=change(self.robot), edited=change(self.edited))

    def save(self, path: str | Path) -> Path:
        """Write the effects as a model file, which `load` and the command line's ``--model`` read.

        Changed numbers are not in it: `load` takes them again.

        Raises:
            LegwattError: The machine has no effects. The file cannot be written.
        """
        if self.model_file is None:
            raise LegwattError(f"{self.path}: the machine has no effects to write")
        write_text(Path(path), model_text(self.model_file, Path(path).absolute().parent))
        return Path(path)


def read_machine(
    robot: Path | None = None,
    *,
    model: Path | None = None,
    actuators: Path | None = None,
    changes: Mapping[str, object] | None = None,
    **more: Any,
) -> Machine:
    """Read what names a machine, and build it.

    What is not given is the model file's, the robot file's or the project's; `more` is passed to
    `Machine`.

    Raises:
        LegwattError: A file cannot be used; a robot that cannot be, or a change of none of its
            numbers.
    """
    file = read_model_file(model, actuators, robot) if model else None
    path = robot or (file.robot if file else DEFAULT_ROBOT)
    spec = read_spec(path)
    own = actuator_folder(spec)
    if actuators and own:  # what the table says is of the parts of its folder
        spec = spec.model_copy(update={"actuators": {}})
    actuators = actuators or own
    catalog = load_catalog(actuators or CATALOG)
    return Machine(path, spec, catalog, actuators, file, model, dict(changes or {}), **more)
