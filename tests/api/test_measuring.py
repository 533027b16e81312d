"""Calibration from Python. Its accuracy is tested in tests/calibration."""

from pathlib import Path
from typing import Any

import pytest

import depthtrack as dt
from depthtrack.api import measuring
from depthtrack.api.choices import Recording
from depthtrack.calibration.options import CalibrationOptions


@pytest.mark.parametrize("as_object", [False, True])
def test_the_arguments_reach_the_calibration(path: Path, monkeypatch: pytest.MonkeyPatch, as_object: bool) -> None:
    seen: list[Any] = []
    stages: list[str] = []

    def calibrate(
        sequence: Any,
        side: Any,
        views: Any,
        segmentation: Any,
        seed: Any,
        threads: Any,
        frames: Any,
        progress: Any,
        options: Any,
    ) -> str:
        seen.extend((len(sequence), side, seed, threads, frames, options))
        progress("measuring", 1.0)
        return "a calibration"

    monkeypatch.setattr(measuring, "calibrate_side", calibrate)
    recording: Recording = dt.open_recording(path) if as_object else str(path)
    found: Any = dt.calibrate(
        recording,
        "left",
        seed=3,
        threads=1,
        frames=2,
        progress=lambda stage, share: stages.append(stage),
        options=CalibrationOptions(skin_rounds=0),
    )
    assert found == "a calibration"
    assert seen == [4, "left", 3, 1, 2, CalibrationOptions(skin_rounds=0)]
    assert stages == ["measuring"]


def test_only_rigs_are_scaled(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measuring, "choose_views", lambda sequence, segmenter: [])
    with pytest.raises(dt.InputError, match="rigged mesh"):
        dt.calibrate_rig(path, dt.HandShape())
