"""Write the 2D keypoints that MediaPipe finds, for `depthtrack track --keypoints`.

Usage: 12_mediapipe_keypoints.py RECORDING hand_landmarker.task KEYPOINTS.csv

It runs in an environment of its own (pip install mediapipe) and imports nothing of depthtrack. The model file is
"HandLandmarker (full)" of MediaPipe's documentation. RECORDING is a TUM RGB-D folder. Its colour images must be
registered to the depth, since the file holds pixels of the depth image.
"""

import csv
import sys
from pathlib import Path
from typing import Any

LANDMARKS = ["wrist", *(f"thumb_{joint}" for joint in ("cmc", "mcp", "ip", "tip"))]
for finger in ("index_finger", "middle_finger", "ring_finger", "pinky"):
    LANDMARKS += [f"{finger}_{joint}" for joint in ("mcp", "pip", "dip", "tip")]
HEADER = ["timestamp", "side", *(f"{name}_{value}" for name in LANDMARKS for value in ("x", "y", "confidence"))]


def row(result: Any, width: int, height: int) -> list[str] | None:
    """Return the cells of the hand with the highest score; None without a hand."""
    if not result.hand_landmarks:
        return None
    best = max(range(len(result.hand_landmarks)), key=lambda hand: float(result.handedness[hand][0].score))
    score = float(result.handedness[best][0].score)
    # The side stays blank: versions of MediaPipe differ in whether they take the image for a mirrored one.
    cells = [""]
    for point in result.hand_landmarks[best]:
        # Its coordinates are shares of the image; the centre of the first pixel is 0, 0 here.
        cells += [f"{point.x * width - 0.5:.2f}", f"{point.y * height - 0.5:.2f}", f"{score:.3f}"]
    return cells


def main(recording: str, model: str, out: str) -> int:
    """Write the file; return the number of images with a hand."""
    try:
        import mediapipe as mp
    except ImportError:
        sys.exit("this script needs MediaPipe: run  pip install mediapipe  in an environment of its own")
    vision = mp.tasks.vision
    base = mp.tasks.BaseOptions(model_asset_path=model)
    options = vision.HandLandmarkerOptions(base_options=base, running_mode=vision.RunningMode.VIDEO, num_hands=2)
    lines = [line.split(maxsplit=1) for line in (Path(recording) / "rgb.txt").read_text().splitlines()]
    written = 0
    with vision.HandLandmarker.create_from_options(options) as detector, open(out, "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(HEADER)
        for time, name in (line for line in lines if line and not line[0].startswith("#")):
            image = mp.Image.create_from_file(str(Path(recording) / name.strip()))
            cells = row(detector.detect_for_video(image, round(1000 * float(time))), image.width, image.height)
            table.writerow([time, *(cells or [""] * (len(HEADER) - 1))])
            written += cells is not None
    return written


if __name__ == "__main__":
    print(f"a hand in {main(*sys.argv[1:])} images")
