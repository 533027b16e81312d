"""Command line: parse, call, print. Each command is one module, imported on its call."""

import atexit
import gc
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import ModuleType

from depthtrack import __version__
from depthtrack.cli.arguments import check_arguments
from depthtrack.cli.ending import (
    BROKEN_PIPE,
    INTERRUPTED,
    TERMINATED,
    Terminated,
    drop_unwritable_output,
    terminable,
    write_output,
)
from depthtrack.errors import DepthtrackError, printable


@dataclass(frozen=True)
class CommandEntry:
    """Entry of the overview of commands.

    module: module with a dataclass `Command` that has a method `run()`, a function `command(arguments)`, or a group
        of commands, `COMMANDS`.
    summary: one line of help.
    """

    module: str
    summary: str


COMMANDS = {
    "demo": CommandEntry("depthtrack.cli.demo", "track a synthetic recording or yours, and write a report"),
    "info": CommandEntry("depthtrack.cli.info", "list frames, camera, depth and ground truth of a recording"),
    "synth": CommandEntry("depthtrack.cli.synth", "synthesise a recording of a moving hand with exact ground truth"),
    "segment": CommandEntry("depthtrack.cli.segment", "segment the hand in every frame: video, contact sheet, table"),
    "train-skin": CommandEntry("depthtrack.cli.train_skin", "train a skin colour model on labelled images"),
    "track": CommandEntry("depthtrack.cli.track", "track the hand of a recording and write a run folder"),
    "live": CommandEntry("depthtrack.cli.live", "track a camera, or a recording played like one, and report latency"),
    "lift": CommandEntry("depthtrack.cli.lift", "lift 2D keypoints and depth images to metric poses"),
    "compare": CommandEntry("depthtrack.cli.compare", "compare trackers on recordings: table, results, report"),
    "evaluate": CommandEntry("depthtrack.cli.evaluate", "measure errors and time of runs"),
    "calibrate": CommandEntry("depthtrack.cli.calibrate", "measure the hand of a recording: side, scale, sizes"),
    "markers": CommandEntry("depthtrack.cli.markers", "label, solve and fill optical marker captures of hands"),
    "synergies": CommandEntry("depthtrack.cli.synergies", "fit or show principal components of hand postures"),
    "view": CommandEntry("depthtrack.cli.view", "show a recording or a run: viewer, video, contact sheet"),
    "video": CommandEntry("depthtrack.cli.video", "write a video of a run: the tracked hand over the recording"),
    "convert": CommandEntry("depthtrack.cli.convert", "write a recording as a folder of images or an MCAP file"),
    "export": CommandEntry("depthtrack.cli.export", "write the joints of a run for other programs"),
    "reproduce": CommandEntry("depthtrack.cli.reproduce", "repeat experiments of the papers, with both figures"),
    "bench": CommandEntry("depthtrack.cli.bench", "measure the speed of scoring, fitting and segmentation"),
    "warmup": CommandEntry("depthtrack.cli.warmup", "compile the kernels ahead of the first run"),
    "doctor": CommandEntry("depthtrack.cli.doctor", "check the renderers of this machine"),
}

_HELP = ("-h", "--help", "help")
_BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Variables of the libraries that numpy and scipy multiply matrices with; read when numpy is imported."""
_NEW_OBJECTS = 20_000
"""New objects after which Python looks for garbage. By default 700: imports make 300,000, and hardly any is garbage."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    The code is 0 on success, and 2 for an error that the user can correct. It is 130 after an interrupt (Ctrl-C), and
    143 after SIGTERM. It is 141 if the reader of the output closes it before the end of the work.
    """
    gc.set_threshold(_NEW_OBJECTS)
    atexit.register(gc.freeze)  # at its end Python would look for garbage among all objects: a quarter of a second
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    name = arguments[0] if arguments else "--help"
    try:
        with terminable():
            check_arguments(arguments)
            code = _run(name, arguments[1:])
        write_output()
        return code
    except DepthtrackError as error:
        _print_error(name, str(error))
        return 2
    except ImportError as error:
        from depthtrack.cli.broken_imports import advice, failed_module

        module = failed_module(error)
        if module is None:
            raise
        _print_error(name, advice(module, str(error)))
        return 2
    except Terminated:
        _print_error(name, "terminated")
        return TERMINATED
    except KeyboardInterrupt:
        _print_error(name, "interrupted")
        return INTERRUPTED
    except BrokenPipeError:
        return BROKEN_PIPE
    except OSError as error:
        # A full disk or a missing permission: the reason of the system is enough.
        _print_error(name, f"{error.filename or 'input or output'}: {error.strerror or error}")
        return 2
    finally:
        drop_unwritable_output()


def _print_error(name: str, message: str) -> None:
    """Print the error of a command in one line."""
    print(printable(f"depthtrack {name}: {message}"), file=sys.stderr)


def _run(name: str, arguments: list[str]) -> int:
    if name in _HELP:
        title = f"depthtrack {__version__}: hand tracking from RGB-D video on an ordinary CPU"
        print(_overview(title, "depthtrack", COMMANDS))
    elif name in ("-V", "--version"):
        print(f"depthtrack {__version__}")
    else:
        _run_one(COMMANDS, "depthtrack", name, arguments)
    return 0


def _run_one(commands: Mapping[str, CommandEntry], prog: str, name: str, arguments: list[str]) -> None:
    """Run a command, or one of the group that the name stands for.

    Raises:
        DepthtrackError: if there is no such command, or its own error.
    """
    from importlib import import_module

    if name not in commands:
        raise DepthtrackError(f"there is no command '{name}': choose one of {', '.join(commands)}")
    entry, prog = commands[name], f"{prog} {name}"
    _multiply_in_one_thread()
    module = import_module(entry.module)
    if not hasattr(module, "COMMANDS"):
        from depthtrack.cli.argument_checks import check_arguments
        from depthtrack.memory import keep_freed_memory

        command = _parse(module, prog, arguments)
        check_arguments(command)
        keep_freed_memory()
        command.run()
    elif not arguments or arguments[0] in _HELP:
        print(_overview(f"{prog}: {entry.summary}", prog, module.COMMANDS))
    else:
        _run_one(module.COMMANDS, prog, arguments[0], arguments[1:])


def _multiply_in_one_thread() -> None:
    """Set one thread for the products of numpy and scipy, unless the user chose a number.

    Matrices here are small. The threads of a BLAS wait for each other longer than they compute, and without sleep.
    """
    if "numpy" not in sys.modules:
        for variable in _BLAS_THREADS:
            os.environ.setdefault(variable, "1")


def _parse(module: ModuleType, prog: str, arguments: list[str]) -> "RunnableCommand":
    import tyro

    if hasattr(module, "command"):
        # The options are those of configurations, which the arguments may name.
        command, default = module.command(arguments)
        parsed: RunnableCommand = tyro.cli(command, args=arguments, prog=prog, default=default)
    else:
        parsed = tyro.cli(module.Command, args=arguments, prog=prog)
    return parsed


class RunnableCommand:
    """Options of a command."""

    def run(self) -> None:
        """Execute the command.

        Raises:
            DepthtrackError: if the user can correct the cause.
        """
        raise NotImplementedError


def _overview(title: str, prog: str, commands: Mapping[str, CommandEntry]) -> str:
    width = max(map(len, commands), default=0)
    lines = [f"  {name:<{width}}  {entry.summary}" for name, entry in commands.items()]
    return "\n".join(
        [
            title,
            "",
            f"usage: {prog} COMMAND [OPTIONS]      ({prog} COMMAND --help lists its options)",
            "",
            *lines,
        ]
    )


if __name__ == "__main__":
    sys.exit(main())
