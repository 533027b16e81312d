"""Synthesisers of recordings from options."""

from typing import Any

from depthtrack.synthesis.generate import Synthesis, Synthesiser


def synthesiser(**options: Any) -> Synthesiser:
    """Return the synthesiser of a recording with the given options."""
    return Synthesiser(Synthesis(**options))
