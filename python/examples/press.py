"""Presses a random rough surface: contact area, mean gap and peak pressure under three loads."""

import asperity

surface = asperity.surface(
    nodes=128, side=100e-6, unit="m", hurst=0.8, k_lower=2, k_upper=16, rms_slope=0.1, seed=1
)
contact = asperity.press(surface, pressures=[100e6, 500e6, 1000e6], effective_modulus=100e9)
for row, area in enumerate(contact.area):
    print("mean_pressure", float(contact.mean_pressure[row]), "Pa")
    print("load", float(contact.load[row]), "E* × rms slope")
    print("area_fraction", float(area), "1")
    print("mean_gap", float(contact.mean_gap[row]), "m")
    print("peak_pressure", float(contact.table["peak_pressure"][row]), "Pa")
    print("elastic_energy", float(contact.table["energy"][row]), "J/m²")
