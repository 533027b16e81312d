"""`bench markers`: rows for both scenes and methods."""

from depthtrack.benchmarks.speed import markers


def test_the_report_has_a_row_for_each_scene_and_method() -> None:
    report = markers.run(markers.plan(0.01))
    assert [(row.markers, row.method) for row in report.rows] == [
        (26, "default"),
        (26, "paper"),
        (35, "default"),
        (35, "paper"),
    ]
    assert all(row.right > 0.98 for row in report.rows if row.method == "default")
    assert "frames/s" in markers.as_text(report)
