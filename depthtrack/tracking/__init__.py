"""From observations to poses: the tracker protocol, the loop over a recording, and the trackers."""
