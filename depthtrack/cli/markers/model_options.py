"""Options of the models that commands find in a capture."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from depthtrack.cli.stated_default import stated_default

if TYPE_CHECKING:
    from depthtrack.markers.models.marker_model import MarkerModel


@dataclass(frozen=True)
class ModelOptions:
    """Models to find in a capture."""

    models: Annotated[tuple[str, ...], stated_default(aliases=("-m",), metavar="MODEL ...")] = field(
        default_factory=tuple
    )
    """Each a layout such as 26 or left:16, a layout file, or the file of a model from `markers model` or `solve`.

    The markers decide the side of a layout without one, unless --hand gives it.
    """
    hand: Annotated[Path | None, stated_default(metavar="HAND.json")] = None
    """Sizes of hands that wear layouts (default: the average adult's, which the capture corrects)."""

    synergies: Annotated[str, tyro.conf.arg(metavar="NAME")] = "auto"
    """Postures that are likely, for hands with fewer than two markers on a finger: a set, a file, or none.

    By default those of the layout's file, which `markers layout` writes, and `leap` for six markers or fewer.
    """

    def load(self) -> "tuple[MarkerModel, ...]":
        """Return the models.

        Raises:
            InputError: if there is none, or a file cannot be read.
        """
        from depthtrack.hand.shape import HandShape
        from depthtrack.markers.models.model_choice import choose_models, with_synergies

        models = choose_models(self.models, None if self.hand is None else HandShape.from_json(self.hand))
        return with_synergies(models, self.synergies)
