"""`depthtrack synergies`: fit and show principal components of hand postures."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from depthtrack.cli.argument_checks import OUTPUT_FILE, PICTURE
from depthtrack.cli.progress import bar
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.errors import InputError

if TYPE_CHECKING:
    from depthtrack.hand.synergies import Synergies
    from depthtrack.posture_databases.posture_set import PostureSet


@dataclass(frozen=True)
class Fit:
    """Fit synergies to the recorded postures of one or more files.

    Reads .mat files with 26 columns, .csv files of finger angles or joint positions, .npz files of joint positions,
    recordings and run folders. Joint positions are converted by inverse kinematics, with sizes fitted to each hand.
    """

    postures: Annotated[tuple[Path, ...], tyro.conf.Positional, stated_default(metavar="POSTURES ...")]
    """Files or folders of postures."""
    out: Annotated[Path, OUTPUT_FILE, tyro.conf.arg(aliases=["-o"], metavar="FILE.json")]
    """File to write."""
    tracks: Annotated[tuple[str, ...], stated_default(metavar="NAME ...")] = ()
    """Names of the tracks to use, for files with named tracks (default: all)."""
    components: Annotated[int | None, number(1, 20, metavar="COUNT")] = None
    """Number of first components to keep (default: all 20)."""
    within_limits: bool = False
    """Clip angles to the joint limits before the fit."""
    source: Annotated[str, stated_default()] = ""
    """Origin and licence of the postures (default: the names of the files)."""

    def run(self) -> None:
        import numpy as np

        from depthtrack.hand.limits import LOWER, UPPER
        from depthtrack.hand.synergies import Synergies, save_synergies

        if not self.postures:
            raise InputError("expected files of postures: use  depthtrack synergies fit POSTURES... -o FILE.json")
        sets = [self._read(path) for path in bar(self.postures, "file")]
        angles = np.concatenate([postures.angles for postures in sets])
        outside = float(np.mean((angles < LOWER) | (angles > UPPER)))
        if self.within_limits:
            angles = np.clip(angles, LOWER, UPPER)
        synergies = Synergies.fit(angles, self.source or ", ".join(path.name for path in self.postures))
        kept = synergies if self.components is None else synergies.truncated(self.components)
        save_synergies(kept, self.out)
        for path, postures in zip(self.postures, sets, strict=True):
            misfit = "" if postures.misfit is None else f", fitted to the joints within {1000 * postures.misfit:.1f} mm"
            print(f"{path}: {len(postures.angles)} postures{misfit}")
        action = "clipped" if self.within_limits else "kept; --within-limits clips them"
        print(f"outside the joint limits: {outside:.1%} of the angles, {action}\n")
        print(_text(kept))
        print(f"\nwrote {self.out}: draw it with  depthtrack synergies info {self.out} --picture FILE.png")

    def _read(self, path: Path) -> "PostureSet":
        from depthtrack.posture_databases.registry import read_postures

        postures = read_postures(path)
        try:
            return postures.only(self.tracks) if self.tracks else postures
        except InputError as error:
            raise InputError(f"{path}: {error}") from error


@dataclass(frozen=True)
class Info:
    """Print variance and limits of each synergy, and draw the first ones."""

    file: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="FILE.json")] = "leap"
    """File from `fit`, or the name of an included set: leap, leap-grasps."""
    picture: Annotated[Path | None, PICTURE, stated_default(metavar="FILE.png")] = None
    """Picture to write: the hand from -2 to +2 standard deviations along each of the first components."""
    components: Annotated[int, number(1, 20, metavar="COUNT")] = 4
    """Number of components in the picture."""
    hand: Annotated[Path | None, stated_default(metavar="HAND.json")] = None
    """Hand of the picture (default: the average adult's)."""
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
    """Fit hand synergies to recorded postures, or print a set of them."""

    action: tyro.conf.OmitSubcommandPrefixes[
        Annotated[Fit, tyro.conf.subcommand("fit")] | Annotated[Info, tyro.conf.subcommand("info")]
    ]

    def run(self) -> None:
        self.action.run()


_PAPER = {3: "80 % of varied motions, 90 % of grasps", 6: "90 % of varied motions"}
"""Variance covered by the first components in Schroeder et al. 2014, Sec. VI-A."""


def _text(synergies: "Synergies") -> str:
    from math import degrees, sqrt

    lines = [
        f"source   {synergies.source}",
        f"spread   {degrees(sqrt(synergies.total_variance / 20)):.1f} degrees, root mean square of the 20 angles",
        "",
        "component  share of variance     sum  deviation    min   max   (degrees along the component)",
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
    from depthtrack.strict_data import json_text

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
    return json_text(fields, indent=2)
