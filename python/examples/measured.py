"""From the file of an instrument to the contact area of an isolated patch. A path can be given."""

import sys
from pathlib import Path

from scipy.ndimage import label

import asperity

FILE = Path(__file__).resolve().parents[2] / "data/topography/datx-1.datx"

scan = asperity.read(sys.argv[1] if len(sys.argv) > 1 else FILE)
surface = scan.detrend("plane").fill("harmonic")
print("rms_slope", surface.statistics()["rms_slope"], "1")

contact = asperity.press(surface, pressures=20e6, effective_modulus=100e9, boundary="free")
print("area_fraction", float(contact.area[0]), "1")
print("mean_gap", float(contact.mean_gap[0]), "m")
print("peak_pressure", float(contact.table["peak_pressure"][0]), "Pa")
print("spots", label(contact.contact(0))[1], "1")
