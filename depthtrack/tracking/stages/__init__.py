"""The stages that trackers are made of."""
