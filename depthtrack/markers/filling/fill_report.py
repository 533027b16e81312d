"""Figures of a filled capture, marker by marker."""

from typing import Any

import numpy as np

from depthtrack.markers.filled_capture import FilledCapture, Filling


def fill_report(filled: FilledCapture) -> list[dict[str, Any]]:
    """Return a row of JSON values for each marker with gaps.

    `samples` are filled ones, `how` their kinds, and `expected_error_mm` the root mean square of theirs.
    """
    rate, rows = filled.labelled.capture.rate, []
    labels = [filled.labelled.labels(k) for k in range(len(filled.how))]
    found = filled.gaps()
    for k, names in enumerate(labels):
        for m, name in enumerate(names):
            gaps = [gap for gap in found if (gap.model, gap.marker) == (k, m)]
            if not gaps:
                continue
            how, error = filled.how[k][:, m], filled.expected_error[k][:, m]
            done = np.isfinite(error)
            rows.append(
                {
                    "marker": name,
                    "gaps": len(gaps),
                    "filled": sum(filled.is_filled(gap) for gap in gaps),
                    "longest_s": max(gap.length for gap in gaps) / rate,
                    "samples": int(done.sum()),
                    "expected_error_mm": float(1000 * np.sqrt(np.mean(error[done] ** 2))) if done.any() else None,
                    "how": [Filling(int(kind)).word for kind in np.unique(how[done])],
                }
            )
    return rows
