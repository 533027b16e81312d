"""Names and labels from files are text in the report, in its plots and in its scripts."""

import csv
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import pytest

import depthtrack
from depthtrack.evaluation.compare.results import write_results
from depthtrack.evaluation.evaluate import evaluate_run
from depthtrack.report.build import write_report
from depthtrack.strict_data import parse_json
from tests.support.runs import shifted, synthesise, true_poses, write_run

NAMES = (
    '"><img src=x onerror=document.title=1>',
    "</script><script>document.title=1</script>",
    "'-document.title=1-' {{ 7*7 }} {% x %}",
    "$\\frac{$ a$b^_ \\",
    "<svg onload=document.title=1> ]]> &lt; \u202e ö",
    "javascript:document.title=1//<a href=javascript:document.title=1>",
)
PACKAGE = Path(depthtrack.__file__).parent
_EMPTY = {"meta", "img", "input", "br", "link", "hr"}
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)


class Elements(HTMLParser):
    """The elements of a page with their attributes, its texts, and its scripts.

    Each element must be closed.
    """

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, list[tuple[str, str | None]]]] = []
        self.texts: list[str] = []
        self.scripts: list[tuple[dict[str, str | None], str]] = []
        self._open: list[str] = []
        self.feed(page)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, attrs))
        assert len(dict(attrs)) == len(attrs), f"{tag} has an attribute twice"
        if tag not in _EMPTY:
            self._open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, attrs))

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self._open and self._open[-1] == "script":
            self.scripts.append((dict(self.found[-1][1]), data))
        else:
            self.texts.append(data)


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return a report with plain names, then one with each of `NAMES`."""
    folder, found = tmp_path_factory.mktemp("hostile"), []
    recording = synthesise(folder / "recording", 3)
    poses = true_poses(recording)
    for number, name in enumerate(("plain", *NAMES)):
        place = folder / str(number) / name.replace("/", "_")
        shutil.copytree(recording, place)
        description = json.loads((place / "sequence.json").read_text())
        (place / "sequence.json").write_text(json.dumps({**description, "motion": name, name: name}))
        runs = [write_run(folder / str(number) / f"r{k}", place, shifted(poses, k), label=f"{name}{k}") for k in (2, 5)]
        rename_stage(runs[0] / "timings.csv", name)
        evaluations = [evaluate_run(run, residuals=False) for run in runs]
        write_report(evaluations, folder / f"{number}.html")
        write_results(evaluations, folder)
        assert parse_json((folder / "results.json").read_text())[0]["label"] == f"{name}2"
        found.append(folder / f"{number}.html")
    return found


def rename_stage(timings: Path, name: str) -> None:
    with timings.open(newline="") as file:
        (index, *_, last), *rows = csv.reader(file)
    with timings.open("w", newline="") as file:
        csv.writer(file).writerows([(index, name, last), *rows])


def test_names_make_no_elements_and_no_attributes(pages: list[Path]) -> None:
    plain, *others = (Elements(path.read_text(encoding="utf-8")) for path in pages)
    tags = {tag for tag, _ in plain.found}
    for page in others:
        assert {tag for tag, _ in page.found} <= tags
        assert not [name for _, attributes in page.found for name, _ in attributes if name.startswith("on")]


def test_names_are_in_no_script(pages: list[Path]) -> None:
    plain, *others = (Elements(path.read_text(encoding="utf-8")).scripts for path in pages)
    for scripts in others:
        assert [attributes for attributes, _ in scripts] == [attributes for attributes, _ in plain]
        for (attributes, text), (_, usual) in zip(scripts, plain, strict=True):
            if attributes.get("type") == "application/json":
                assert parse_json(text).keys() == {"images", "seconds"}
            else:
                assert text == usual


def test_addresses_lead_to_images_of_the_page(pages: list[Path]) -> None:
    """Nothing is fetched, and no address or style is a script."""
    for path in pages:
        for tag, attributes in Elements(path.read_text(encoding="utf-8")).found:
            for name, value in attributes:
                if name in ("src", "href", "xlink:href", "srcset", "action", "formaction", "data", "poster"):
                    assert re.match(r"#\w+$|data:image/webp;base64,[\w+/=]+$", value or ""), f"{tag} {name}={value}"
                elif name == "style":
                    assert not re.search(r"url\((?!#)|expression|javascript|@import", value or ""), value


def test_plots_are_strict_xml_of_shapes_and_text(pages: list[Path]) -> None:
    found = [re.findall(r"<svg .*?</svg>", path.read_text(encoding="utf-8"), re.DOTALL) for path in pages]
    assert all(len(plots) == len(found[0]) >= 4 for plots in found)
    shapes = {each.tag for plot in found[0] for each in ElementTree.fromstring(plot).iter()}
    assert not shapes & {"script", "foreignObject", "image", "a", "animate", "set"}
    for plots, name in zip(found[1:], NAMES, strict=True):
        roots = [ElementTree.fromstring(plot) for plot in plots]
        assert {each.tag for root in roots for each in root.iter()} <= shapes
        assert any(name in (each.text or "") for root in roots for each in root.iter())


def test_no_other_part_writes_pages_or_vector_graphics() -> None:
    writes = re.compile(r"""format="svg"|<svg|<html|from jinja2|\.svg["']""")
    found = {path for path in PACKAGE.rglob("*.py") if writes.search(path.read_text(encoding="utf-8"))}
    assert {path.parent.name for path in found} == {"report"}


def test_names_are_shown_as_they_are(pages: list[Path]) -> None:
    for path, name in zip(pages[1:], NAMES, strict=True):
        texts = Elements(path.read_text(encoding="utf-8")).texts
        assert any(name in text for text in texts), name


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")
def test_a_browser_runs_no_name(pages: list[Path]) -> None:
    for path in pages:
        command = [str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom", path.as_uri()]
        shown = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120).stdout
        assert "<title>1</title>" not in shown
