"""Many independent measurements, on all cores or on a cluster, written down as they come and never done twice."""
