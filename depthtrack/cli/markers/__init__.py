"""`depthtrack markers`: a group of commands, each one module that is imported on its call."""

from depthtrack.cli import CommandEntry

COMMANDS: dict[str, CommandEntry] = {}
