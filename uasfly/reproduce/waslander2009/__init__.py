"""Waslander & Wang 2009: wind from accelerometers, and PID, PID with double derivative and with wind compensation.

What the paper's text states and what had to be assumed:

- Vehicle: the figures at hand do not describe one. The shipped f550 flies, plant and airframe as they are, at 50 Hz.
- Wind: the paper's boundary layer (z0 = 0.05 m) and sum of sines; how strong is not stated. 15 knots at 20 ft, the
  light turbulence of MIL-F-8785C: 5.9 m/s at 2 m, towards 30 deg, so that both axes meet mean and gusts. The plain
  PID strays a quarter as far in it as the paper's: there the wind was stronger, the gains softer, or both. What can be
  compared is the order of the three and what each step gains.
- Sensors: the upper end of each range that the paper gives. The accelerometer's "0.3 g" cannot be the standard
  deviation of white noise at 50 Hz if the wind is to be seen (a sample of 2.9 m/s^2 is 8 m/s of wind): read as the
  largest error, three standard deviations, it is 0.1 g. The other reading is flown beside it. Gyro and magnetometer
  are white at 50 Hz; the sonar reaches 1.5 m and does not help at 2 m.
- What the controllers fly by: wind and acceleration from the accelerometer (and the rest of the paper's sensors)
  through the Kalman filter, position and velocity from the vehicle's own estimate. With position and velocity from
  5 cm of white GPS noise at 10 Hz as well, that noise moves the vehicle more than the wind does; it is flown beside.
- Attitude: gyro from the ground on, heading pulled to the magnetometer. The ground is level to 0.3 deg.
- Drag and flapping coefficients are those of the plant file at hover, as a bench test would give them; the thrust in
  wind is the paper's (constant power), which is not the plant's (constant speed).
- Compensation: at 0.1 g of noise the wind is known to 0.3 m/s on each axis, about half of the gusts themselves. Level,
  what the compensation gains over the double derivative is lost to that noise; upright, where there is no double
  derivative, it halves what is left.
- Gains: by one rule for all three controllers, see `uasfly.control.position_gains`. The paper gives none.
"""

from uasfly.reproduce.waslander2009.experiments import reproduce

__all__ = ["reproduce"]
