"""`depthtrack markers layout`: files that other commands read, and mistakes of the user."""

import json
from pathlib import Path

import pytest

from depthtrack.cli import main
from depthtrack.hand.pose import ANGLE_NAMES
from depthtrack.markers.layout.options import LayoutOptions
from depthtrack.markers.layout.search import find_layout_of
from depthtrack.markers.models.model_choice import choose_models
from depthtrack.solver.options import SwarmOptions


def test_a_layout_is_written_with_its_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    small = LayoutOptions(swarm=SwarmOptions(particles=50, generations=5), kicks=0)
    search = find_layout_of
    monkeypatch.setattr(
        "depthtrack.markers.layout.search.find_layout_of",
        lambda quality, count, options, seed: search(quality, count, small, seed),
    )
    out = tmp_path / "four.json"
    assert main(["markers", "layout", "--motion", "grasp", "--markers", "4", "-o", str(out), "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert len(figures["markers"]) == 5
    assert figures["markers"][-1].startswith("wrist: ")
    assert figures["components"] == 4
    assert 0 < figures["error_mm"] < 20
    assert (tmp_path / "four.png").read_bytes().startswith(b"\x89PNG")
    (model,) = choose_models([f"left:{out}"])
    assert len(model.labels) == 5


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--motion", "nonsense", "--markers", "4", "-o", "a.json"], "there is no motion 'nonsense'"),
        (
            ["--motion", "grasp", "--markers", "1", "-o", "a.json", "--components", "6"],
            "needs 2 to 64 markers",
        ),
        (["--motion", "grasp", "--markers", "4", "-o", "a.txt"], "-o must end in .json"),
        (["--motion", "grasp", "--markers", "4", "-o", "a.json", "--cameras", "1"], "from 2 to 64"),
        (["--motion", "grasp", "--markers", "4", "-o", "a.json", "--radius", "0"], "from 0.5 to 20"),
        (["--motion", "grasp", "--markers", "0", "-o", "a.json"], "from 1 to 64"),
        (["--motion", "--markers", "4", "-o", "a.json"], "a layout needs motions to show"),
        (["--motion", "two.csv", "--markers", "4", "-o", "a.json"], "a motion of 5 postures or more, found 2"),
        (["--motion", "two.csv", "two.csv", "--markers", "4", "-o", "a.json"], "5 postures or more"),
        (["--motion", "one.csv", "--markers", "4", "-o", "a.json"], "two postures or more that differ, found 1"),
    ],
)
def test_mistakes_are_stated(
    arguments: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    postures = [",".join(ANGLE_NAMES), *(",".join([f"0.{k}"] * len(ANGLE_NAMES)) for k in (1, 2))]
    (tmp_path / "two.csv").write_text("\n".join(postures) + "\n")
    (tmp_path / "one.csv").write_text("\n".join(postures[:2]) + "\n")
    before = set(tmp_path.iterdir())
    monkeypatch.chdir(tmp_path)
    assert main(["markers", "layout", *arguments]) == 2
    assert message in capsys.readouterr().err
    assert set(tmp_path.iterdir()) == before
