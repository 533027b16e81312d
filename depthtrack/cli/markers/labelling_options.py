"""Options of the labelling, as the configuration states them."""

import dataclasses
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Any, Literal

import tyro

from depthtrack.cli.config_options import chosen_config, options_type
from depthtrack.cli.markers.capture_options import CaptureOptions
from depthtrack.cli.markers.folder_options import FolderOptions
from depthtrack.errors import InputError
from depthtrack.markers.labelling.options import PAPER_LABELLING, LabellingOptions, OfflineOptions

PREFIX = "labelling."
Method = Literal["offline", "online", "paper"]
METHODS: dict[str, LabellingOptions] = {
    "offline": LabellingOptions(),
    "online": LabellingOptions(offline=OfflineOptions(use=False)),
    "paper": PAPER_LABELLING,
}


class LabellingArguments:
    """Options of the labelling on the command line, with those of the method as defaults.

    arguments: those of the command.

    Raises:
        InputError: if the arguments name no method.
    """

    def __init__(self, arguments: Sequence[str]) -> None:
        names = [value for option, value in pairwise(arguments) if option == "--method"]
        names += [each.partition("=")[2] for each in arguments if each.startswith("--method=")]
        name = names[-1] if names else "offline"
        if name not in METHODS:
            raise InputError(f"there is no method '{name[:40]}': choose one of {', '.join(METHODS)}")
        self._options = METHODS[name]
        self.type = options_type(self._options, arguments, PREFIX)

    @property
    def field(self) -> tuple[str, Any, Any]:
        """Field of a command's dataclass: name, type and default."""
        return ("labelling", Annotated[self.type, tyro.conf.OmitArgPrefixes], dataclasses.field(default=self.type()))

    def chosen(self, values: Any) -> LabellingOptions:
        """Return the options that the command line chose. Raises InputError if one is out of range."""
        return chosen_config(self._options, values, PREFIX)


def labelling_command(base: type[Any], arguments: Sequence[str]) -> tuple[type[Any], Any]:
    """Return a command with the options of the labelling, and its default values.

    base: dataclass with a capture, a folder, and a property `labelling_options` to replace.

    Raises:
        InputError: if the arguments name no method.
    """
    labelling = LabellingArguments(arguments)
    namespace = {
        "__doc__": base.__doc__,
        "labelling_options": property(lambda self: labelling.chosen(self.labelling)),
    }
    Command = dataclasses.make_dataclass("Command", [labelling.field], bases=(base,), frozen=True, namespace=namespace)
    return Command, Command(capture=CaptureOptions(tyro.MISSING), folder=FolderOptions(tyro.MISSING))
