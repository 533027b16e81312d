"""`depthtrack synergies`: the principal components of recorded postures."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from depthtrack.cli.progress import bar
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.hand.synergies import Synergies
    from depthtrack.posture_databases.posture_set import PostureSet


@dataclass(frozen=True)
class Fit:
    """Fit synergies to recorded postures, from one file or several.

    Reads the synergy papers' .mat (26 columns), .csv of finger angles or joint positions, recordings and run folders,
    and .npz of joint positions. Joint positions are fitted by inverse kinematics, each hand with its own sizes.
    """

    postures: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="POSTURES ...")]
    """Files or folders of postures."""
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"], metavar="FILE.json")]
    """File to write."""
    tracks: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME ...")] = ()
    """Only the tracks of these names, of files that name theirs."""
    components: Annotated[int | None, tyro.conf.arg(metavar="COUNT")] = None
    """Keep only the first so many of the 20 components."""
    within_limits: bool = False
    """Move angles outside the joint limits to the nearest within, before fitting."""
    source: str = ""
    """Where the postures are from, and under which licence; the files' names unless told."""

    def run(self) -> None:
        import numpy as np

        from depthtrack.hand.limits import LOWER, UPPER
        from depthtrack.hand.synergies import Synergies, save_synergies

        if not self.postures:
            raise InputError("say which postures to fit: depthtrack synergies fit POSTURES... -o FILE.json")
        sets = [self._read(path) for path in bar(self.postures, "file")]
        angles = np.concatenate([one.angles for one in sets])
        outside = float(np.mean((angles < LOWER) | (angles > UPPER)))
        if self.within_limits:
            angles = np.clip(angles, LOWER, UPPER)
        synergies = Synergies.fit(angles, self.source or ", ".join(path.name for path in self.postures))
        kept = synergies if self.components is None else synergies.truncated(self.components)
        save_synergies(kept, self.out)
        for path, one in zip(self.postures, sets, strict=True):
            misfit = "" if one.misfit is None else f", the hand fitted to the joints within {1000 * one.misfit:.1f} mm"
            print(f"{path}: {len(one.angles)} postures{misfit}")
        what = "moved there" if self.within_limits else "kept as they are; --within-limits moves them there"
        print(f"outside the joint limits: {outside:.1%} of the angles, {what}\n")
        print(_text(kept))
        print(f"\nwrote {self.out}: look at it with  depthtrack synergies info {self.out} --picture FILE.png")

    def _read(self, path: Path) -> "PostureSet":
        from depthtrack.posture_databases.registry import read_postures

        postures = read_postures(path)
        try:
            return postures.only(self.tracks) if self.tracks else postures
        except InputError as error:
            raise InputError(f"{path}: {error}") from error


@dataclass(frozen=True)
class Info:
    """Tell what synergies do: variance and limits of each component, and a picture of the first ones."""

    file: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="FILE.json")] = "leap"
    """File written by `fit`, or the name of a set that comes with depthtrack: leap, leap-grasps."""
    picture: Annotated[Path | None, tyro.conf.arg(metavar="FILE.png")] = None
    """Write a picture: the hand from -2 to +2 standard deviations along each of the first components."""
    components: Annotated[int, tyro.conf.arg(metavar="COUNT")] = 4
    """How many components the picture shows."""
    hand: Annotated[Path | None, tyro.conf.arg(metavar="HAND.JSON")] = None
    """Sizes of the hand in the picture; the average adult's unless given."""
    json: bool = False
    """Print JSON, in radians, instead of a table."""

    def run(self) -> None:
        from depthtrack.hand.synergies import load_synergies

        synergies = load_synergies(self.file)
        print(_json(synergies) if self.json else _text(synergies))
        if self.picture is not None:
            self._draw(synergies, self.picture)

    def _draw(self, synergies: "Synergies", path: Path) -> None:
        from depthtrack.hand.hand_file import load_hand
        from depthtrack.hand.shape import HandShape
        from depthtrack.hand.skin.mesh import Skin
        from depthtrack.viewing.contact_sheet import save_picture
        from depthtrack.viewing.synergy_sheet import synergy_sheet

        if not 1 <= self.components <= len(synergies):
            raise InputError(f"--components must be 1 to {len(synergies)}, found {self.components}")
        shape = HandShape() if self.hand is None else load_hand(self.hand)
        save_picture(synergy_sheet(synergies, Skin.of(shape), self.components), path)
        if not self.json:
            print(f"\nwrote the picture {path}")


@dataclass(frozen=True)
class Command:
    """Hand synergies: fit them to recorded postures, or tell what a set of them does."""

    action: tyro.conf.OmitSubcommandPrefixes[
        Annotated[Fit, tyro.conf.subcommand("fit")] | Annotated[Info, tyro.conf.subcommand("info")]
    ]

    def run(self) -> None:
        self.action.run()


_PAPER = {3: "80 % of varied motions, 90 % of grasps", 6: "90 % of varied motions"}
"""What the first components cover in Schroeder et al. 2014, Sec. VI-A."""


def _text(synergies: "Synergies") -> str:
    from math import degrees, sqrt

    lines = [
        f"source   {synergies.source}",
        f"spread   {degrees(sqrt(synergies.total_variance / 20)):.1f} degrees, root mean square of the 20 angles",
        "",
        "component  share of variance  so far  deviation  least  most   (degrees along the component)",
    ]
    for k in range(len(synergies)):
        so_far = synergies.variance_share(k + 1)
        lines.append(
            f"{k + 1:9d} {so_far - synergies.variance_share(k):18.1%} {so_far:7.1%}"
            f" {degrees(sqrt(synergies.variances[k])):10.1f}"
            f" {degrees(synergies.lower[k]):6.1f} {degrees(synergies.upper[k]):5.1f}"
        )
    lines.append("")
    for count, paper in _PAPER.items():
        if count <= len(synergies):
            share = synergies.variance_share(count)
            lines.append(f"the first {count} cover {share:.1%} (Schroeder et al. 2014: {paper})")
    return "\n".join(lines)


def _json(synergies: "Synergies") -> str:
    from json import dumps

    fields = {
        "source": synergies.source,
        "total_variance": synergies.total_variance,
        "mean": synergies.mean.tolist(),
        "components": [
            {
                "variance": float(synergies.variances[k]),
                "share": synergies.variance_share(k + 1) - synergies.variance_share(k),
                "so_far": synergies.variance_share(k + 1),
                "lower": float(synergies.lower[k]),
                "upper": float(synergies.upper[k]),
                "direction": synergies.components[:, k].tolist(),
            }
            for k in range(len(synergies))
        ],
    }
    return dumps(fields, indent=2)
