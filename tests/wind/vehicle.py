"""Coefficients of a 1.8 kg hexacopter, for the tests of this room."""

from __future__ import annotations

from uasfly.wind.accelerometer_model import AccelerometerModel

GRAVITY = 9.80665
MODEL = AccelerometerModel(in_plane_1_s=0.24, axial_1_s=0.0, quadratic_1_m=0.0155, disc_area_per_mass_m2_kg=0.151)
