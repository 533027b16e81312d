"""Test the benchmark of surface fitting: settings, units, and correct poses."""

import json
from dataclasses import fields, replace
from pathlib import Path

import pytest

from depthtrack.benchmarks.speed import ik
from depthtrack.benchmarks.speed.ik import DISTANCE, HEADLINE, SETTINGS, Setting
from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.synthesis.generate import Synthesis
from depthtrack.synthesis.observations import ObservedMotion


@pytest.fixture(scope="module")
def motion() -> ObservedMotion:
    return ObservedMotion(Synthesis(model="skin", distance=DISTANCE))


@pytest.mark.slow
def test_the_first_setting_has_3000_points_and_five_by_five_iterations(motion: ObservedMotion) -> None:
    assert SETTINGS[0] == HEADLINE
    row = ik.measure(motion, HEADLINE, 1e-6)
    assert 2800 < row.points < 3200
    assert (row.model, row.residual, row.freedom, row.threads) == ("skin", "symmetric", "26", 1)
    assert (row.icp, row.inner) == (5, 5)
    assert 0 < row.error_deg < 1
    assert 0 < row.error_mm < 1
    # Each of the four frames is called at least once.
    assert row.calls == 4
    assert 0 < row.frame_ms <= row.frame_ms_median
    assert {"target", "predict", "fit", "retry"} <= set(row.stage_ms)
    assert 0 < row.iteration_us <= row.iteration_us_median
    assert row.frames_per_s == pytest.approx(1000 / row.frame_ms)


@pytest.mark.parametrize(
    ("setting", "lowest_deg", "highest_deg"),
    [
        (Setting("cylinders", "point"), 1.5, 5),
        # Six synergies alone have an error of more than two degrees.
        (Setting("skin", "plane", "6+6"), 2, 5),
        (replace(HEADLINE, subsample=30, icp=2, inner=1), 0.3, 3),
    ],
)
def test_a_row_belongs_to_its_setting(
    motion: ObservedMotion, setting: Setting, lowest_deg: float, highest_deg: float
) -> None:
    row, headline = ik.measure(motion, setting, 1e-6), ik.measure(motion, HEADLINE, 1e-6)
    for name in ("model", "residual", "freedom", "icp", "inner"):
        assert getattr(row, name) == getattr(setting, name)
    assert row.points == pytest.approx(headline.points * HEADLINE.subsample / setting.subsample, abs=1)
    assert headline.error_deg < lowest_deg < row.error_deg < highest_deg


def test_all_combinations_occur_once() -> None:
    assert len(set(SETTINGS)) == len(SETTINGS)
    combinations = {(s.model, s.residual, s.freedom) for s in SETTINGS if s.subsample == 3}
    assert len(combinations) == 3 * 3 * 2
    for seconds in (0.0, float("nan"), 1e9):
        with pytest.raises(InputError, match="seconds"):
            ik.plan(seconds)


def test_the_command_prints_text_and_writes_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ik, "plan", lambda seconds: ik.IkPlan(seconds, (HEADLINE, Setting("cylinders"))))
    out = tmp_path / "bench.json"
    arguments = ["bench", "ik", "--seconds", "0.01", "--out", str(out)]
    assert main([*arguments, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report == json.loads(out.read_text())
    assert [row["model"] for row in report["rows"]] == ["skin", "cylinders"]
    assert set(report["rows"][0]) == {field.name for field in fields(ik.IkRow)}
    assert report["machine"]["versions"]["numba"]
    assert main(arguments) == 0
    lines = capsys.readouterr().out.splitlines()
    assert sum(line.startswith(("skin ", "cylinders ")) for line in lines) == 2
    assert any("3,0" in line and "5 x 5" in line for line in lines)
