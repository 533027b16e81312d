"""Lists of other tools: separators, encodings, association lists, folders without a list."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from depthtrack.cli import main
from depthtrack.errors import InputError
from depthtrack.recording import image_size, open_sequence
from tests.support.folders import Change, each_line, lines_of, stripped_sample, write_lines
from tests.support.recordings import CAMERA, TIMES, colour_at, depth_at


@pytest.fixture
def sample(tmp_path: Path) -> Path:
    return stripped_sample(tmp_path / "sample")


def encoded(encoding: str = "utf-8", newline: str = "\n", heading: str = "# timestamp filename") -> Change:
    def change(folder: Path) -> None:
        for name in ("depth.txt", "rgb.txt"):
            lines = [f"{time} {image}" for time, image in lines_of(folder / name)]
            write_lines(folder / name, [heading, *lines], encoding, newline)

    return change


def renamed(old: str, new: str) -> Change:
    return lambda folder: (folder / old).rename(folder / new)


def both(*changes: Change) -> Change:
    def change(folder: Path) -> None:
        for each in changes:
            each(folder)

    return change


def associations(name: str, colour_first: bool = True, separator: str = " ") -> Change:
    """Return a change to one list of four columns."""

    def change(folder: Path) -> None:
        pairs = zip(lines_of(folder / "rgb.txt"), lines_of(folder / "depth.txt"), strict=True)
        rows = [(*colour, *depth) if colour_first else (*depth, *colour) for colour, depth in pairs]
        for list_name in ("depth.txt", "rgb.txt"):
            (folder / list_name).unlink()
        write_lines(folder / name, [separator.join(map(str, row)) for row in rows])

    return change


def upper_case_images(folder: Path) -> None:
    """Rename images and folders, so that the lists name them in another case."""
    for inner in ("depth", "rgb"):
        for path in (folder / inner).iterdir():
            path.rename(path.with_name(path.name.upper()))
        (folder / inner).rename(folder / inner.upper())


READ_AS_THEY_ARE: dict[str, Change] = {
    "commas": each_line(lambda t, name: f"{t},{name}"),
    "commas and blanks": each_line(lambda t, name: f"{t}, {name}"),
    "semicolons": each_line(lambda t, name: f"{t};{name}"),
    "tabs": each_line(lambda t, name: f"{t}\t{name}"),
    "quotes": each_line(lambda t, name: f'{t},"{name}"'),
    "a third column": each_line(lambda t, name: f"{t},{name},12.5"),
    "decimal commas": each_line(lambda t, name: f"{t:.6f} {name}".replace(".", ",", 1)),
    "names before times": each_line(lambda t, name: f"{name} {t}"),
    "exponents": each_line(lambda t, name: f"{t:.9e} {name}"),
    "backslashes": each_line(lambda t, name: f"{t} {name}".replace("/", "\\")),
    "a leading dot": each_line(lambda t, name: f"{t} ./{name}"),
    "CRLF": encoded(newline="\r\n"),
    "a byte order mark": encoded("utf-8-sig"),
    "CRLF, tabs and a byte order mark": both(
        each_line(lambda t, name: f"{t} {name}"), encoded("utf-8-sig", newline="\r\n")
    ),
    "a heading": encoded(heading="timestamp,filename"),
    "upper-case lists": both(renamed("depth.txt", "DEPTH.TXT"), renamed("rgb.txt", "Rgb.txt")),
    "upper-case images": upper_case_images,
    "color.txt": renamed("rgb.txt", "color.txt"),
    "colour.txt in upper case": renamed("rgb.txt", "COLOUR.TXT"),
    "associations.txt": associations("associations.txt"),
    "associations with depth first": associations("associations.txt", colour_first=False),
    "associations with commas": associations("associate.txt", separator=","),
    "associations in depth.txt": associations("depth.txt"),
}


@pytest.mark.parametrize("kind", READ_AS_THEY_ARE)
def test_lists_of_other_tools_are_read(sample: Path, kind: str) -> None:
    READ_AS_THEY_ARE[kind](sample)
    assert image_size(sample) == (CAMERA.width, CAMERA.height)
    sequence = open_sequence(sample)
    np.testing.assert_allclose(sequence.timestamps, TIMES, atol=1e-9)
    for index, frame in enumerate(sequence):
        np.testing.assert_allclose(frame.depth, depth_at(index), atol=0.001)
        assert frame.colour is not None
        assert np.abs(frame.colour.astype(int) - colour_at(index)).mean() < 3


@pytest.mark.parametrize("kind", ["color.txt", "associations.txt"])
def test_a_list_of_another_name_is_reported(sample: Path, kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    READ_AS_THEY_ARE[kind](sample)
    assert main(["info", str(sample)]) == 0
    assert f"those of {kind}" in capsys.readouterr().out


def without_lists(*, inner: bool) -> Change:
    """Return a change to numbered images in folders, or beside each other with a prefix."""

    def change(folder: Path) -> None:
        for kind, new in (("depth", "depth"), ("rgb", "color")):
            (folder / f"{kind}.txt").unlink()
            images = sorted((folder / kind).iterdir())
            (folder / new).mkdir(exist_ok=True)
            # Numbers without leading zeros: 10 must follow 9.
            for number, path in enumerate(images, start=8):
                target = f"{new}/frame-{number}{path.suffix}" if inner else f"{new}_{number}{path.suffix}"
                path.rename(folder / target)
        if not inner:
            shutil.rmtree(folder / "depth")
            shutil.rmtree(folder / "color")

    return change


@pytest.mark.parametrize("inner", [True, False], ids=["in folders", "with a prefix"])
def test_numbered_images_need_no_list(sample: Path, inner: bool, capsys: pytest.CaptureFixture[str]) -> None:
    without_lists(inner=inner)(sample)
    sequence = open_sequence(sample)
    np.testing.assert_allclose(sequence.timestamps, np.arange(8, 13) / 30)
    for index, frame in enumerate(sequence):
        np.testing.assert_allclose(frame.depth, depth_at(index), atol=0.001)
        assert frame.colour is not None
    assert main(["info", str(sample)]) == 0
    assert "ordered by the numbers in their names" in capsys.readouterr().out


def test_images_named_by_their_times_need_no_list(sample: Path) -> None:
    for name in ("depth.txt", "rgb.txt"):
        (sample / name).unlink()
    np.testing.assert_allclose(open_sequence(sample).timestamps, TIMES)


def test_a_list_of_colour_without_a_line_means_depth_alone(sample: Path) -> None:
    (sample / "rgb.txt").write_text("# timestamp filename\n")
    assert not open_sequence(sample).has_colour


REFUSED: dict[str, tuple[Change, str]] = {
    "UTF-16": (encoded("utf-16"), "must be a text file"),
    "names alone": (each_line(lambda _, name: name), "expected 'timestamp filename'"),
    "absolute names": (each_line(lambda t, name: f"{t} C:\\data\\{name}"), r"write its name from there, as in depth/"),
    "dates": (each_line(lambda t, name: f"2024-05-01T12:00:{t} {name}"), "expected 'timestamp filename'"),
    "two unnamed columns": (
        lambda folder: write_lines(folder / "depth.txt", ["0.0 a/1.png 0.0 b/1.png"]),
        "write depth.txt with lines 'timestamp filename'",
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_a_list_that_cannot_be_read_names_the_line_to_write(sample: Path, kind: str) -> None:
    change, message = REFUSED[kind]
    change(sample)
    with pytest.raises(InputError, match=message):
        open_sequence(sample)
