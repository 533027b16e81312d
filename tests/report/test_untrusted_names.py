"""Names and labels from files are text in the report, in its plots and in its scripts."""

import json
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest

from depthtrack.evaluation.compare.results import write_results
from depthtrack.evaluation.evaluate import evaluate_run
from depthtrack.report.build import write_report
from depthtrack.strict_data import parse_json
from tests.support.runs import shifted, true_poses, write_run

NAMES = (
    '"><img src=x onerror=document.title=1>',
    "</script><script>document.title=1</script>",
    "'-document.title=1-' {{ 7*7 }} {% x %}",
    "$\\frac{$ a$b^_ \\",
    "<svg onload=document.title=1> ]]> &lt; \u202e ö",
)
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)


class Elements(HTMLParser):
    """The elements of a page with their attributes, and its texts."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, list[tuple[str, str | None]]]] = []
        self.texts: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, attrs))

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


@pytest.fixture(scope="module")
def pages(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return a report with plain names, then one with each of `NAMES`."""
    folder, found = tmp_path_factory.mktemp("hostile"), []
    poses = true_poses(recording)
    for number, name in enumerate(("plain", *NAMES)):
        place = folder / str(number) / name.replace("/", "_")
        shutil.copytree(recording, place)
        description = json.loads((place / "sequence.json").read_text())
        (place / "sequence.json").write_text(json.dumps({**description, "motion": name, name: name}))
        runs = [write_run(folder / str(number) / f"r{k}", place, shifted(poses, k), label=f"{name}{k}") for k in (2, 5)]
        evaluations = [evaluate_run(run, residuals=False) for run in runs]
        write_report(evaluations, folder / f"{number}.html")
        write_results(evaluations, folder)
        assert parse_json((folder / "results.json").read_text())[0]["label"] == f"{name}2"
        found.append(folder / f"{number}.html")
    return found


def test_names_make_no_elements_and_no_attributes(pages: list[Path]) -> None:
    plain, *others = (Elements(path.read_text(encoding="utf-8")) for path in pages)
    scripts = [attributes for tag, attributes in plain.found if tag == "script"]
    tags = {tag for tag, _ in plain.found}
    for page in others:
        assert [attributes for tag, attributes in page.found if tag == "script"] == scripts
        assert {tag for tag, _ in page.found} <= tags
        assert not [name for _, attributes in page.found for name, _ in attributes if name.startswith("on")]


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
