"""Adhesive contact: approach to a pressure, tension, and pull-off."""

import math

import asperity

surface = asperity.surface(
    nodes=64, side=400e-9, unit="m", hurst=0.8, k_lower=1, k_upper=4, rms_slope=0.05, seed=3
)
contact = asperity.press(
    surface,
    pressures=[0.0, 10e6, 20e6, 10e6, 0.0, -5e6],
    effective_modulus=10e9,
    adhesion={"work": 0.05, "range": 2e-9},
)
for row, gap in enumerate(contact.mean_gap):
    print("contact_fraction", float(contact.area[row]), "1")
    print("repulsive_fraction", float(contact.repulsive_area[row]), "1")
    if not math.isnan(gap):
        print("mean_gap", float(gap), "m")
    pull_off = contact.table["pull_off_pressure"][row]
    if not math.isnan(pull_off):
        print("pull_off_pressure", float(pull_off), "Pa")
