"""The matrix of options covers all commands; `make robustness` runs it."""

from depthtrack.ranges import Range
from tests.robustness.forked import Ended
from tests.robustness.option_matrix import MATRIX, Case, cases, entries


def test_every_command_is_in_the_matrix() -> None:
    assert {*MATRIX["commands"], *MATRIX["refused_before_work"]} == set(entries())


def test_every_number_has_cases_beyond_its_range() -> None:
    found = list(cases("track"))
    beyond = {case.arguments[-2] for case in found if case.beyond}
    assert {"--particles", "--seed", "--segmentation.farthest"} <= beyond
    assert len(beyond) > 150
    assert sum(case.beyond is None for case in found) > 150


def test_what_a_case_must_give() -> None:
    usual, beyond = Case(("info", "S", "--json")), Case(("info", "S"), Range(1, 10))
    assert usual.problem(Ended(0, '{"x": 1}', "")) is None
    assert usual.problem(Ended(0, '{"x": NaN}', "")) == "printed no strict JSON"
    assert usual.problem(Ended(1, "", "Traceback")) is not None
    assert usual.problem(Ended(2, "", "note: depth is far\ndepthtrack info: no hand\n")) is None
    assert usual.problem(Ended(2, "", "depthtrack info: no hand\nnote: depth is far\nmore\n")) is not None
    assert beyond.problem(Ended(0, "", "")) is not None
    assert beyond.problem(Ended(2, "", "depthtrack info: there is no recording at S\n")) is not None
    assert beyond.problem(Ended(2, "", "depthtrack info: --sample must be from 1 to 10, found 0\n")) is None
