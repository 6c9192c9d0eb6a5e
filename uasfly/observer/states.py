"""What the filter's vectors hold: nominal state, error state, and the packed vectors of the generated functions.

The nominal state is Kalaitzakis & Vitzilaios 2023, section 2.3: p v q F b and one pose p_M q_M a marker, and beyond it
the slow errors of PX4's own velocity and attitude (its filter's output, not a sensor's: they forget themselves within
seconds, and taken for white noise they would make this filter surer than it is).
The error is local (body side) in every rotation: q = q_nominal * exp(d_attitude); the other parts add up.
"""

from __future__ import annotations

from functools import lru_cache

# Nominal state.
POSITION = slice(0, 3)  # m, world
VELOCITY = slice(3, 6)  # m/s, world
QUATERNION = slice(6, 10)  # body to world
FORCE = slice(10, 13)  # m/s^2, world, mass-normalised
BIAS = slice(13, 16)  # m, world: measured minus true position
VELOCITY_WANDER = slice(16, 19)  # m/s, world: measured minus true velocity, without the white noise
ATTITUDE_WANDER = slice(19, 22)  # rad, body: turn from the true to the measured attitude, without the white noise
CORE_NOMINAL = 22
MARKER_NOMINAL = 7  # p_M (m, world), q_M (marker to world)

# Error state.
D_POSITION = slice(0, 3)  # m
D_VELOCITY = slice(3, 6)  # m/s
D_ATTITUDE = slice(6, 9)  # rad, body
D_FORCE = slice(9, 12)  # m/s^2
D_BIAS = slice(12, 15)  # m
D_VELOCITY_WANDER = slice(15, 18)  # m/s
D_ATTITUDE_WANDER = slice(18, 21)  # rad
CORE_ERROR = 21
MARKER_ERROR = 6  # position (m, world), rotation (rad, marker frame)

# Sensors inside an odometry sample, in the order in which they are used; each has three degrees of freedom.
SENSORS = ("attitude", "position", "velocity")
ATTITUDE_SENSOR, POSITION_SENSOR, VELOCITY_SENSOR = range(3)
SENSOR_DOF = 3
ACCELEROMETER_SENSOR = "accelerometer"
MARKER_SENSOR = "marker"
MARKER_DOF = 6


def marker_nominal(index: int) -> slice:
    """Where the pose of marker `index` (0, 1, ...) lies in the nominal state."""
    start = CORE_NOMINAL + MARKER_NOMINAL * index
    return slice(start, start + MARKER_NOMINAL)


def marker_error(index: int) -> slice:
    """Where the error of marker `index` lies in the error state."""
    start = CORE_ERROR + MARKER_ERROR * index
    return slice(start, start + MARKER_ERROR)


class Layout:
    """The packed filter state of `markers` markers: all that one step of the filter hands to the next.

    Attributes:
        markers: how many.
        nominal_size: length of the nominal state. errors: length n of the error state.
        nominal: the nominal state. covariance: of the error, symmetric, n x n.
        matched: matched measurement covariances, three 3 x 3, in the order of SENSORS.
        mean: mean innovations, three of 3. size: length of the whole.
    """

    __slots__ = ("covariance", "errors", "markers", "matched", "mean", "nominal", "nominal_size", "size")

    def __init__(self, markers: int) -> None:
        self.markers = markers
        self.nominal_size = CORE_NOMINAL + MARKER_NOMINAL * markers
        self.errors = CORE_ERROR + MARKER_ERROR * markers
        self.nominal = slice(0, self.nominal_size)
        self.covariance = slice(self.nominal_size, self.nominal_size + self.errors * self.errors)
        self.matched = slice(self.covariance.stop, self.covariance.stop + 9 * len(SENSORS))
        self.mean = slice(self.matched.stop, self.matched.stop + 3 * len(SENSORS))
        self.size: int = self.mean.stop


@lru_cache(maxsize=16)
def layout(markers: int) -> Layout:
    """The layout for so many markers."""
    return Layout(markers)


# Input of a prediction.
IN_DT = 0  # s
IN_THRUST = 1  # m/s^2, mean over dt, along the body z axis
IN_RATE = slice(2, 5)  # rad/s, body, mean over dt
IN_AIRBORNE = 5  # 1 in the air, 0 on the ground
IN_BIAS_DENSITY = 6  # m^2/s
IN_ATTITUDE_DENSITY = 7  # rad^2/s^2/Hz
IN_FORCE_DENSITY = slice(8, 11)  # m^2/s^4/s, world axes
IN_ACCELERATION_DENSITY = slice(11, 14)  # m^2/s^4/Hz, world axes
IN_DRAG = slice(14, 17)  # 1/s
IN_WANDER_RATE = 17  # 1/s, at which the wanders forget themselves
IN_VELOCITY_WANDER_DENSITY = 18  # m^2/s^2/s
IN_ATTITUDE_WANDER_DENSITY = 19  # rad^2/s
PREDICTION_INPUTS = 20
IN_MOTION = slice(0, 14)  # all but the drag

# Further input of an odometry step.
IN_QUATERNION = slice(20, 24)  # measured, body to world
IN_POSITION = slice(24, 27)  # m, measured
IN_VELOCITY = slice(27, 30)  # m/s, measured, world
IN_USE = slice(30, 33)  # 1 = the sensor has something to say, in the order of SENSORS
IN_CORRELATION = slice(33, 36)  # factor on the variance for the correlation in time, in the order of SENSORS
IN_VARIANCE = slice(36, 39)  # configured variances (rad^2, m^2, m^2/s^2)
IN_INTERVAL = 39  # s since the sample before
IN_MATCHING_WEIGHT = 40  # 0..1, weight of this innovation in the matched covariance
IN_MEAN_WEIGHT = 41  # 0..1, weight of this innovation in the mean innovation
IN_BIAS_FREE = 42  # 1 while the GNSS bias may change: a marker makes it observable, or GNSS runs away; else 0
IN_WANDER_FREE = 43  # 1 while a marker makes the velocity's wander observable, else 0
IN_AGREES = 44  # 1 while measured position and velocity tell the same motion, else 0
ODOMETRY_INPUTS = 45
IN_MEASURED = slice(20, 36)  # quaternion, position, velocity, use, correlation
IN_WEIGHTS = slice(39, 45)  # interval, matching weight, mean weight, bias free, wander free, agrees

# Further input of an accelerometer step.
IN_SPECIFIC_FORCE = slice(45, 48)  # m/s^2, body, measured, without the bias
IN_ACCELEROMETER_VARIANCE = slice(48, 51)  # m^2/s^4, each axis
ACCELEROMETER_INPUTS = 51
IN_ACCELEROMETER = slice(45, 51)

# Input of a sighting step.
IN_SIGHTING = slice(0, 7)  # pose of the marker relative to the body, as seen
IN_SIGHTING_COVARIANCE = slice(7, 43)  # (6, 6), as the detector states it
IN_SCALE = 43  # factor on that, as matched
IN_SIGHTING_WEIGHT = 44  # 0..1, weight of this innovation in the matching
SIGHTING_INPUTS = 45

# Output of a sighting step beside the new packed state.
OUT_SIGHTING_NIS, OUT_SIGHTING_ACCEPTED, OUT_SIGHTING_SCALE = range(3)
OUT_SIGHTING_INNOVATION = slice(3, 9)  # m, rad
SIGHTING_OUTPUTS = 9

# Output of an accelerometer step beside the new packed state.
OUT_FORCE_NIS, OUT_FORCE_ACCEPTED, OUT_FORCE_VARIANCE = range(3)  # the last: what the sample says of the variance
ACCELEROMETER_OUTPUTS = 3

# Output of an odometry step beside the new packed state.
OUT_NIS = slice(0, 3)  # normalised innovation squared
OUT_ACCEPTED = slice(3, 6)  # 1 = used
OUT_RESIDUAL = slice(6, 15)  # innovations (rad, m, m/s)
ODOMETRY_OUTPUTS = 15
