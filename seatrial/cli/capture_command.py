"""``seatrial capture``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from seatrial.capture.settings import CaptureSettings
    from seatrial.capture.summary import Summary


def command(
    config: Annotated[
        Path | None, typer.Argument(help="A capture.toml; the options win over it.", metavar="[CONFIG]")
    ] = None,
    port: Annotated[
        list[str] | None,
        typer.Option(help="Serial port, or CAN interface such as can0; may be given several times."),
    ] = None,
    baud: Annotated[list[int] | None, typer.Option(help="Line rate of each port, or of all.")] = None,
    bitrate: Annotated[
        list[int] | None,
        typer.Option(help="Bit rate of the bus behind each CAN adapter, or all [default: 250000]."),
    ] = None,
    protocol: Annotated[
        list[str] | None,
        typer.Option(help="Of each port, or of all: auto, nmea, ubx, mavlink, slcan, imu, raw."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="The MCAP file; {utc} in its name is the time.")] = None,
    rotate_size: Annotated[float | None, typer.Option(help="Begin a new file at this size, MB.")] = None,
    rotate_minutes: Annotated[
        float | None, typer.Option(help="Begin a new file after so many minutes.")
    ] = None,
    duration: Annotated[float | None, typer.Option(help="End after so many seconds.")] = None,
    live: Annotated[
        bool, typer.Option("--live", help="Show what comes in Rerun, on this machine alone.")
    ] = False,
    no_decode: Annotated[bool, typer.Option("--no-decode", help="Keep the bytes alone.")] = False,
    campaign: Annotated[
        Path | None, typer.Option(help="A campaign.toml: identify its model meanwhile, and watch it.")
    ] = None,
    state: Annotated[
        Path | None, typer.Option(help="Keep the identification's state here, and go on from it.")
    ] = None,
    forget_minutes: Annotated[
        float | None,
        typer.Option(help="The identification forgets with this time constant [default: never]."),
    ] = None,
    heartbeat: Annotated[
        bool,
        typer.Option("--heartbeat", help="Tell autopilots (--protocol mavlink) that somebody listens."),
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Say only what goes wrong.")] = False,
) -> None:
    """Record serial ports, every byte with its time of arrival, and decode them.

    Nothing is ever sent to a device, but for an adapter of protocol slcan, which is told to listen, and heartbeats to
    an autopilot where they are asked for.

    Ends with Ctrl-C. What has arrived is in the file after half a second at most, whatever happens then.

    Examples
    --------
        seatrial capture --port /dev/ttyUSB0 --baud 115200 --out trial.mcap

        seatrial capture --port /dev/ttyACM0 --port /dev/ttyUSB1 --baud 115200 --baud 4800 --out trial.mcap --live
    """
    from seatrial.capture.file_series import check_out
    from seatrial.capture.opening import check_port
    from seatrial.capture.settings_file import Wanted, settings_from

    wanted = Wanted(
        config,
        port or [],
        baud or [],
        protocol or [],
        out,
        rotate_size,
        rotate_minutes,
        duration,
        live,
        no_decode,
        campaign,
        state,
        forget_minutes,
        bitrate or [],
        heartbeat,
    )
    settings = settings_from(wanted)
    if settings.campaign is not None:
        from seatrial.online.declared import check_online

        check_online(settings.campaign, settings.state)
    for one in settings.ports:
        check_port(one)
    check_out(settings)
    finish(run(settings, quiet))


def run(settings: CaptureSettings, quiet: bool) -> Summary:
    """Capture until a signal says that it is enough."""
    from seatrial.capture.decoder_process import endings_blocked
    from seatrial.capture.priority import PROMPT, no_long_pauses, run_at_once, set_niceness
    from seatrial.capture.session import Session
    from seatrial.cli.capture_lines import Teller, stop_on_signals

    set_niceness(PROMPT)
    with endings_blocked():
        session = Session(settings, Teller(quiet))
        stop = stop_on_signals()
    run_at_once()
    no_long_pauses()
    if not quiet:
        names = ", ".join(f"{p.name} ({p.device}, {p.baud} bit/s)" for p in settings.ports)
        typer.echo(f"capturing {names} to {session.files.paths[0]}; Ctrl-C ends it", err=True)
    return session.run(stop)


def finish(summary: Summary) -> None:
    """Print the summary; exit status 1 where something is missing."""
    from ingest.errors import DataError

    for line in summary.lines():
        typer.echo(line)
    if summary.faults:
        raise DataError("; ".join(summary.faults) + ".")
