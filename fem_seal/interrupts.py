"""Ctrl-C (SIGINT) and SIGTERM end a command by a KeyboardInterrupt and no other exception."""

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
# Seconds until a signal that arrived during an import, or was swallowed, is raised again.
_PAUSE = 0.05
_IMPORTING = "<frozen importlib._bootstrap>"
_DIE_WITH_PARENT = 1  # PR_SET_PDEATHSIG of prctl(2)


@contextmanager
def interruptible() -> Iterator[None]:
    """Let SIGINT and SIGTERM end the body by a KeyboardInterrupt, in place of any other exception.

    A signal that arrives during an import waits until the import ends: compiled modules would turn
    the KeyboardInterrupt into an ImportError or a SystemError, and stay half imported. If compiled
    code swallows the KeyboardInterrupt, as in a callback, it is raised again.
    """
    raised: list[int] = []
    timers: list[threading.Timer] = []

    def again(number: int) -> None:
        """Raise a signal once more after a pause."""
        main = threading.main_thread().ident
        timers.append(threading.Timer(_PAUSE, signal.pthread_kill, (main, number)))
        timers[-1].start()

    def interrupt(number: int, frame: FrameType | None) -> None:
        """Handle a signal: raise KeyboardInterrupt, after an import if one runs."""
        if _importing(frame):
            again(number)
            return
        raised.append(number)
        raise KeyboardInterrupt

    def repeated_or_shown(kind: type[BaseException], hook: Callable[..., Any], *error: Any) -> None:
        """Repeat an interrupt that nobody handles; let the hook print any other error."""
        if issubclass(kind, KeyboardInterrupt) and raised:
            again(raised[-1])
        else:
            hook(*error)

    hooks = sys.unraisablehook, sys.excepthook
    # A shell's background jobs ignore SIGINT; only the main thread receives signals.
    here = threading.current_thread() is threading.main_thread()
    taken = [number for number in _SIGNALS if here and signal.getsignal(number) != signal.SIG_IGN]
    before = {number: signal.signal(number, interrupt) for number in taken}
    # Python calls the first for an error that it cannot raise, as in a destructor, the second for
    # one that compiled code prints and swallows.
    sys.unraisablehook = lambda error: repeated_or_shown(error.exc_type, hooks[0], error)
    sys.excepthook = lambda kind, *error: repeated_or_shown(kind, hooks[1], kind, *error)
    done = False
    try:
        yield
        done = True
    finally:
        for timer in timers:
            timer.cancel()
        sys.unraisablehook, sys.excepthook = hooks
        for number, handler in before.items():
            signal.signal(number, handler)
        if raised and not done:
            raise KeyboardInterrupt


def _importing(frame: FrameType | None) -> bool:
    """Whether a frame, or one of its callers, executes an import statement."""
    while frame is not None:
        if frame.f_code.co_filename == _IMPORTING:
            return True
        frame = frame.f_back
    return False


@contextmanager
def ended_silently() -> Iterator[None]:
    """Let Ctrl-C end the process at once, without a traceback, before any work has begun."""
    here = threading.current_thread() is threading.main_thread()
    if not here or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def die_with_parent() -> None:
    """Let the system end this process by SIGKILL once the process that started it has ended."""
    import ctypes

    prctl = getattr(ctypes.CDLL(None), "prctl", None)
    if prctl is not None:  # only Linux has it
        prctl(_DIE_WITH_PARENT, signal.SIGKILL)
