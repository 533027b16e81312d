"""Synergies: properties of principal components, their file, the command and bundled sets."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.hand.limits import LOWER, UPPER
from depthtrack.hand.pose import ANGLE_NAMES, FINGERS
from depthtrack.hand.synergies import Synergies, load_synergies, save_synergies, synergy_names

SEEDS = st.integers(0, 2**32 - 1)


def postures(seed: int, count: int = 200, kinds: int = 20) -> np.ndarray:
    """Return random mixtures (count, 20), radians, of `kinds` patterns of decreasing size."""
    rng = np.random.default_rng(seed)
    mixtures = rng.normal(size=(count, kinds)) * 0.6 ** np.arange(kinds)
    return np.asarray(rng.normal(size=20) * 0.2 + mixtures @ rng.normal(size=(kinds, 20)) * 0.2)


@given(seed=SEEDS, count=st.integers(2, 50), kept=st.integers(1, 20))
def test_components_are_orthonormal_and_all_of_them_reproduce_every_posture(seed: int, count: int, kept: int) -> None:
    X = postures(seed, count)
    synergies = Synergies.fit(X)
    np.testing.assert_allclose(synergies.components.T @ synergies.components, np.eye(20), atol=1e-12)
    np.testing.assert_allclose(synergies.angles(synergies.project(X)), X, atol=1e-12)
    few = synergies.truncated(kept)
    once = few.angles(few.project(X))
    np.testing.assert_allclose(few.angles(few.project(once)), once, atol=1e-12)
    np.testing.assert_allclose(few.project(X), synergies.project(X)[:, :kept], atol=1e-12)


@given(seed=SEEDS)
def test_variances_are_those_of_the_coefficients_and_add_up(seed: int) -> None:
    X = postures(seed)
    synergies = Synergies.fit(X)
    coefficients = synergies.project(X)
    np.testing.assert_allclose(np.cov(coefficients.T, ddof=0), np.diag(synergies.variances), atol=1e-12)
    assert synergies.total_variance == pytest.approx(X.var(axis=0).sum())
    assert np.all(np.diff(synergies.variances) <= 0)
    np.testing.assert_allclose(synergies.lower, coefficients.min(axis=0), atol=1e-12)
    np.testing.assert_allclose(synergies.upper, coefficients.max(axis=0), atol=1e-12)


@given(seed=SEEDS)
def test_no_other_directions_lose_less(seed: int) -> None:
    """The first k components have the least error of all k-dimensional planes (Eckart, Young)."""
    X, rng = postures(seed), np.random.default_rng(seed)
    synergies = Synergies.fit(X).truncated(3)
    least = np.sum((synergies.angles(synergies.project(X)) - X) ** 2)
    assert least == pytest.approx((synergies.total_variance - synergies.variances.sum()) * len(X))
    other = np.linalg.qr(synergies.components + rng.normal(scale=0.1, size=(20, 3)))[0]
    centred = X - X.mean(axis=0)
    assert np.sum((centred @ other @ other.T - centred) ** 2) >= least


def test_as_many_components_as_patterns_cover_everything() -> None:
    synergies = Synergies.fit(postures(1, kinds=4))
    assert synergies.components_for(1.0) == 4
    assert synergies.variance_share(4) == pytest.approx(1)
    shares = [synergies.variance_share(k) for k in range(21)]
    assert shares[0] == 0
    assert np.all(np.diff(shares) >= 0)
    for share in (0.5, 0.8, 0.9, 0.99):
        count = synergies.components_for(share)
        assert synergies.variance_share(count) >= share > synergies.variance_share(count - 1)
    with pytest.raises(InputError, match="cover"):
        synergies.truncated(1).components_for(0.9999)
    with pytest.raises(InputError, match="1 to 20 components"):
        synergies.truncated(21)


def test_the_same_postures_in_any_order_give_the_same_directions() -> None:
    X = postures(2)
    shuffled = np.random.default_rng(2).permutation(X)
    np.testing.assert_allclose(Synergies.fit(shuffled).components, Synergies.fit(X).components, atol=1e-8)


def test_batches_and_single_postures_agree() -> None:
    synergies = Synergies.fit(postures(3)).truncated(5)
    X = postures(4, 6).reshape(2, 3, 20)
    assert synergies.project(X).shape == (2, 3, 5)
    np.testing.assert_allclose(
        synergies.angles(synergies.project(X))[1, 2], synergies.angles(synergies.project(X[1, 2]))
    )


def test_arrays_that_are_not_postures_are_rejected() -> None:
    for bad, reason in (
        (np.zeros((5, 19)), "20 finite angles"),
        (np.full((5, 20), np.nan), "20 finite angles"),
        (np.ones((1, 20)), "differ"),
        (np.ones((9, 20)), "differ"),
    ):
        with pytest.raises(InputError, match=reason):
            Synergies.fit(bad)


@given(seed=SEEDS, kept=st.integers(1, 20), spread=st.sampled_from([1e-4, 1.0]))
def test_the_file_round_trip_keeps_the_synergies(
    tmp_path_factory: pytest.TempPathFactory, seed: int, kept: int, spread: float
) -> None:
    path = tmp_path_factory.mktemp("synergies") / "set.json"
    synergies = Synergies.fit(postures(seed) * spread, 'a "quoted" source\n').truncated(kept)
    save_synergies(synergies, path)
    again = Synergies.from_json(path)
    assert again.to_json() == synergies.to_json()
    assert again.source == synergies.source
    for name in ("mean", "components", "variances", "lower", "upper"):
        np.testing.assert_allclose(getattr(again, name), getattr(synergies, name), rtol=1e-6, atol=1e-8)
    assert again.variance_share(kept) == pytest.approx(synergies.variance_share(kept), abs=1e-6)
    assert [file.name for file in path.parent.iterdir()] == ["set.json"]


def test_an_inconsistent_file_is_rejected(tmp_path: Path) -> None:
    good = json.loads(Synergies.fit(postures(5)).truncated(3).to_json())
    path = tmp_path / "set.json"

    def refuses(change: dict[str, object], reason: str, component: dict[str, object] | None = None) -> None:
        fields = {**good, **change}
        if component is not None:
            fields["components"] = [{**good["components"][0], **component}, *good["components"][1:]]
        path.write_text(json.dumps(fields))
        with pytest.raises(InputError, match=reason):
            load_synergies(path)

    refuses({"components": []}, "1 to 20 components")
    refuses({"components": good["components"][:1] * 2}, "orthonormal")
    refuses({}, "orthonormal", component={"thumb": [5, 0, 0, 0]})
    refuses({}, "four angles", component={finger: [0, 0, 1] for finger in FINGERS})
    refuses({}, "at most the upper ones", component={"lower_deg": 2, "upper_deg": 1})
    refuses({}, "descending", component={"standard_deviation_deg": 0.001})
    refuses({"total_standard_deviation_deg": 0.1}, "total variance")
    refuses({"total_standard_deviation_deg": float("nan")}, "JSON has no NaN")
    refuses({}, "finite|cannot read", component={"upper_deg": 10**400})
    refuses({"mean_deg": "flat"}, "cannot read")
    refuses({"mean_deg": {}}, "'thumb' is missing")
    for text in ("{", "[" * 100_000, "\x00", '"a"', "[]"):
        path.write_text(text)
        with pytest.raises(InputError, match=r"set\.json"):
            load_synergies(path)
    path.write_bytes(b" " * (1 << 20) + b"{}")
    with pytest.raises(InputError, match="at most 1,048,576 bytes"):
        load_synergies(path)
    with pytest.raises(InputError, match="leap"):
        load_synergies("no-such-set")


@pytest.mark.parametrize("name", synergy_names())
def test_bundled_sets_are_valid_and_name_their_source(name: str) -> None:
    synergies = load_synergies(name)
    assert len(synergies) == 20
    assert "Apache-2.0" in synergies.source
    assert np.all((synergies.mean > LOWER) & (synergies.mean < UPPER))
    assert np.all(synergies.lower < 0)
    assert np.all(synergies.upper > 0)
    # Fingers bend together: the strongest synergy turns all twelve flexions of the long fingers one way.
    flexions = [k for k, angle in enumerate(ANGLE_NAMES) if "flexion" in angle and not angle.startswith("thumb")]
    assert np.all(synergies.components[flexions, 0] > 0)


def test_bundled_sets_cover_the_variance_of_their_readme() -> None:
    """The shares are the paper's: 80 % with 3 and 90 % with 6 components; 90 % with 3 on grasps."""
    varied, grasps = load_synergies(), load_synergies("leap-grasps")
    assert [varied.variance_share(3), varied.variance_share(6)] == pytest.approx([0.868, 0.943], abs=5e-4)
    assert [grasps.variance_share(3), grasps.variance_share(6)] == pytest.approx([0.929, 0.990], abs=5e-4)
    assert [varied.components_for(0.99), grasps.components_for(0.99)] == [12, 6]


def write_table(path: Path, angles: np.ndarray) -> None:
    rows = [",".join(ANGLE_NAMES), *(",".join(f"{value:.9f}" for value in row) for row in angles)]
    path.write_text("\n".join(rows))


def test_the_command_fits_and_prints_synergies(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    X = postures(6)
    for name, half in (("a", X[:100]), ("b", X[100:])):
        write_table(tmp_path / f"{name}.csv", half)
    out = tmp_path / "set.json"
    arguments = ["synergies", "fit", str(tmp_path / "a.csv"), str(tmp_path / "b.csv"), "-o", str(out)]
    assert main([*arguments, "--source", "a test", "--components", "7"]) == 0
    told = capsys.readouterr().out
    expected = Synergies.fit(X)
    assert f"the first 3 cover {expected.variance_share(3):.1%}" in told
    assert "100 postures" in told
    assert main(["synergies", "info", str(out), "--json"]) == 0
    fields = json.loads(capsys.readouterr().out)
    assert fields["source"] == "a test"
    assert len(fields["components"]) == 7
    np.testing.assert_allclose(fields["components"][0]["direction"], expected.components[:, 0], atol=1e-8)
    np.testing.assert_allclose(fields["mean"], expected.mean, atol=1e-8)


def test_angles_can_be_clipped_to_the_limits(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_table(tmp_path / "wild.csv", 4 * postures(7) / np.abs(postures(7)).max() * 0.75)
    out = tmp_path / "set.json"
    assert main(["synergies", "fit", str(tmp_path / "wild.csv"), "-o", str(out), "--within-limits"]) == 0
    assert "clipped" in capsys.readouterr().out
    mean = Synergies.from_json(out).mean
    assert np.all((mean >= LOWER) & (mean <= UPPER))


def test_the_picture_shows_a_hand_that_closes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import cv2

    path = tmp_path / "set.png"
    assert main(["synergies", "info", "leap", "--picture", str(path), "--components", "1"]) == 0
    assert "wrote the picture" in capsys.readouterr().out
    page = cv2.imread(str(path))
    assert page is not None
    # The hand, brighter than the background, becomes shorter from one deviation to the next.
    bright = (page.max(axis=2) > 100)[120:-30]
    columns = np.array_split(bright[:, 200:], 5, axis=1)
    heights = [np.ptp(np.flatnonzero(column.sum(axis=1) > 3)) for column in columns]
    assert heights[0] >= heights[2] > heights[3] > heights[4]


@pytest.mark.parametrize(
    "arguments",
    [
        ["fit", "-o", "set.json"],
        ["fit", "nowhere.csv", "-o", "set.json"],
        ["info", "nowhere.json"],
        ["info", "leap", "--picture", "set.txt"],
        ["info", "leap", "--picture", "set.png", "--components", "21"],
    ],
)
def test_errors_are_one_sentence(
    arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["synergies", *arguments]) == 2
    message = capsys.readouterr().err
    assert message.startswith("depthtrack synergies: ")
    assert message.count("\n") == 1
    assert not list(tmp_path.iterdir())
