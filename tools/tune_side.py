"""Choose how much uncommon sizes count in the choice of a hand's side.

Usage: tune_side.py FOLDER --rig RIG.glb [...] [--first-seed N] [--seeds N] [--frames N] [--motion NAME ...]

The recordings are those of the tuning seeds of the cross-model benchmark. Hands of both sides are calibrated on those
whose side the average hands leave open. Printed for each weight of the sizes are the right sides, the sides called
sure, and the right ones of those. The folder holds the figures of each recording, from which an
interrupted choice continues.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from depthtrack.benchmarks.crossmodel.recordings import MOTIONS, made_recording, recording_cells
from depthtrack.benchmarks.papers.experiment import ExperimentOptions
from depthtrack.calibration.calibrate import calibration_of
from depthtrack.calibration.first_scale import FirstHand, first_hand
from depthtrack.calibration.fitted_hand import fit_sizes
from depthtrack.calibration.joint_optimisation import size_covariance
from depthtrack.calibration.options import CalibrationOptions
from depthtrack.calibration.recorded_views import CalibrationSource
from depthtrack.calibration.sides import size_costs
from depthtrack.errors import InputError
from depthtrack.evaluation.sweep.rows import Cell, Journal, Row
from depthtrack.evaluation.sweep.run import run_sweep
from depthtrack.evaluation.sweep.workers import chosen_workers
from depthtrack.hand.shape import Side, other_side
from depthtrack.hand.size_parameters import COUNT, size_deviation
from depthtrack.tracking.side_choice import SideOptions, choose_side, mean_energies

WEIGHTS = (0.0, 0.3, 0.5, 0.8, 1.0, 1.2, 1.5, 2.0, 3.0)
OPTIONS = CalibrationOptions()


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--rig", nargs="+", required=True)
    arguments.add_argument("--first-seed", type=int, default=0)
    arguments.add_argument("--seeds", type=int, default=6)
    arguments.add_argument("--frames", type=int, default=90)
    arguments.add_argument("--motion", nargs="+", choices=MOTIONS, default=list(MOTIONS))
    chosen = arguments.parse_args()
    options = ExperimentOptions(
        repetitions=chosen.seeds,
        first_seed=chosen.first_seed,
        frames=chosen.frames,
        rigs=tuple(chosen.rig),
        split="tuning",
    )
    cells = [cell for cell in recording_cells(options) if cell["motion"] in chosen.motion]
    with Journal(chosen.folder / "sides.jsonl", list(cells[0])) as journal:
        rows = run_sweep(measure_sides, cells, journal, chosen_workers(None))
    for weight in WEIGHTS:
        margins = np.array([margin(row, replace(OPTIONS, size_weight=weight)) for row in rows])
        needed = np.array([OPTIONS.sure_margin if row["open"] else SideOptions().sure_margin for row in rows])
        sure = (np.abs(margins) >= np.log1p(needed)) & (margins * np.array([row["average"] for row in rows]) >= 0)
        print(
            f"weight {weight:g}: {(margins > 0).sum()} of {len(rows)} sides right, "
            f"{sure.sum()} sure, {(margins[sure] > 0).sum()} of them right; least margin of a right one that is sure "
            f"{np.expm1(margins[sure & (margins > 0)].min()):.2f}, largest of a wrong one "
            f"{np.expm1(-margins.min()) if (margins < 0).any() else 0:.2f}"
        )


def margin(row: Row, options: CalibrationOptions) -> float:
    """Return the logarithm of the cost of the wrong side over that of the right one."""
    if not row["open"]:
        return float(row["margin"])
    sides: tuple[Side, Side] = ("right", "left")
    deviations = {side: float(row[f"{side}_deviation"]) for side in sides}
    factors = size_costs(deviations, options)
    side: Side = row["side"]
    return float(row["margin"] + np.log(factors[other_side(side)] / factors[side]))


def measure_sides(cell: Cell) -> Row:
    """Return how much more the wrong side of a recording costs, without the factor of the sizes.

    `open` is whether the average hands leave the side open. `margin` is the logarithm of the quotient of the costs, and
    `average` that of the average hands.
    """
    with made_recording(**cell) as sequence:
        source = CalibrationSource(sequence, None, 0, 1, None, OPTIONS)
        scales: dict[Side, float] = {each: first_hand(source, each).scale for each in ("right", "left")}
        choice = choose_side(sequence, scales=scales)
        side: Side = cell["side"]
        known = float(np.log1p(choice.margin)) * (1 if choice.side == side else -1)
        row: Row = {"open": not choice.sure, "margin": known, "average": known}
        row |= {"right_deviation": 0.0, "left_deviation": 0.0}
        if choice.sure:
            return row
        sized = {}
        for each in (side, other_side(side)):
            try:
                sized[each] = fit_sizes(
                    source,
                    each,
                    FirstHand(scales[each], choice.starts[each]),
                    choice.views.get(each, ()),
                    lambda stage, share: None,
                )
            except InputError:
                # The other side alone can be calibrated, and is taken.
                return row | {"open": False, "margin": float(np.log1p(10.0)) * (-1 if each == side else 1)}
            row[f"{each}_deviation"] = size_deviation(sized[each].values[:COUNT], size_covariance(OPTIONS.joint))
        means, frames = mean_energies({each: found.energies for each, found in sized.items()})
        quotients = [{each: calibration_of(source, found).after_mm for each, found in sized.items()}]
        quotients += [means] if frames else []
        return row | {"margin": known + sum(float(np.log(each[other_side(side)] / each[side])) for each in quotients)}


if __name__ == "__main__":
    main()
