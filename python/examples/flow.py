"""Flow of a thin fluid through the gap, until the contact seals it."""

import asperity

surface = asperity.surface(
    nodes=128, side=100e-6, unit="m", hurst=0.8, k_lower=2, k_upper=16, rms_slope=0.1, seed=1
)
contact = asperity.press(surface, pressures=[100e6, 1000e6, 3000e6], effective_modulus=100e9, flow=True)
for row, area in enumerate(contact.area):
    print("area_fraction", float(area), "1")
    print("mean_gap", float(contact.mean_gap[row]), "m")
    for axis in "xy":
        print(f"conductivity_{axis}", float(contact.table[f"flow_conductivity_{axis}"][row]), "m³")
    for axis in "xy":
        print(f"flow_factor_{axis}", float(contact.table[f"flow_factor_{axis}"][row]), "1")
