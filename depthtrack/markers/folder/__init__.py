"""The folder that the marker commands write: labels, poses, and a run of each hand.

| file                     | content                                                                    |
|--------------------------|----------------------------------------------------------------------------|
| markers.json             | source with its digest, models, configuration, versions                    |
| labelled.csv             | labelled trajectories, mm, then those without a label; or .c3d, .trc       |
| confidence.csv           | probability of each label                                                  |
| residual.csv             | distance of each measured marker from that of the pose, mm                 |
| filled.csv               | how each filled sample was filled, and its expected error, mm; optional    |
| models/NAME.json         | each model                                                                 |
| NAME/                    | run folder of a hand: run.json, poses.csv; recording/ as its recording     |
| NAME.csv                 | pose of a rigid body in each frame: metres, quaternion                     |

Poses are in the capture frame.
"""
