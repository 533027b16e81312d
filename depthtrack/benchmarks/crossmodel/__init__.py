"""Cross-model benchmark: synthetic hands that differ from the trackers' own."""
