"""Hand synergies, the principal components of recorded postures, and their JSON file.

Source: Schroeder et al. 2014, Sec. V.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from depthtrack.errors import InputError
from depthtrack.files import compact_json, read_json, write_atomic
from depthtrack.hand.pose import FINGERS
from depthtrack.resources import resource_folder
from depthtrack.types import Array

ANGLE_COUNT = 20
_ORTHONORMAL = 1e-6
"""Tolerance of the components' orthonormality in a file."""
_SPREAD = 1e-12
"""Total variance, rad^2, below which postures count as equal."""


@dataclass(frozen=True, eq=False)
class Synergies:
    """A mean posture and K principal components, by descending variance.

    mean: (20,) radians.
    components: (20, K) orthonormal columns.
    variances: (K,) along the components, rad^2, descending.
    lower, upper: (K,) smallest and largest coefficient of the postures, radians.
    total_variance: of the postures, rad^2; the K components may cover only a part.
    source: description of the postures.

    Arrays are read-only.

    Raises:
        InputError: if shapes or values are inconsistent.
    """

    mean: Array
    components: Array
    variances: Array
    lower: Array
    upper: Array
    total_variance: float
    source: str

    def __post_init__(self) -> None:
        for name in ("mean", "components", "variances", "lower", "upper"):
            array = np.array(getattr(self, name), dtype=np.float64)
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        _check(self)

    @classmethod
    def fit(cls, postures: ArrayLike, source: str = "") -> Self:
        """Return all 20 components of postures.

        postures: (N, 20) radians.

        Raises:
            InputError: if the shape differs, a number is not finite, or all postures are equal.
        """
        X = np.asarray(postures, dtype=np.float64)
        if X.ndim != 2 or X.shape[1] != ANGLE_COUNT or not np.isfinite(X).all():
            raise InputError(f"synergies need postures of {ANGLE_COUNT} finite angles each, found shape {X.shape}")
        if len(X) < 2:
            raise InputError(f"synergies need two postures or more that differ, found {len(X)}")
        if np.var(X, axis=0).sum() < _SPREAD:
            raise InputError(f"synergies need postures that differ, found {len(X)} equal ones")
        mean = X.mean(axis=0)
        # The triangular factor has the same singular values and right singular vectors, and at most 20 rows.
        _, singular, Vt = np.linalg.svd(np.linalg.qr(X - mean, mode="r"))
        # The sign of a singular vector is arbitrary: a positive largest entry makes the fit reproducible.
        C = Vt.T * np.sign(Vt[np.arange(ANGLE_COUNT), np.abs(Vt).argmax(axis=1)])
        variances = np.zeros(ANGLE_COUNT)
        variances[: len(singular)] = singular**2 / len(X)
        coefficients = (X - mean) @ C
        lower, upper = coefficients.min(axis=0), coefficients.max(axis=0)
        return cls(mean, C, variances, lower, upper, float(variances.sum()), source)

    def __len__(self) -> int:
        """Return K, the number of components."""
        return len(self.variances)

    def project(self, angles: ArrayLike) -> Array:
        """Return the coefficients (..., K) of postures (..., 20), radians: Eq. (7), first half."""
        return (np.asarray(angles, dtype=np.float64) - self.mean) @ self.components

    def angles(self, coefficients: ArrayLike) -> Array:
        """Return the postures (..., 20), radians, of coefficients (..., K): Eq. (7), second half.

        Joint limits are not applied.
        """
        return np.asarray(coefficients, dtype=np.float64) @ self.components.T + self.mean

    def truncated(self, count: int) -> Self:
        """Return the first `count` components.

        Raises:
            InputError: if `count` is not from 1 to K.
        """
        if not 1 <= count <= len(self):
            raise InputError(f"these synergies have 1 to {len(self)} components, found {count}: ask for fewer")
        return type(self)(
            self.mean,
            self.components[:, :count],
            self.variances[:count],
            self.lower[:count],
            self.upper[:count],
            self.total_variance,
            self.source,
        )

    def variance_share(self, count: int) -> float:
        """Return the share of the postures' variance that the first `count` components cover."""
        return min(float(self.variances[:count].sum()) / self.total_variance, 1.0)

    def components_for(self, share: float) -> int:
        """Return the number of components that cover at least a share of the variance.

        Raises:
            InputError: if all components together cover less.
        """
        for count in range(1, len(self) + 1):
            # A share of 1 is reached only up to rounding.
            if self.variance_share(count) >= share - 1e-9:
                return count
        reached = self.variance_share(len(self))
        raise InputError(
            f"these {len(self)} components cover {reached:.1%} of the variance, found a share of {share:.1%}"
        )

    def to_json(self) -> str:
        """Return the text of the synergies file, angles in degrees."""
        return compact_json(self.to_fields())

    def to_fields(self) -> dict[str, Any]:
        """Return the contents of the synergies file, angles in degrees."""
        return {
            "source": self.source,
            "total_standard_deviation_deg": _degrees(np.sqrt(self.total_variance)),
            "mean_deg": _by_finger(_degrees(self.mean)),
            "components": [
                {
                    "standard_deviation_deg": _degrees(np.sqrt(self.variances[k])),
                    "share": round(float(self.variances[k] / self.total_variance), 6),
                    "lower_deg": _degrees(self.lower[k]),
                    "upper_deg": _degrees(self.upper[k]),
                    **_by_finger(np.round(self.components[:, k], 9)),
                }
                for k in range(len(self))
            ],
        }

    @classmethod
    def from_json(cls, path: Path) -> Self:
        """Return the synergies of a file written by `save_synergies`.

        Raises:
            InputError: if the file is missing or malformed, or its entries are inconsistent.
        """
        return read_json(path, "the synergies", cls.from_fields, made_by="depthtrack synergies fit")

    @classmethod
    def from_fields(cls, fields: dict[str, Any]) -> Self:
        """Return the synergies of the parsed contents of their file.

        Raises:
            KeyError, TypeError, ValueError: if an entry is missing or malformed.
            InputError: if the entries are inconsistent.
        """
        components = list(fields["components"])

        def of_each(name: str) -> Array:
            return np.radians(np.array([float(c[name]) for c in components]))

        return cls(
            mean=np.radians(_angles(fields["mean_deg"])),
            components=np.array([_angles(c) for c in components]).reshape(-1, ANGLE_COUNT).T,
            variances=of_each("standard_deviation_deg") ** 2,
            lower=of_each("lower_deg"),
            upper=of_each("upper_deg"),
            total_variance=float(np.radians(float(fields["total_standard_deviation_deg"])) ** 2),
            source=str(fields.get("source", "")),
        )


def save_synergies(synergies: Synergies, path: Path) -> None:
    """Write the file that `Synergies.from_json` reads.

    Raises:
        InputError: if the file cannot be written.
    """
    write_atomic(path, synergies.to_json())


def load_synergies(name: str | Path = "leap") -> Synergies:
    """Return the synergies of a set that comes with depthtrack, or of a .json file.

    Raises:
        InputError: if there is no such set, or the file is missing or malformed.
    """
    names = synergy_names()
    if str(name) in names:
        return _packaged(str(name))
    if Path(name).suffix == ".json":
        return Synergies.from_json(Path(name))
    raise InputError(f"no synergies '{name}': choose one of {', '.join(names)}, or give the path of a .json file")


@cache
def _packaged(name: str) -> Synergies:
    """Return the synergies of a set that comes with depthtrack."""
    return Synergies.from_json(_folder() / f"{name}.json")


def synergy_names() -> list[str]:
    """Return the names of the sets that come with depthtrack."""
    return sorted(path.stem for path in _folder().glob("*.json"))


def _folder() -> Path:
    return resource_folder("hand/synergy_sets")


def _check(s: Synergies) -> None:
    count = len(s.variances) if s.variances.ndim == 1 else 0
    shapes = (s.mean.shape, s.components.shape, s.lower.shape, s.upper.shape)
    if not 1 <= count <= ANGLE_COUNT or shapes != ((ANGLE_COUNT,), (ANGLE_COUNT, count), (count,), (count,)):
        raise InputError(f"synergies must be 1 to {ANGLE_COUNT} components of {ANGLE_COUNT} angles each")
    numbers = np.concatenate([s.mean, s.components.ravel(), s.variances, s.lower, s.upper, [s.total_variance]])
    if not np.isfinite(numbers).all() or np.abs(numbers).max() > 1000:
        raise InputError("synergies must be finite numbers of magnitude at most 1000")
    if np.abs(s.components.T @ s.components - np.eye(count)).max() > _ORTHONORMAL:
        raise InputError("components must be orthonormal: fit them again")
    if np.any(s.variances < 0) or np.any(np.diff(s.variances) > _ORTHONORMAL) or np.any(s.lower > s.upper):
        raise InputError("variances must be descending and not negative, and lower limits at most the upper ones")
    if not s.total_variance > 0 or s.variances.sum() > s.total_variance * (1 + _ORTHONORMAL):
        raise InputError("the variances of the components must not exceed the total variance")


def _angles(table: dict[str, Any]) -> Array:
    """Return the numbers (20,) of a table with four a finger."""
    angles = np.array([[float(value) for value in table[finger]] for finger in FINGERS])
    if angles.shape != (5, 4):
        raise InputError(f"each finger needs four angles, found {angles.shape[-1]}")
    return angles.ravel()


def _by_finger(values: ArrayLike) -> dict[str, list[float]]:
    return dict(zip(FINGERS, np.reshape(values, (5, 4)).tolist(), strict=True))


def _degrees(radians: Any) -> Any:
    """Return degrees of eight significant digits, which a second round trip keeps."""
    return np.vectorize(lambda degrees: float(f"{degrees:.8g}"))(np.degrees(radians)).tolist()
