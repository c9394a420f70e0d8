"""How a machine stands and walks: declared once, for Python, command line and record alike."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal, Self

from pydantic import BeforeValidator, Field

from actuators.checked import Number, Table, checked
from actuators.energy.energy import recovery
from actuators.errors import LegwattError

#: Every joint's energy is then within 0.7 % of the limit of fine sampling, on every transfer path.
LEAST_SAMPLES: Final = 51
#: A cycle of a robot of 18 joints then takes some 7 GB of memory.
MOST_SAMPLES: Final = 100_000
SAMPLES: Final = 751


def _known(text: object) -> str:
    recovery(str(text))
    return str(text)


class WalkOptions(Table):
    """Options of standing and walking; names and defaults are the command line's."""

    noun = "option"
    samples: int = Field(
        default=SAMPLES,
        ge=LEAST_SAMPLES,
        le=MOST_SAMPLES,
        description="per half period of the gait",
    )
    quasi_static: bool = Field(default=False, description="leave out the links' inertial terms")
    regeneration: Annotated[str, BeforeValidator(_known)] = Field(
        default="none",
        description="what becomes of electrical energy that motors return: none (it is lost), bus "
        "(other motors use it at that instant), or the fraction that is used again, e.g. 0.5",
    )
    forces: Literal["least_tangential", "least_torque"] = Field(
        default="least_tangential",
        description="how the ground's forces are chosen: least_tangential (the paper's rule) or "
        "least_torque (joint torques squared)",
    )
    friction_coefficient: Annotated[Number, Field(gt=0)] | None = Field(
        default=None,
        description="greatest tangential over normal force of a foot; gait.friction_coefficient, "
        "else no limit, by default",
    )
    #: CSV file or DataFrame of time, joint positions and contacts; see
    #: `pipeline.simulation.own_motion` for its columns.
    motion: Any = Field(
        default=None,
        description="CSV to move by instead of the gait: time_s, JOINT__position_rad and, unless "
        "the base is fixed, LEG__contact (0 or 1); base__x_m to base__yaw_rad where known",
    )

    @classmethod
    def of(cls, **options: Any) -> Self:
        """Options by name, those that are None left out.

        Raises:
            LegwattError: One does not exist or is out of range.
        """
        given = {name: value for name, value in options.items() if value is not None}
        made = checked(cls, given, "walking")
        if made.motion is not None and made.samples != SAMPLES:
            raise LegwattError(
                f"samples {made.samples}: a motion of its own has the samples of its file"
            )
        return made


USUAL: Final = WalkOptions()
