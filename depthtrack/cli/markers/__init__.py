"""`depthtrack markers`: a group of commands, each one module that is imported on its call."""

from depthtrack.cli import CommandEntry

COMMANDS = {
    "info": CommandEntry("depthtrack.cli.markers.info", "list frames, markers, gaps and size of a capture"),
}
