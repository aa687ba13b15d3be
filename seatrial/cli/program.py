"""The command line from its words to its exit status."""

from __future__ import annotations

import gc
from collections.abc import Sequence

from seatrial.cli.app import make_app
from seatrial.cli.reporting import Reporting, prepare_streams
from seatrial.compiled_code import forget_stale_code
from seatrial.stages import foreign_stage

#: Objects that are made before the youngest are looked through for rings, and how often those that stay are: few rings
#: are made here, and looking through all that the libraries hold takes a twentieth of the time.
RARELY = (5_000, 10, 10)


def run_program(words: Sequence[str]) -> None:
    """Run a command; always ends in ``SystemExit`` with the exit status."""
    gc.set_threshold(*RARELY)
    prepare_streams()
    with Reporting(debug="--debug" in words):
        culprit = foreign_stage()
        if culprit:
            raise SystemExit(f"Error: {culprit}")
        forget_stale_code()
        make_app()([word for word in words if word != "--debug"], prog_name="seatrial")
