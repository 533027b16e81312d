"""`depthtrack doctor`: check the renderers of this machine."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from depthtrack.cli.progress import bar
from depthtrack.cli.stated_default import number
from depthtrack.errors import DepthtrackError
from depthtrack.text_table import aligned

if TYPE_CHECKING:
    from depthtrack.rendering.doctor import Outcome, SystemInfo


@dataclass(frozen=True)
class Command:
    """Check this machine: versions, processor and renderers.

    Prints the speed of each renderer and its difference from the oracle. Each renderer runs in its own process, since
    drivers may crash or hang. EGL and OSMesa are optional. The default renderer needs neither.
    """

    time_limit: Annotated[float, number(0.1, 3600)] = 60.0
    """Seconds that a renderer may take to start, compile and return."""
    json: bool = False
    """Print JSON, in SI units, instead of text."""

    def run(self) -> None:
        from dataclasses import asdict

        from depthtrack.cli.broken_imports import advice, broken_imports
        from depthtrack.strict_data import json_text

        if broken := broken_imports():
            raise DepthtrackError("; ".join(advice(module, reason) for module, reason in broken.items()))

        from depthtrack.rendering.doctor import SystemInfo, examine

        machine = SystemInfo.here()
        outcomes = examine(
            self.time_limit,
            progress=lambda trials: bar(trials, "renderer"),
        )
        if self.json:
            rows = [{**asdict(outcome), "works": outcome.works} for outcome in outcomes]
            print(json_text({"machine": asdict(machine), "renderers": rows}, indent=2))
        else:
            print(_text(machine, outcomes))
        default = outcomes[0]
        if not default.works:
            raise DepthtrackError(f"the default renderer, {default.trial.label}, does not work here: {default.problem}")


def _text(machine: "SystemInfo", outcomes: "list[Outcome]") -> str:
    """Return aligned lines, with depth in millimetres."""
    from depthtrack.compilation import VARIABLE

    kept = machine.compiled_kernels or f"compiled again in each run: set {VARIABLE} to a writable folder"
    libraries = [f"{name} {version}" for name, version in machine.libraries.items() if version]
    absent = [name for name, version in machine.libraries.items() if version is None]
    vectors = ", ".join(name for name, has in (("AVX2", machine.avx2), ("AVX-512", machine.avx512)) if has)
    lines = [
        f"{'depthtrack':<15}{machine.depthtrack} on Python {machine.python}, {machine.system}",
        f"{'processor':<15}{machine.processor}, {machine.threads} threads, {vectors or 'neither AVX2 nor AVX-512'}",
        f"{'kernels':<15}{kept}",
        *_wrapped("libraries", _listed(libraries)),
        *_wrapped("not installed", _listed(absent)),
        "",
        *_table(outcomes),
        "",
        "Speed: 64 hypotheses of 64 x 64 pixels, with kinematics and objective; best of many calls.",
        "Differences: the largest ones from the float64 ray caster, over the same hypotheses.",
    ]
    problems = [outcome for outcome in outcomes if not outcome.works]
    for outcome in problems:
        lines += ["", *_wrapped(outcome.trial.label, (outcome.problem or "").split(), indent=17)]
    return "\n".join(lines)


def _table(outcomes: "list[Outcome]") -> list[str]:
    head = ("renderer", "works", "hypotheses/s", "energy", "depth", "silhouette", "drawn by")
    return aligned([head, *(_row(outcome) for outcome in outcomes)], left=2, text=(6,))


def _row(outcome: "Outcome") -> tuple[str, ...]:
    check = outcome.check
    if check is None:
        return outcome.trial.label, "no", "", "", "", "", ""
    return (
        outcome.trial.label,
        "yes" if outcome.works else "no",
        f"{check.hypotheses_per_s:,.0f}",
        f"{check.energy_difference:.1g}",
        f"{1000 * check.depth_difference:.1g} mm",
        f"{check.silhouette_pixels} px",
        f"{check.renderer}, {'software' if check.software else 'hardware'}",
    )


def _listed(items: list[str]) -> list[str]:
    return [f"{item}," for item in items[:-1]] + items[-1:]


def _wrapped(label: str, words: list[str], indent: int = 15, width: int = 110) -> list[str]:
    """Return lines with words after a label, equally indented; none without words."""
    lines: list[str] = []
    for word in words:
        if lines and indent + len(lines[-1]) + 1 + len(word) <= width:
            lines[-1] += f" {word}"
        else:
            lines.append(word)
    return [f"{label if i == 0 else '':<{indent}}{line}" for i, line in enumerate(lines)]
