"""A run of the standard matrix: made, sealed, stopped, gone on, opened and written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from pipeline.cli import blind_standard
from pipeline.cli.main import main


def test_a_stopped_run_goes_on_and_writes_its_tables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[str] = []

    def fake_ask(folder: str, robot: str, out: str, more: Any) -> dict[str, Any]:
        files = sorted(p.name for p in Path(folder).iterdir())
        assert files == ["log.csv", "machine.urdf", "mapping.toml", "test.csv"]
        assert robot in files
        assert set(more) >= {"test.csv", "mapping.toml"}
        asked.append(Path(folder).name)
        if len(asked) == 2:
            raise KeyboardInterrupt
        Path(out).mkdir(parents=True, exist_ok=True)
        (Path(out) / "candidates.csv").write_text("effect,joint,place,verdict\n", encoding="utf-8")
        header = "order,effect,joint,parameter,value,ci_low,ci_high,gap_before,gap_after"
        (Path(out) / "found.csv").write_text(f"{header},noise_floor,doubt,written\n", "utf-8")
        return {"code": 0, "seconds": 1.0, "message": ""}

    monkeypatch.setattr(blind_standard, "ask", fake_ask)
    out = tmp_path / "run"
    words = ["blind", "--matrix", "standard", "--trials", "3", "--workers", "1", "--out", str(out)]
    main(words)
    assert not (out / "blind_standard_rates.csv").exists()
    main([*words, "--resume"])
    assert asked.count("0000") == 1  # what was answered before the stop is kept
    assert set(asked) == {"0000", "0001", "0002"}
    capsys.readouterr()
    for name in ("trials", "rates", "by_effect", "reliability"):
        assert (out / f"blind_standard_{name}.csv").is_file()
    first = json.loads((out / "sealed" / "0000.json").read_text(encoding="utf-8"))
    seal = out / "sealed" / "0000.json"
    seal.write_text(json.dumps(first | {"hidden": []}), encoding="utf-8")
    assert main([*words, "--resume"]) == 2
    assert "not what was sealed" in capsys.readouterr().err
