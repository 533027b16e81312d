"""`depthtrack markers`: a group of commands, each one module that is imported on its call."""

from depthtrack.cli import CommandEntry

COMMANDS: dict[str, CommandEntry] = {
    "info": CommandEntry("depthtrack.cli.markers.info", "list frames, markers, gaps and size of a capture"),
    "model": CommandEntry("depthtrack.cli.markers.model", "save a rigid body or a calibrated hand from a capture"),
    "label": CommandEntry("depthtrack.cli.markers.label", "find the markers of hands and rigid bodies in a capture"),
    "solve": CommandEntry("depthtrack.cli.markers.solve", "measure the hands of a capture and find their poses"),
    "fill": CommandEntry("depthtrack.cli.markers.fill", "fill the gaps of labelled markers"),
    "layout": CommandEntry("depthtrack.cli.markers.layout", "find where to stick few markers on a hand"),
    "compare-filling": CommandEntry(
        "depthtrack.cli.markers.compare_filling", "compare filling methods on stretches that are cut out"
    ),
    "compare-layouts": CommandEntry(
        "depthtrack.cli.markers.compare_layouts", "solve a hand from a few of its markers, and measure the others"
    ),
    "link": CommandEntry("depthtrack.cli.markers.link", "join points to trajectories without models"),
    "shuffle": CommandEntry("depthtrack.cli.markers.shuffle", "strip the labels of a capture, to test the labelling"),
    "cut": CommandEntry("depthtrack.cli.markers.cut", "cut stretches out of trajectories, to test the gap filling"),
}
