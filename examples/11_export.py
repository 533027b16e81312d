"""Write the keypoints of a run for other programs, and list the formats.

Usage: 11_export.py RUN OUT.csv|.npz
"""

import sys

import depthtrack as dt


def main(folder: str, out: str) -> dt.JointTrack:
    """Print the formats and what was written; return the written poses and keypoints."""
    for name, exporter in dt.EXPORTERS.items():
        print(f"{name:6} {', '.join(exporter.suffixes):6} {exporter.description}")
    track = dt.export_run(folder, out)
    trusted = sum(status.is_trusted for status in track.status)
    print(f"{out}: {len(track.index)} frames, {trusted} with a trusted pose")
    return track


if __name__ == "__main__":
    main(*sys.argv[1:])
