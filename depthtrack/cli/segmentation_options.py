"""Command-line options of the segmentation."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from depthtrack.cli.config_options import chosen_config, options_type
from depthtrack.cli.stated_default import number, stated_default
from depthtrack.segmentation.options import SegmentationOptions

PREFIX = "segmentation."


@dataclass(frozen=True)
class SegmentationShortcuts:
    """Short forms of frequent options of the segmentation."""

    skin_model: Annotated[Path | None, stated_default(metavar="FILE")] = None
    """Skin colour model from `depthtrack train-skin` (default: published statistics)."""
    skin_from: Annotated[int | None, number(0, 999_999, metavar="FRAME")] = None
    """Take the skin colours from the hand in this frame, found by depth alone: a glove, or coloured light."""
    wrist_margin: Annotated[float | None, number(-50, 200, metavar="MM")] = None
    """Length of the forearm to keep beyond the wrist (default: 0), for comparison with silhouettes that include it."""

    def applied(self, options: SegmentationOptions) -> SegmentationOptions:
        """Return the options with those that were given."""
        changed: dict[str, Any] = {}
        if self.skin_model is not None:
            changed["skin_model"] = str(self.skin_model)
        if self.skin_from is not None:
            changed["skin_from"] = self.skin_from
        if self.wrist_margin is not None:
            changed["wrist_margin"] = self.wrist_margin / 1000
        return dataclasses.replace(options, **changed)


class SegmentationArguments:
    """Options of the segmentation on the command line, with a configuration as defaults.

    arguments: those of the command.
    """

    def __init__(self, arguments: Sequence[str], options: SegmentationOptions | None = None) -> None:
        self._options = options or SegmentationOptions()
        self.type = options_type(self._options, arguments, PREFIX)

    @property
    def field(self) -> tuple[str, Any, Any]:
        """Field of a command's dataclass: name, type and default."""
        return ("segmentation", Annotated[self.type, tyro.conf.OmitArgPrefixes], dataclasses.field(default=self.type()))

    def chosen(self, values: Any, shortcuts: SegmentationShortcuts) -> SegmentationOptions:
        """Return the options that the command line chose, with an absolute path of the model.

        values: value of `field`.

        Raises:
            InputError: if a value is out of range.
        """
        options = shortcuts.applied(chosen_config(self._options, values, PREFIX))
        if options.skin_model is None or options.skin_model == self._options.skin_model:
            return options
        return dataclasses.replace(options, skin_model=str(Path(options.skin_model).resolve()))
