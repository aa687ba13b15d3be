"""The library of effects. To add one: declare it in one of these files and name it here."""

from identify.effect import Effect
from identify.effects.actuators import (
    ACTUATOR_DEADBAND,
    ACTUATOR_DELAY,
    ACTUATOR_LAG,
    ACTUATOR_OFFSET,
    ACTUATOR_RATE_LIMIT,
    INPUT_WIRING,
)
from identify.effects.hull import (
    CROSS_TERMS,
    LINEAR_DAMPING,
    PORT_STARBOARD_ASYMMETRY,
    QUADRATIC_DAMPING,
    ROLL_COUPLING,
    RUDDER_FLOW,
    TURNING_RESISTANCE,
)
from identify.effects.propulsion import (
    PROPELLER_WALK,
    THRUST_AMONG_MANY,
    THRUST_ASYMMETRY,
    THRUST_FADE,
    THRUST_LOSS_WITH_SPEED,
)
from identify.effects.sensors import (
    ANTENNA_OFFSET,
    CLOCK_OFFSET,
    CLOCK_OFFSET_INPUTS,
    GYRO_BIAS,
    HEADING_BIAS,
    MASS_CHANGE,
)
from identify.effects.water_and_air import CURRENT, SHALLOW_WATER, WIND, WIND_UNSEEN

#: Every effect that is searched for.
EFFECTS: tuple[Effect, ...] = (
    CURRENT,
    WIND,
    WIND_UNSEEN,
    ACTUATOR_LAG,
    ACTUATOR_DELAY,
    ACTUATOR_RATE_LIMIT,
    ACTUATOR_DEADBAND,
    ACTUATOR_OFFSET,
    INPUT_WIRING,
    THRUST_ASYMMETRY,
    THRUST_AMONG_MANY,
    PROPELLER_WALK,
    THRUST_FADE,
    THRUST_LOSS_WITH_SPEED,
    QUADRATIC_DAMPING,
    TURNING_RESISTANCE,
    LINEAR_DAMPING,
    CROSS_TERMS,
    RUDDER_FLOW,
    PORT_STARBOARD_ASYMMETRY,
    HEADING_BIAS,
    GYRO_BIAS,
    ANTENNA_OFFSET,
    CLOCK_OFFSET,
    CLOCK_OFFSET_INPUTS,
    MASS_CHANGE,
    ROLL_COUPLING,
    SHALLOW_WATER,
)
