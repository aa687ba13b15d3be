"""``seatrial simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from identify.fit import Fit
    from identify.simulate import Manoeuvre, Measure, Order
    from ingest.errors import SeatrialError

#: What is done where nothing was asked for.
STANDARD = ("zigzag 10/10", "zigzag 20/20", "circle 35", "stopping")


def command(
    model: Annotated[Path, typer.Argument(help="model.json, or the results folder that holds it.")],
    manoeuvre: Annotated[
        list[str] | None,
        typer.Argument(help="zigzag 20/20, circle 35, spiral, stopping [default: the standard ones]."),
    ] = None,
    speed: Annotated[
        float | None, typer.Option(min=0.0, help="Approach speed, m/s [default: as in the logs].")
    ] = None,
    helm_rate: Annotated[float | None, typer.Option(min=0.0, help="Rate of the helm, deg/s.")] = None,
    helm_delay: Annotated[
        float, typer.Option(min=0.0, help="From a zigzag's heading to the helm's first movement, s.")
    ] = 0.0,
    port: Annotated[bool, typer.Option("--port", help="To port (first).")] = False,
    log: Annotated[
        str | None, typer.Option(help="Log whose loading and depth hold, of those that an effect names.")
    ] = None,
    conditions: Annotated[
        bool, typer.Option("--conditions", help="Keep the current and the wind that were found.")
    ] = False,
    length: Annotated[
        float | None,
        typer.Option(min=0.0, help="Of a ship of the same form, m, by Froude's law [default: its own]."),
    ] = None,
    prime: Annotated[
        bool, typer.Option("--prime", help="Print the derivatives without dimension instead.")
    ] = False,
    samples: Annotated[int, typer.Option(min=0, help="Draws for the uncertainty.")] = 100,
    seed: Annotated[int, typer.Option(min=0, help="Same seed, same draws.")] = 0,
    out: Annotated[Path | None, typer.Option(help="Plot of the tracks (.png, .svg or .pdf).")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the measures as JSON, SI units.")] = False,
) -> None:
    """Run an identified model through standard manoeuvres and print the IMO measures.

    A manoeuvre that cannot be sailed is said after those that can; it is an error where it was asked for by name,
    or where none can be sailed.

    Examples
    --------
        seatrial simulate trials/results

        seatrial simulate model.json "zigzag 10/10" "circle 35" --speed 2.5 --out tracks.svg

        seatrial simulate model.json --length 320

        seatrial simulate model.json --prime
    """
    import dataclasses
    import json as text

    from identify.simulate import parse_order
    from identify.simulate.order import checked
    from seatrial.cli.stage_lines import StageLines
    from seatrial.manoeuvre_plot import checked_picture, plot_manoeuvres
    from seatrial.models import load_model
    from seatrial.operating_point import with_operating_point

    if out is not None:
        checked_picture(out)
    fit = with_operating_point(load_model(model), model)
    if length is not None:
        from identify.similar import similar

        fit = similar(fit, length)
    if prime:
        _print_prime(fit, speed, json)
        return
    changes = {
        "speed": speed, "log": log, "conditions": conditions, "samples": samples, "helm_delay": helm_delay,
    }  # fmt: skip
    orders = [
        checked(dataclasses.replace(_with(parse_order(m), port, helm_rate), **changes))  # type: ignore[arg-type]
        for m in manoeuvre or STANDARD
    ]
    with StageLines(quiet=json, lines=False) as progress:
        done, failed = _sail(fit, orders, seed, progress)
    if out is not None and done:
        plot_manoeuvres(done, fit, out)
    if json and done:
        typer.echo(text.dumps([_as_data(m) for m in done], indent=1, ensure_ascii=False))
    elif done:
        _print(done, fit.vessel.length)
    _say_failed(failed, fatal=bool(manoeuvre) or not done)


def _sail(
    fit: Fit, orders: Sequence[Order], seed: int, progress: Callable[[str, str, float], None]
) -> tuple[list[Manoeuvre], list[SeatrialError]]:
    """What could be sailed, and why the rest could not."""
    from identify.simulate import simulate
    from ingest.errors import SeatrialError

    done: list[Manoeuvre] = []
    failed: dict[str, SeatrialError] = {}
    for k, order in enumerate(orders):
        progress("simulate", order.title, k / len(orders))
        try:
            done.append(simulate(fit, order, seed))
        except SeatrialError as error:
            failed.setdefault(str(error), error)
    return done, list(failed.values())


def _say_failed(failed: Sequence[SeatrialError], fatal: bool) -> None:
    from seatrial.cli.reporting import complain

    if failed and fatal:
        first, *others = failed
        for other in others:
            first.add_note(str(other))
        raise first
    for error in failed:
        complain(str(error), "Left out")


def _print(done: Sequence[Manoeuvre], length: float) -> None:
    from seatrial.cli.manoeuvre_tables import manoeuvre_tables
    from seatrial.cli.tables import say

    for m in done:
        say(*manoeuvre_tables(m, length))


def _print_prime(fit: Fit, speed: float | None, as_json: bool) -> None:
    import json as text

    from identify.similar import prime_coefficients, reference_speed

    reference, found = reference_speed(fit, speed), prime_coefficients(fit, speed)
    if as_json:
        rows = [{"dof": c.dof, "name": c.name, "value": c.value, "stderr": c.stderr} for c in found]
        data = {"length": fit.vessel.length, "speed": reference, "coefficients": rows}
        typer.echo(text.dumps(data, indent=1, ensure_ascii=False))
        return
    from seatrial.cli.manoeuvre_tables import prime_tables
    from seatrial.cli.tables import say

    say(*prime_tables(found, fit.vessel.length, reference))


def _with(order: Order, port: bool, helm_rate: float | None) -> Order:
    import dataclasses
    import math

    return dataclasses.replace(
        order,
        side=-1 if port else order.side,
        helm_rate=None if helm_rate is None else math.radians(helm_rate),
    )


def _as_data(m: Manoeuvre) -> dict[str, object]:
    return {
        "manoeuvre": m.order.title,
        "speed": m.speed,
        "measures": [_number(x) for x in m.measures],
        "failed": m.failed,
        "notes": list(m.notes),
    }


def _number(m: Measure) -> dict[str, object]:
    import math

    values = {k: getattr(m, k) for k in ("value", "stderr", "low", "high", "limit")}
    finite = {k: v if v is not None and math.isfinite(v) else None for k, v in values.items()}
    return {"name": m.name, "unit": m.unit, **finite}
