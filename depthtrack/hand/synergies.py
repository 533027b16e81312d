"""Hand synergies: the principal components of recorded postures (Schroeder et al. 2014, Sec. V), in a JSON file."""

from dataclasses import dataclass
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
"""How far a file's components may be from orthonormal."""
_SPREAD = 1e-12
"""Postures with a smaller total variance, in rad^2, are one posture."""


@dataclass(frozen=True, eq=False)
class Synergies:
    """A mean posture and K directions, most telling first, in which postures differ from it.

    `mean` (20,) radians; `components` (20, K), orthonormal columns; `variances` (K,) rad^2 along them, descending;
    `lower` and `upper` (K,) radians, the smallest and largest coefficient that the postures have; `total_variance`
    rad^2 of the postures, of which these components may cover a part; `source` says which postures. Arrays are
    read-only. Raises InputError for values that do not fit together.
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
        """All 20 components of postures (N, 20), radians, of which two must differ. Raises InputError."""
        X = np.asarray(postures, dtype=np.float64)
        if X.ndim != 2 or X.shape[1] != ANGLE_COUNT or not np.isfinite(X).all():
            raise InputError(f"synergies need postures of {ANGLE_COUNT} finite angles each, found shape {X.shape}")
        if len(X) < 2 or np.var(X, axis=0).sum() < _SPREAD:
            raise InputError(f"synergies need postures that differ, found {len(X)} that are all alike")
        mean = X.mean(axis=0)
        # The triangular factor has the same singular values and right vectors, and at most 20 rows.
        _, singular, Vt = np.linalg.svd(np.linalg.qr(X - mean, mode="r"))
        # A singular vector has no sign of its own: its largest entry is made positive, so that fitting again agrees.
        C = Vt.T * np.sign(Vt[np.arange(ANGLE_COUNT), np.abs(Vt).argmax(axis=1)])
        variances = np.zeros(ANGLE_COUNT)
        variances[: len(singular)] = singular**2 / len(X)
        coefficients = (X - mean) @ C
        lower, upper = coefficients.min(axis=0), coefficients.max(axis=0)
        return cls(mean, C, variances, lower, upper, float(variances.sum()), source)

    def __len__(self) -> int:
        """K, the number of components."""
        return len(self.variances)

    def project(self, angles: ArrayLike) -> Array:
        """Coefficients (..., K) of postures (..., 20): Eq. (7), first half."""
        return (np.asarray(angles, dtype=np.float64) - self.mean) @ self.components

    def angles(self, coefficients: ArrayLike) -> Array:
        """Postures (..., 20) of coefficients (..., K): Eq. (7), second half. Joint limits are not looked at."""
        return np.asarray(coefficients, dtype=np.float64) @ self.components.T + self.mean

    def truncated(self, count: int) -> Self:
        """The first `count` components alone. Raises InputError when there are not so many."""
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
        """Share of the postures' variance that the first `count` components cover."""
        return min(float(self.variances[:count].sum()) / self.total_variance, 1.0)

    def components_for(self, share: float) -> int:
        """How many components cover at least this share of the variance. Raises InputError when all do not."""
        for count in range(1, len(self) + 1):
            # A share of 1 is reached up to rounding.
            if self.variance_share(count) >= share - 1e-9:
                return count
        reached = self.variance_share(len(self))
        raise InputError(f"these {len(self)} components cover {reached:.1%} of the variance, found {share:.1%} asked")

    def to_json(self) -> str:
        """Return the text of the synergies file, angles in degrees."""
        fields = {
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
        return compact_json(fields)

    @classmethod
    def from_json(cls, path: Path) -> Self:
        """Return the synergies of a file that holds the text of `to_json`.

        Raises: InputError if the file is missing or malformed, or its entries do not fit together.
        """
        return read_json(path, "the synergies", cls._from_fields, made_by="depthtrack synergies fit")

    @classmethod
    def _from_fields(cls, fields: dict[str, Any]) -> Self:
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

    Raises: InputError if the file cannot be written.
    """
    write_atomic(path, synergies.to_json())


def load_synergies(name: str | Path = "leap") -> Synergies:
    """Synergies by the name of a set that comes with depthtrack, or by the path of a file. Raises InputError."""
    names = synergy_names()
    if str(name) in names:
        return Synergies.from_json(_folder() / f"{name}.json")
    if Path(name).suffix == ".json":
        return Synergies.from_json(Path(name))
    raise InputError(f"no synergies '{name}': choose one of {', '.join(names)}, or give the path of a .json file")


def synergy_names() -> list[str]:
    """Names of the sets that come with depthtrack."""
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
        raise InputError("synergies must be finite numbers of ordinary size")
    if np.abs(s.components.T @ s.components - np.eye(count)).max() > _ORTHONORMAL:
        raise InputError("components must be orthogonal to one another and of length 1: fit them again")
    if np.any(s.variances < 0) or np.any(np.diff(s.variances) > _ORTHONORMAL) or np.any(s.lower > s.upper):
        raise InputError("variances must descend and stay above 0, and no lower limit lie above the upper one")
    if not s.total_variance > 0 or s.variances.sum() > s.total_variance * (1 + _ORTHONORMAL):
        raise InputError("the variances of the components must not exceed the total variance")


def _angles(table: dict[str, Any]) -> Array:
    """(20,) numbers of a table with four a finger."""
    angles = np.array([[float(value) for value in table[finger]] for finger in FINGERS])
    if angles.shape != (5, 4):
        raise InputError(f"each finger needs four angles, found {angles.shape[-1]}")
    return angles.ravel()


def _by_finger(values: ArrayLike) -> dict[str, list[float]]:
    return dict(zip(FINGERS, np.reshape(values, (5, 4)).tolist(), strict=True))


def _degrees(radians: Any) -> Any:
    """Eight significant digits: few enough to read, and writing what was read changes nothing."""
    return np.vectorize(lambda degrees: float(f"{degrees:.8g}"))(np.degrees(radians)).tolist()
