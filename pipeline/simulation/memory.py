"""Memory that a run would need, so that it is refused with a word and not killed without one."""

from __future__ import annotations

import os
import re
from pathlib import Path

from pipeline.errors import GaitError

#: Peak of `walk`, measured over samples: per sample, segment and joint, and the same again for
#: every actuator, a fifth more than was seen [bytes].
PER_SAMPLE = 200
PER_ALTERNATIVE = 400
SEGMENTS = 2
#: Limits a container may set, and what of them is in use.
_CGROUPS = (
    ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
    (
        "/sys/fs/cgroup/memory/memory.limit_in_bytes",
        "/sys/fs/cgroup/memory/memory.usage_in_bytes",
    ),
)


def needed(samples: int, joints: int, alternatives: int) -> int:
    """Memory of one walking cycle [bytes]; samples are those of half a period."""
    return samples * SEGMENTS * joints * (PER_SAMPLE + PER_ALTERNATIVE * alternatives)


def free() -> int:
    """Memory that can still be had, of the machine or of the container [bytes]."""
    free = re.search(r"^MemAvailable: +(\d+)", _text("/proc/meminfo"), re.MULTILINE)
    all_there_is = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    amounts = [1024 * int(free[1]) if free else all_there_is]
    for limit, used in _CGROUPS:
        numbers = _text(limit).strip(), _text(used).strip()
        if all(number.isdigit() for number in numbers):  # "max" where there is none
            amounts.append(int(numbers[0]) - int(numbers[1]))
    return min(amounts)


def _text(path: str) -> str:
    try:
        return Path(path).read_text(encoding="utf-8")
    except OSError:
        return ""


def refuse_beyond_memory(samples: int, joints: int, alternatives: int) -> None:
    """Refuse a cycle that does not fit into memory, before anything is computed.

    Raises:
        GaitError: It needs more than is free; says how much, and how many samples fit.
    """
    need, have = needed(samples, joints, alternatives), free()
    if need <= have:
        return
    raise GaitError(
        f"--samples {samples}: {joints} joints and {alternatives} actuators need about "
        f"{need / 1e9:.4g} GB of memory ({need / samples / 1e3:.3g} kB per sample), "
        f"{have / 1e9:.3g} GB are free; at most {have * samples // need} samples fit, and "
        "energies change by less than 1 % from 51 on"
    )
