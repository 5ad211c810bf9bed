"""What docs/python.md shows is run, block by block, in one folder."""

import re
import shutil
from pathlib import Path

import pytest

import gmlc

ROOT = Path(__file__).resolve().parents[2]


def blocks() -> list[str]:
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


def test_the_page_has_blocks() -> None:
    assert len(blocks()) >= 2


def test_what_the_page_shows_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(ROOT / "examples" / "cup" / "cup.gml", tmp_path)
    model = gmlc.Model.load("cup.gml")
    for name in ("scan.ply", "other.ply"):
        gmlc.scan(model, name, spacing="3mm", seed=len(name))
    names = {"paths": ["scan.ply", "other.ply"]}
    for block in blocks():
        if "import ray" in block:
            # benches/batch/ray_jobs.py runs it.
            continue
        if "to_pyvista" in block:
            pytest.importorskip("pyvista")
        exec(compile(block, "docs/python.md", "exec"), names)  # noqa: S102
