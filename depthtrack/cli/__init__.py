"""The command line: parse, call, print. One module a command; none is imported before it is asked for."""

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass

from depthtrack import __version__
from depthtrack.errors import DepthtrackError


@dataclass(frozen=True)
class CommandEntry:
    """Where a command lives: `module` holds a dataclass `Command` with a `run()` that returns nothing."""

    module: str
    summary: str


COMMANDS = {
    "demo": CommandEntry(
        "depthtrack.cli.demo", "one command to a report: both trackers on a synthetic recording, or yours"
    ),
    "info": CommandEntry("depthtrack.cli.info", "tell what a recording holds"),
    "synth": CommandEntry("depthtrack.cli.synth", "synthesise a sequence of a moving hand with exact ground truth"),
    "segment": CommandEntry("depthtrack.cli.segment", "find the hand in every frame: overlay video, contact sheet"),
    "train-skin": CommandEntry("depthtrack.cli.train_skin", "learn a skin colour model from labelled images"),
    "track": CommandEntry("depthtrack.cli.track", "track the hand through a recording, into a run folder"),
    "compare": CommandEntry("depthtrack.cli.compare", "trackers side by side: table, results, report"),
    "evaluate": CommandEntry("depthtrack.cli.evaluate", "how good and how fast a run is, against the ground truth"),
    "calibrate": CommandEntry("depthtrack.cli.calibrate", "measure the hand of a recording: side, scale, every finger"),
    "synergies": CommandEntry("depthtrack.cli.synergies", "principal components of hand postures: fit, look at"),
    "view": CommandEntry("depthtrack.cli.view", "look at a recording: viewer, video or contact sheet"),
    "video": CommandEntry("depthtrack.cli.video", "a film of a run: the tracked hand over the recording"),
    "export": CommandEntry("depthtrack.cli.export", "the joints of a run, as a table, arrays or a benchmark's text"),
    "reproduce": CommandEntry("depthtrack.cli.reproduce", "repeat the papers' experiments, our figures beside theirs"),
    "bench": CommandEntry("depthtrack.cli.bench", "speed of scoring hypotheses, and of fitting the surface"),
    "doctor": CommandEntry("depthtrack.cli.doctor", "tell what works on this machine, and what to install"),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code: 0 done, 2 the user's mistake or a bad file, 130 interrupted."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    name = arguments[0] if arguments else "--help"
    try:
        code = _run(name, arguments[1:])
        sys.stdout.flush()
        return code
    except DepthtrackError as error:
        print(f"depthtrack {name}: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"depthtrack {name}: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # The reader of our output (head, less) went away: what remains, Python's last flush included, is dropped.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        # A full disk, a folder without permission: nothing of ours is wrong, and the reason says what to do.
        print(f"depthtrack {name}: {error.filename or 'input or output'}: {error.strerror or error}", file=sys.stderr)
        return 2


def _run(name: str, arguments: list[str]) -> int:
    if name in ("-h", "--help", "help"):
        print(_overview())
    elif name in ("-V", "--version"):
        print(f"depthtrack {__version__}")
    elif name in COMMANDS:
        _parse(name, arguments).run()
    else:
        raise DepthtrackError(f"no such command; choose one of {', '.join(COMMANDS)}")
    return 0


def _parse(name: str, arguments: list[str]) -> "RunnableCommand":
    from importlib import import_module

    import tyro

    module, prog = import_module(COMMANDS[name].module), f"depthtrack {name}"
    if hasattr(module, "command"):
        # The options depend on the tracker that the arguments name.
        command, default = module.command(arguments)
        parsed: RunnableCommand = tyro.cli(command, args=arguments, prog=prog, default=default)
    else:
        parsed = tyro.cli(module.Command, args=arguments, prog=prog)
    return parsed


class RunnableCommand:
    """A command's options; `run` does the work and raises DepthtrackError for what the user can mend."""

    def run(self) -> None:
        raise NotImplementedError


def _overview() -> str:
    width = max(map(len, COMMANDS))
    lines = [f"  {name:<{width}}  {entry.summary}" for name, entry in COMMANDS.items()]
    return "\n".join(
        [
            f"depthtrack {__version__}: hand tracking from RGB-D video on an ordinary CPU",
            "",
            "usage: depthtrack COMMAND [OPTIONS]      (depthtrack COMMAND --help tells its options)",
            "",
            *lines,
        ]
    )


if __name__ == "__main__":
    sys.exit(main())
