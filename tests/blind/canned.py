"""An answer that any workflow could write, which worker processes can import."""

from pathlib import Path

from tests.blind.test_judge import MODEL


def answer(folder: Path, options: list[str]) -> dict[str, object]:
    """What any workflow could write."""
    assert (folder / "given" / options[0]).exists()
    assert not (folder / "given" / "truth.json").exists()
    return {"code": 1, "seconds": 1.0, "message": "", "files": {"model.toml": MODEL}}
