"""The command line: ``seatrial`` or ``python -m seatrial``."""

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; always ends in ``SystemExit`` with the exit status.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; default: those of the process, which ends with this.
    """
    try:
        from seatrial.cli.program import run_program  # here, where Ctrl-C is heard while all else is loaded

        run_program(list(sys.argv[1:] if arguments is None else arguments))
    except KeyboardInterrupt:
        sys.stderr.write("Interrupted: nothing half-written is left.\n")
        raise SystemExit(130) from None
    finally:
        end_as_said(last=arguments is None)


def end_as_said(last: bool) -> None:
    """Let nothing but the exit status say how the process ended.

    Python ends as if by a signal where a Ctrl-C left the last text that was executed as code, which many libraries
    make their classes of, though it was handled; and where one comes while it shuts down (``last``).
    """
    exec("")
    if last:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


if __name__ == "__main__":
    main()
