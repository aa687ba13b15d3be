"""campaign.toml with everything in it, and with the least."""

from __future__ import annotations

from pathlib import Path

from seatrial.campaign import Campaign, load_campaign

FULL = """
[vessel]
name = "Tito Neri 3"
length = 0.97
beam = 0.30
draught = 0.1
mass = 17
centre_of_gravity = [0.02, 0.0]
origin = "midships"
antenna = [0.10, 0.0]
depth = 5.0
magnetic_variation_deg = 90.0
[vessel.propeller]
D = 0.07

[inputs.rudder]
kind = "rudder"
signal = "SERVO_OUTPUT_RAW.servo1_raw"
pwm = [1100, 1500, 1900]
value = [-0.6109, 0.0, 0.6109]
[inputs.n_port]
kind = "propeller"
signal = "/esc.rpm[0]"
unit = "rpm"
position = [-0.45, -0.1]
[inputs.angle]
kind = "azimuth"
signal = "/azimuth.angle"
unit = "deg"
drives = "n_port"
[inputs.bow]
kind = "tunnel"
signal = "/bow.force"
unit = "N"
position = [0.4, 0.0]

[sensors.heading]
signal = "heading_deg"
unit = "deg"
source = 36
offset = 0.01
latency = 0.2
[sensors.position]
latitude = "lat"
longitude = "lon"
[sensors.wind]
speed = "ws"
direction = "wd"
reference = "relative"

[model]
name = "blanke"
estimator = "lssvm"

[[log]]
path = "a.csv"
dialect = { columns = "t x y", skip = 4, delimiter = " ", encoding = "cp1252" }
slice = [10, 130.0]
[[log]]
path = "b.csv"
role = "validate"
manoeuvre = "circle"
depth = 2.5
start = 0
"""


SMALL = """
[vessel]
name = "a"
length = 1.0
beam = 0.3
[inputs.rudder]
kind = "rudder"
[model]
name = "blanke"
[[log]]
path = "a.csv"
"""


#: An actuator that has no place unless it is said.
THRUSTER = 'kind = "thruster"\nsignal = "x"'


def with_logs(folder: Path) -> Path:
    """The folder, with the logs that the campaigns name in it."""
    for name in ("a.csv", "b.csv"):
        (folder / name).write_text("t,x\n0,1\n")
    return folder


def load(folder: Path, text: str) -> Campaign:
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    return load_campaign(folder / "campaign.toml")
