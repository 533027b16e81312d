"""The examples run, and come to what they claim."""

import re
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from depthtrack.hand.synergies import load_synergies
from tests.support.runs import synthesise

FOLDER = Path(__file__).parent.parent / "examples"
MOST_LINES = 40


def example(name: str) -> ModuleType:
    spec = spec_from_file_location(name, FOLDER / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_examples_are_short_and_all_of_them_are_tested() -> None:
    tested = set(re.findall(r'example\("(\w+)"\)', Path(__file__).read_text()))
    files = list(FOLDER.glob("*.py"))
    assert {file.stem for file in files} == tested
    assert all(len(file.read_text().splitlines()) <= MOST_LINES for file in files)


def test_tracking_follows_every_frame(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording = synthesise(tmp_path / "everyday", 4, "--model", "skin")
    assert example("track_recording").main(str(recording)) == 4
    lines = capsys.readouterr().out.splitlines()[-4:]
    depths = [float(line.split()[-2]) for line in lines]
    assert all(400 < depth < 600 for depth in depths)


def test_a_benchmark_of_ones_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    report = example("synthetic_benchmark").main(str(tmp_path), frames=2, distances=(0.5,), jobs=1)
    assert report.exists()
    assert "at-0.5-m" in capsys.readouterr().out


def test_the_truth_has_the_lowest_energy() -> None:
    energies = example("score_hypotheses").main(count=60)
    assert energies.argmin() == 0
    assert np.median(energies[:20]) < np.median(energies[40:])


def test_synergies_are_fitted_and_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    synergies = example("fit_synergies").main(None, str(tmp_path / "synergies.json"))
    shares = [float(share) for share in re.findall(r"([\d.]+)% of the variance", capsys.readouterr().out)]
    assert shares == sorted(shares)
    assert shares[-1] > 90
    np.testing.assert_allclose(
        load_synergies(tmp_path / "synergies.json").variances, synergies.variances, rtol=1e-3, atol=1e-9
    )
