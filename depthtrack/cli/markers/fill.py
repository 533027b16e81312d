"""`depthtrack markers fill`: fill the gaps of labelled markers."""

from collections.abc import Sequence
from dataclasses import dataclass, field, make_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from depthtrack.cli.config_options import chosen_config, options_type
from depthtrack.cli.markers.folder_options import FolderOptions
from depthtrack.errors import printable
from depthtrack.markers.filling.options import FillOptions

if TYPE_CHECKING:
    from depthtrack.markers.filled_capture import FilledCapture


@dataclass(frozen=True)
class LabelledArgument:
    """Folder of labelled markers."""

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(name="folder", metavar="FOLDER")]
    """Folder that `markers label` or `markers solve` wrote."""


@dataclass(frozen=True)
class FillCommand:
    """Fill the gaps of labelled markers by the joints of the hand.

    The new folder has the filled trajectories, and in filled.csv how each sample was filled and its expected error.
    Gaps at the start and the end, and longer ones than --longest, stay gaps.
    """

    labelled: tyro.conf.OmitArgPrefixes[LabelledArgument]
    folder: tyro.conf.OmitArgPrefixes[FolderOptions]
    json: bool = False
    """Print figures as JSON instead of a table."""

    @property
    def filling_options(self) -> FillOptions:
        """Options of the filling."""
        raise NotImplementedError

    def run(self) -> None:
        from depthtrack.files import write_atomic
        from depthtrack.markers.filling.fill import fill_gaps
        from depthtrack.markers.folder.reading import MarkerFolder
        from depthtrack.options import to_data
        from depthtrack.viewing.marker_gaps import gap_pages

        options, given = self.filling_options, MarkerFolder.load(self.labelled.path)
        given.check_source()
        self.folder.check(given.labelled.models)
        filled = fill_gaps(given.labelled, options)
        configuration = {**given.contents.configuration, "command": "fill", "filling": to_data(options)}
        self.folder.write(given.labelled, given.contents.source, configuration, filled)
        if self.folder.pictures:
            for number, page in enumerate(gap_pages(filled, self.labelled.path.name), start=1):
                write_atomic(self.folder.out / f"gaps-{number}.png", page)
        print_gaps(self.folder.out, filled, self.json)


def print_gaps(folder: Path, filled: "FilledCapture", as_json: bool) -> None:
    """Print the gaps of each marker and what became of them, as a table or as strict JSON."""
    from depthtrack.markers.filling.fill_report import fill_report
    from depthtrack.strict_data import json_text

    rows = fill_report(filled)
    if as_json:
        print(json_text({"folder": str(folder), "markers": rows}, indent=2))
        return
    print(f"{folder}: {sum(row['gaps'] for row in rows)} gaps, {sum(row['filled'] for row in rows)} filled")
    print(f"  {'marker':24}{'gaps':>6}{'filled':>8}{'longest':>10}{'samples':>9}{'expected error':>16}  how")
    for row in rows:
        error = "-" if row["expected_error_mm"] is None else f"{row['expected_error_mm']:.2f} mm"
        marker = printable(row["marker"])[:24]
        print(
            f"  {marker:24}{row['gaps']:>6}{row['filled']:>8}{row['longest_s']:>8.2f} s{row['samples']:>9}"
            f"{error:>16}  {', '.join(row['how'])}"
        )


def command(arguments: Sequence[str]) -> tuple[type[FillCommand], Any]:
    """Return the command with the options of the filling."""
    kind = options_type(FillOptions(), arguments)
    namespace = {
        "__doc__": FillCommand.__doc__,
        "filling_options": property(lambda self: chosen_config(FillOptions(), self.filling)),
    }
    fields = [("filling", Annotated[kind, tyro.conf.OmitArgPrefixes], field(default=kind()))]
    Command = make_dataclass("Command", fields, bases=(FillCommand,), frozen=True, namespace=namespace)
    return Command, Command(labelled=LabelledArgument(tyro.MISSING), folder=FolderOptions(tyro.MISSING))
