"""The tables of ``campaign.toml`` as pydantic models: one class per table, one line per key."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Point = Annotated[list[float], Field(min_length=2, max_length=2)]
Triple = Annotated[list[float], Field(min_length=3, max_length=3)]
Curve = Annotated[list[float], Field(min_length=2)]
Latency = Annotated[float, Field(ge=-60.0, le=60.0)]
Text = Annotated[str, Field(min_length=1)]
Device = Annotated[int, Field(ge=0)]


def optional(description: str) -> Any:
    """Declare a key that may be left out."""
    return Field(default=None, description=description)


class Table(BaseModel):
    """A table that knows all its keys; values are taken as they stand, nothing is converted."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class VesselTable(Table):
    """``[vessel]``: particulars of the hull, SI units; points are (forward, starboard) of the origin."""

    name: Text = Field(description="name of the vessel")
    length: Positive = Field(description="length, m")
    beam: Positive = Field(description="beam, m")
    draught: Positive | None = optional("draught, m")
    mass: Positive | None = optional("mass, kg")
    yaw_inertia: Positive | None = optional("yaw moment of inertia, kg m²")
    centre_of_gravity: Point | None = optional("centre of gravity, m forward and starboard")
    origin: Text = Field(default="origin", description="what the origin point is, free text")
    antenna: Point = Field(default=[0.0, 0.0], description="antenna of the position, m forward and starboard")
    imu: Point = Field(default=[0.0, 0.0], description="inertial sensor, m forward and starboard")
    depth: Positive | None = optional("depth of the water, m")
    magnetic_variation_deg: float = Field(default=0.0, description="of the compass, degrees, east positive")
    propeller: dict[str, float] = Field(
        default={},
        description="for the model mmg: diameter (m), k0, k1, k2 of K_T = k0 + k1 J + k2 J²; optional wake, x_P, C1, "
        "C2_plus, C2_minus",
    )
    rudder: dict[str, float] = Field(
        default={},
        description="for the model mmg: area (m²), height (m); optional lift_slope, eta, epsilon, kappa, gamma_plus, "
        "gamma_minus, l_R, sign",
    )
    added_mass: Triple | None = optional(
        "added masses of surge and sway, kg, and of yaw, kg m², for the model mmg; estimated where not given"
    )


class InputTable(Table):
    """``[inputs.NAME]``: one actuator; NAME is the name of its column in the results."""

    kind: Literal["rudder", "propeller", "thruster", "azimuth", "tunnel"] = Field(
        description="kind of actuator"
    )
    signal: Text | None = optional("TOPIC.FIELD, as `seatrial inspect` says")
    pwm: Curve | None = optional("raw values of the calibration")
    value: Curve | None = optional("physical values: rad, rev/s or -1…1")
    unit: Text | None = optional("unit of the values, instead of a calibration")
    law: Literal["quadratic", "linear"] | None = optional("how thrust follows the value")
    position: Point | None = optional("where it acts, m forward and starboard of the origin")
    drives: Text | None = optional("azimuth: name of the propeller that it turns")
    source: Device | None = optional("device address, system id or instance")


class SensorTable(Table):
    """What every sensor may say."""

    unit: Text | None = optional("unit of the values, or of the angle among them")
    source: Device | None = optional("device address, system id or instance")
    latency: Latency | None = Field(
        default=None,
        description="how late the time stamps are, s (of a velocity: else as its receiver's position)",
    )


class ScalarTable(SensorTable):
    """``[sensors.yaw_rate]``: a scalar with an optional known offset."""

    signal: Text | None = optional("TOPIC.FIELD, as `seatrial inspect` says")
    offset: float = Field(default=0.0, description="logged less true, rad or rad/s")


class HeadingTable(ScalarTable):
    """``[sensors.heading]``: a magnetic heading has the magnetic variation of the vessel added."""

    reference: Literal["true", "magnetic"] | None = optional("to true or magnetic north")


class PositionTable(SensorTable):
    """``[sensors.position]``: latitude and longitude, or north and east."""

    latitude: Text | None = optional("signal of the latitude")
    longitude: Text | None = optional("signal of the longitude")
    north: Text | None = optional("signal of the position north")
    east: Text | None = optional("signal of the position east")


class VelocityTable(SensorTable):
    """``[sensors.velocity]``: over ground, north and east, or forward and starboard."""

    north: Text | None = optional("signal of the velocity north")
    east: Text | None = optional("signal of the velocity east")
    forward: Text | None = optional("signal of the velocity forward")
    starboard: Text | None = optional("signal of the velocity to starboard")


class WindTable(SensorTable):
    """``[sensors.wind]``: speed in m/s and direction that it comes from."""

    speed: Text | None = optional("signal of the wind speed")
    direction: Text | None = optional("signal of where the wind comes from")
    reference: Literal["true", "relative"] | None = optional("to the ground or to the vessel")


class SensorsTable(Table):
    """``[sensors.QUANTITY]``: only where detection is not enough."""

    position: PositionTable | None = None
    heading: HeadingTable | None = None
    yaw_rate: ScalarTable | None = None
    velocity: VelocityTable | None = None
    wind: WindTable | None = None


class CanTable(Table):
    """``[can]``: how to decode frames that are not NMEA 2000."""

    dbc: Text | None = optional("path of a DBC file, relative to the campaign")


class PreprocessTable(Table):
    """``[preprocess]``: how the motion is made of the samples that were found good.

    rts is a fixed-interval smoother; eso the third-order extended state observer of Xie et al. (2020) per channel,
    nomoto_eso the five-state one of Zhu et al. (2022) for the turning (with a Nomoto model) and ekf an extended Kalman
    filter, which know only what came before: worse, and there to compare. It is this motion that
    regressions (ls, ridge, weak_form, lssvm, …) are made of and that predictions are scored against; output_error fits
    the sensors' own samples and only begins from it.
    """

    smoother: Literal["rts", "eso", "ekf", "nomoto_eso"] = Field(
        default="rts", description="smoother or observer; nomoto_eso with a Nomoto model only"
    )
    bandwidth: Positive | None = optional(
        "of an eso in all its channels, rad/s; where not given, of each channel the one of least expected error"
    )


class ModelTable(Table):
    """``[model]``: what to identify, and how."""

    name: Text = Field(default="auto", description="name of the model")
    estimator: Text = Field(default="auto", description="name of the estimator")
    optimiser: Text = Field(default="auto", description="name of the optimiser")
    u0: Positive | None = optional(
        "speed that terms in Δu are about, m/s (abkowitz); where not given, it is found with the coefficients"
    )


class DialectTable(Table):
    """``dialect`` of a log: of delimited text; ``mavlink`` is that of a telemetry log."""

    columns: Text | None = optional("names of the columns, separated by blanks")
    skip: Annotated[int, Field(ge=0)] | None = optional("lines to skip at the top")
    delimiter: Text | None = optional("what separates the columns")
    decimal: Literal[".", ","] | None = optional("decimal mark, where detection must be overruled")
    encoding: Text | None = optional("text encoding")
    mavlink: Text | None = optional("MAVLink dialect")


class LogTable(Table):
    """``[[log]]``: one log of the campaign."""

    path: Text = Field(description="path of the log, relative to the campaign")
    role: Literal["identify", "validate"] | None = optional("what the log is for")
    manoeuvre: (
        Literal["straight", "zigzag", "circle", "spiral", "stopping", "random", "speed", "idle"] | None
    ) = optional("what was done")
    start: float | None = optional("campaign time at which the log starts, s")
    slice: Point | None = optional("from and to, s since the log's first record")
    format: Text | None = optional("format, where detection must be overruled")
    dialect: DialectTable = Field(default=DialectTable(), description="how delimited text is written")
    depth: Positive | None = optional("depth of the water during this log, m")


class CampaignTable(Table):
    """``campaign.toml``: one vessel, one day, several logs."""

    vessel: VesselTable
    inputs: dict[str, InputTable] = Field(default={}, description="the actuators")
    sensors: SensorsTable = SensorsTable()
    can: CanTable = CanTable()
    preprocess: PreprocessTable = PreprocessTable()
    model: ModelTable = ModelTable()
    log: list[LogTable] = Field(default=[], description="the logs, each under [[log]]")
