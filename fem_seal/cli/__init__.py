"""The commands, each in a module of its own; nothing heavy is imported before it runs."""

from fem_seal.interrupts import ended_silently, interruptible

# Ctrl-C during the imports, which take half a second, ends the command without a traceback.
with ended_silently():
    import argparse
    import os
    import re
    import sys
    from collections.abc import Collection
    from io import TextIOWrapper
    from typing import Any, NoReturn

    from fem_seal import __version__, parallel
    from fem_seal.cli import (
        doctor,
        leak,
        mesh,
        new,
        render,
        report,
        run,
        schema,
        study,
        surface,
        sweep,
    )
    from fem_seal.cli.options import NOT_KEPT
    from fem_seal.errors import (
        FemSealError,
        InvalidInput,
        MissingPackage,
        NotConverged,
        explained,
        printable,
    )
    from fem_seal.files import use_writable_cache
    from fem_seal.installed import why_not_imported

# Commands and studies of earlier versions that are scripts of a checkout of the project now.
MOVED = {
    "letter": "python -m demos.letter.reproduce --size 256",
    "percolation": "python -m demos.letter.reproduce --only thresholds",
    "study saddle": "python demos/closing_saddle.py",
    "study closing": "python demos/closing_contact.py",
}
# The commands in the order of the help: what adds their options, their purpose, and an example.
COMMANDS = {
    "new": (
        new.add,
        "write a commented scene for a file of heights, with what the file says filled in",
        "demos/scenes/o-ring-measured.txt --out my-seal.toml",
    ),
    "run": (
        run.add,
        "compute the products of a scene",
        "demos/scenes/first.toml --set flow.rtol=0.02",
    ),
    "leak": (
        leak.add,
        "compute the leak rate of a gap, without a scene file",
        "gap.npz --sides periodic --unit ml/h --limit '1 ml/h'",
    ),
    "sweep": (
        sweep.add,
        "compute a scene over the values of some fields",
        "demos/scenes/first.toml --vary contact.pressure=0.1MPa,0.2MPa",
    ),
    "report": (
        report.add,
        "put a result folder on one HTML page, pictures inside",
        "results/first",
    ),
    "render": (render.add, "draw the pictures of a result folder again", "results/first"),
    "surface": (
        surface.add,
        "show a scene's surface, or a file of heights, before it is pressed",
        "demos/scenes/blasted.toml --out surface.png",
    ),
    "mesh": (mesh.add, "write and draw the mesh of a scene's [shape]", "demos/scenes/flange.toml"),
    "study": (
        study.add,
        "compare methods, or error against time",
        "trade demos/scenes/first.toml (fem-seal study trade --help says more)",
    ),
    "doctor": (doctor.add, "say what works here, and what to install", ""),
    "schema": (
        schema.add,
        "print the JSON schema of scene files, by which editors complete and check them",
        "> scene.schema.json",
    ),
}
INTERRUPTED = 130  # exit status of a program that Ctrl-C ends: 128 and the signal's number
EXIT_STATUS = {
    0: "done",
    FemSealError.exit_status: "a defect of fem-seal, which a traceback shows",
    InvalidInput.exit_status: "refused: bad input, or no package, memory, disk or permission for "
    "it; no result is written",
    NotConverged.exit_status: "not converged (a flow's bounds so far are written; a contact that "
    "failed writes nothing)",
    NOT_KEPT: "with --strict: above the limit or undecided",
    INTERRUPTED: "interrupted",
}
# What an interrupted command has finished, and need not do again.
RESUMED = {"run": "patches of a [seal]", "sweep": "points", "study": "points"}


class _Parser(argparse.ArgumentParser):
    """Parser without abbreviations that prints one line for a wrong command line."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**{"allow_abbrev": False, **settings})
        self._negative_number_matcher = re.compile(r"-\.?\d")  # -1bar is a value, no option
        self.set_defaults(parser=self)  # of a command, and of a study

    def error(self, message: str) -> NoReturn:
        text = printable(" ".join(message.splitlines()))
        self.exit(InvalidInput.exit_status, f"{self.prog}: {text}; see {self.prog} --help\n")


def parser(words: Collection[str] = tuple(COMMANDS)) -> argparse.ArgumentParser:
    """Command line of fem-seal, with the options of the commands that the words name.

    Those of leak are made from the scene's model, which takes half a second to import.
    """
    top = _Parser(
        prog="fem-seal",
        description="How much leaks through a rough contact, and how sure are we?",
        epilog="Start with fem-seal run demos/scenes/first.toml. Exit status: "
        + ". ".join(f"{status}: {meaning}" for status, meaning in EXIT_STATUS.items())
        + ".",
    )
    top.add_argument("--version", action="version", version=f"fem-seal {__version__}")
    subparsers = top.add_subparsers(metavar="COMMAND", required=True, parser_class=_Parser)
    for name, (add_options, purpose, example) in COMMANDS.items():
        command = subparsers.add_parser(
            name,
            help=purpose,
            description=f"{purpose[0].upper()}{purpose[1:]}.",
            epilog=f"Example: fem-seal {name} {example}".rstrip(),
        )
        if name in words:
            add_options(command)
    return top


def main(arguments: list[str] | None = None) -> int:
    """Run one command, of these words or of those of this process, and return the exit status."""
    if isinstance(sys.stdout, TextIOWrapper):
        # Write "?" for characters that its encoding lacks; it would raise an error.
        sys.stdout.reconfigure(errors="replace")
    words = sys.argv[1:] if arguments is None else arguments
    try:
        parallel.abort_together()
        for name, script in MOVED.items():
            if words[: len(name.split())] == name.split():
                raise InvalidInput(f"{name} is a script of a checkout now: {script}")
        with interruptible():
            options, unknown = parser(words).parse_known_args(words)
            if unknown:
                options.parser.error(f"unrecognized arguments: {' '.join(unknown)}")
            options.command_line = words
            if (elsewhere := use_writable_cache()) and parallel.is_root():
                print(f"fem-seal: {printable(elsewhere)}", file=sys.stderr)  # noqa: T201
            status = options.command(options)
            # Flush now: at the exit of Python a closed pipe could not be handled any more.
            sys.stdout.flush()
            return status
    except FemSealError as error:
        first, *more = error.lines
        return parallel.fail(f"fem-seal: {first}", error.exit_status, more)
    except BrokenPipeError:
        # The reader of our output has closed the pipe: discard the rest of the output.
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for stream in (sys.stdout, sys.stderr):
            os.dup2(nowhere, stream.fileno())
        return 0
    except (MemoryError, OSError) as error:
        refusal = explained(error)
        return parallel.fail(f"fem-seal: {refusal}", refusal.exit_status)
    except ImportError as error:
        return parallel.fail(f"fem-seal: {why_not_imported(error)}", MissingPackage.exit_status)
    except KeyboardInterrupt:
        text = "fem-seal: interrupted; nothing half-written is left"
        if words and words[0] in RESUMED:
            text += f"; {RESUMED[words[0]]} that are done stay: the same command goes on from them"
        return parallel.fail(text, INTERRUPTED)
