"""Someone attends: a time that was given, or the space bar that is held."""
import os
import select
import sys
import time

from .errors import NotDone, UsageError

HELD_S = 0.7  # keyboards repeat a held key after half a second


def confirm(question):
    """Asks at the terminal; standard output belongs to the answer of the command."""
    if not sys.stdin.isatty():
        raise UsageError(f"{question} There is no terminal to ask at", "--yes")
    print(f"{question} [y/N] ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")


class Timed:
    """Lasts so many seconds."""

    def __init__(self, seconds):
        if not 0 < seconds <= 3600:
            raise UsageError(f"{seconds:g} s is not a time to run: up to an hour is possible")
        self.seconds, self.end = seconds, None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def lasts(self):
        if self.end is None:
            self.end = time.monotonic() + self.seconds
        time.sleep(min(0.1, max(0.0, self.end - time.monotonic())))
        return time.monotonic() < self.end


class Held:
    """Lasts while the space bar is held."""

    def __init__(self):
        if not sys.stdin.isatty():
            raise UsageError("the motor runs only while someone attends", "give a time: --for SECONDS")
        self.last = None

    def __enter__(self):
        import termios
        import tty

        self.saved = termios.tcgetattr(sys.stdin)
        tty.setcbreak(sys.stdin)
        print("hold the space bar: the motor stops when it is released", file=sys.stderr)
        if self._keys(30.0) != b" ":
            self.__exit__()
            raise NotDone("the space bar was not pressed")
        self.last = time.monotonic()
        return self

    def __exit__(self, *_):
        import termios

        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self.saved)

    @staticmethod
    def _keys(seconds):
        """What has been pressed by then, without repetitions."""
        ready, _, _ = select.select([sys.stdin], [], [], seconds)
        return bytes(sorted(set(os.read(sys.stdin.fileno(), 1024)))) if ready else b""

    def lasts(self):
        """Any other key ends it at once."""
        keys = self._keys(0.05)
        if keys == b" ":
            self.last = time.monotonic()
        return keys in (b"", b" ") and time.monotonic() - self.last < HELD_S


def attention(seconds):
    return Held() if seconds is None else Timed(seconds)
