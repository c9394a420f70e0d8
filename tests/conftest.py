"""Fixtures shared by all packages."""

import json
import os
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest
from hypothesis import settings
from matplotlib.figure import Figure

from pipeline.motion.motion import Motion
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from reports.figures import style as saving
from tests.command_line import DEMO, Command, Refused, exit_code

# No clock in a test: a loaded machine is no failure.
settings.register_profile("legwatt", deadline=None)
settings.load_profile("legwatt")

ROOT = Path(__file__).parents[1]
SKETCH = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 1"></svg>\n'
os.environ.setdefault("MPLBACKEND", "Agg")


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def hexapod() -> Robot:
    return load_robot(load_robot_file(ROOT / "urdf" / "hexapod.toml"))


@pytest.fixture(scope="session")
def walk(hexapod: Robot) -> Motion:
    return walking_motion(hexapod)


@pytest.fixture(scope="session")
def command(root: Path) -> Command:
    def run(verb: str, out: Path, *more: str, robot: str | Path = "hexapod.toml") -> int:
        return exit_code([verb, "--robot", str(root / "urdf" / robot), "--out", str(out), *more])

    return run


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]) -> Refused:
    """The one line of a command that leaves with a code, prints nothing else, makes no folder."""

    def line(arguments: Sequence[str | Path], out: Path | None = None, code: int = 2) -> str:
        capsys.readouterr()
        to = ["--out", str(out)] if out else []
        left = exit_code([*map(str, arguments), *to])
        said = capsys.readouterr()
        assert left == code, said.err
        assert said.out == ""
        assert said.err.endswith("\n")
        assert said.err.count("\n") == 1, said.err
        assert "Traceback" not in said.err
        assert out is None or not out.exists()
        return said.err

    return line


@pytest.fixture(scope="session")
def out(tmp_path_factory: pytest.TempPathFactory, command: Command) -> Path:
    """The tables of standing and walking, which write a folder each, with every default."""
    folder, files = tmp_path_factory.mktemp("out"), {}
    for verb in ("stand", "walk"):
        assert command(verb, folder / verb) == 0
        shutil.copytree(folder / verb, folder, dirs_exist_ok=True)
        shutil.rmtree(folder / verb)
        record = json.loads((folder / "datapackage.json").read_text("utf-8"))
        files |= {one["path"]: one for one in record["resources"]}
    whole = json.dumps(record | {"resources": [*files.values()]})
    (folder / "datapackage.json").write_text(whole, "utf-8")
    return folder


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the measured logs of real machines."""
    root = os.environ.get("LEGWATT_SHARED")
    if not root or not (Path(root) / "data").is_dir():
        pytest.skip("LEGWATT_SHARED does not name the folder of the measured logs")
    return Path(root) / "data"


@pytest.fixture(scope="module")
def sketched() -> Iterator[None]:
    """Figures are files, but not rendered, for tests of what stands beside them.

    Every figure of a run is rendered and measured in `tests/reports/test_figures.py`.
    """

    def save(figure: Figure, folder: Path, name: str) -> None:
        assert figure.axes
        (folder / f"{name}.svg").write_text(SKETCH, encoding="utf-8")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(saving, "save_figure", save)
        yield


@pytest.fixture(scope="session")
def short_demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first four seconds of the demonstration's log: two steps of each tripod."""
    import pyarrow.parquet as pq

    path = tmp_path_factory.mktemp("demo") / "short.parquet"
    pq.write_table(pq.read_table(DEMO).slice(0, 2000), path)
    return path
