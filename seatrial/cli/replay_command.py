"""``seatrial replay``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

#: A program that opens a port first throws away what is in it; so long it is left alone, s.
SETTLE_S = 0.3

if TYPE_CHECKING:
    import threading

    from seatrial.capture.playback import Line


def command(
    file: Annotated[Path, typer.Argument(help="A capture.")],
    port: Annotated[
        list[Path] | None, typer.Option(help="Path of the port to make; one per channel.")
    ] = None,
    topic: Annotated[str | None, typer.Option(help="Play this raw channel alone, such as /raw/gps.")] = None,
    speed: Annotated[float, typer.Option(help="How many times faster than it was recorded.")] = 1.0,
    no_wait: Annotated[bool, typer.Option("--no-wait", help="Begin before somebody reads.")] = False,
    campaign: Annotated[
        Path | None, typer.Option(help="No port: identify this campaign's model, as fast as it goes.")
    ] = None,
    state: Annotated[Path | None, typer.Option(help="With --campaign: keep the state here.")] = None,
    forget_minutes: Annotated[
        float | None, typer.Option(help="With --campaign: time constant of forgetting [default: never].")
    ] = None,
    model: Annotated[Path | None, typer.Option(help="With --campaign: write the model here.")] = None,
) -> None:
    """Play recorded ports back through pseudo terminals, at their own pace, to try everything without a boat.

    Begins when the ports have been opened. What nobody reads in time is lost, as on a real line, and counted. With
    --campaign, any log is identified as if it came in now.

    Example:

        seatrial replay trial.mcap --port ./gps

        seatrial capture --port ./gps --baud 115200 --out again.mcap

        seatrial replay trial.mcap --campaign campaign.toml
    """
    from ingest.errors import UsageError
    from seatrial.cli.capture_lines import stop_on_signals

    if campaign is not None:
        from seatrial.cli.online_lines import identify_recorded

        identify_recorded(file, campaign, state, forget_minutes, model)
        return
    if state is not None or forget_minutes is not None or model is not None:
        raise UsageError("--state, --forget-minutes and --model belong to --campaign, which is not given.")
    if not speed > 0:
        raise UsageError(f"--speed: expected a positive number, found {speed:g}.")
    try:
        from seatrial.capture.playback import Line, play, recorded_ports
        from seatrial.capture.priority import run_at_once
    except ImportError as error:
        raise UsageError("replay: this system has no pseudo terminals.") from error
    ports = recorded_ports(file, topic)
    if port and len(port) != len(ports):
        names = ", ".join(p.topic for p in ports)
        raise UsageError(
            f"--port: expected one for each of {names}, found {len(port)}; --topic plays one alone."
        )
    stop = stop_on_signals()
    lines: list[Line] = []
    try:
        lines += [Line(port[i] if port else None) for i in range(len(ports))]
        for recorded, line in zip(ports, lines, strict=True):
            baud = f" --baud {recorded.baud}" if recorded.baud else ""
            typer.echo(f"{recorded.topic} ({len(recorded.data):,} bytes): --port {line.name}{baud}")
        if no_wait or wait_for_readers(lines, stop):
            # a device is not held up by what else the machine does: what comes late looks like another motion
            run_at_once()
            play(ports, lines, stop, speed)
    finally:
        for line in lines:
            line.close()
    for recorded, line in zip(ports, lines, strict=True):
        lost = f", {line.refused:,} that nobody read in time" if line.refused else ""
        typer.echo(f"{recorded.topic}: {line.sent:,} bytes sent{lost}")


def wait_for_readers(lines: list[Line], stop: threading.Event) -> bool:
    """Wait until every port has been opened; whether that came true."""
    while not all(line.has_reader() for line in lines):
        if stop.wait(0.05):
            return False
    return not stop.wait(SETTLE_S)
