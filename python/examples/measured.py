"""From the file of an instrument to the contact area of an isolated patch."""

from scipy.ndimage import label

import asperity

scan = asperity.read("data/topography/datx-1.datx")
surface = scan.detrend("plane").fill("harmonic")
print("rms_slope", surface.statistics()["rms_slope"], "1")

contact = asperity.press(surface, pressures=20e6, effective_modulus=100e9, boundary="free")
print("area_fraction", float(contact.area[0]), "1")
print("mean_gap", float(contact.mean_gap[0]), "m")
print("peak_pressure", float(contact.table["peak_pressure"][0]), "Pa")
print("spots", label(contact.contact(0))[1], "1")
