"""Contact of a rough surface with a coating on a half-space, beside that with the coating alone."""

import asperity

surface = asperity.surface(
    nodes=128, side=100e-6, unit="m", hurst=0.8, k_lower=2, k_upper=16, rms_slope=0.1, seed=1
)
# A coating of 2 µm with four times the shear modulus of its substrate.
coating = {"thickness": 2e-6, "poisson_ratio": 0.3, "modulus_ratio": 4.0}
for layer in [{}, {"layer": coating, "substrate": {"poisson_ratio": 0.3}}]:
    contact = asperity.press(surface, pressures=500e6, effective_modulus=100e9, **layer)
    print("area_fraction", float(contact.area[0]), "1")
    print("mean_gap", float(contact.mean_gap[0]), "m")
    print("peak_pressure", float(contact.table["peak_pressure"][0]), "Pa")
