#!/usr/bin/env bash
# Tamaas 2.9.0 presses a model that was registered as not periodic with periodic boundaries.
#
# Guess: after ModelFactory.registerNonPeriodic(model, "dcfft"), contact solvers have free boundaries.
# Seen on 2026-11-29 (a bow of 64 × 64 nodes with waves, pressure 0.01 E*): the pressures are those of the
# periodic model to the last bit, 36.2 % of the map is in contact, and the peak pressure is 0.102 E*. Only
# with solver.setIntegralOperator("dcfft") are they those of a free patch: 28.4 % and 0.297 E*. No warning.
# Scans are not periodic. Their edges are pressed against images of the opposite edges, with a third
# of the peak pressure here, and the script that did it says "non-periodic".
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check tamaas==2.9.0 numpy==2.4.6
seen=$("$folder/python/bin/python" - <<'PYTHON'
import numpy
import tamaas

tamaas.set_log_level(tamaas.LogLevel.error)
x = numpy.arange(64) / 64
waves = numpy.cos(2 * numpy.pi * (5 * x[:, None] + 3 * x[None, :]))
bowl = (x[:, None] - 0.5) ** 2 + (x[None, :] - 0.5) ** 2
heights = 0.002 * waves + 0.02 * bowl


def press(register, operator):
    kind = tamaas.model_type.basic_2d
    model = tamaas.ModelFactory.createModel(kind, [1.0, 1.0], list(heights.shape))
    model.E, model.nu = 1.0, 0.0
    if register:
        tamaas.ModelFactory.registerNonPeriodic(model, "dcfft")
    solver = tamaas.PolonskyKeerRey(model, heights, 1e-10)
    if operator:
        solver.setIntegralOperator("dcfft")
    solver.solve(0.01)
    return numpy.array(model.traction)


periodic, registered, free = press(False, False), press(True, False), press(True, True)
area = [(pressure > 0).mean() for pressure in (periodic, free)]
print("registered: equal", numpy.array_equal(periodic, registered))
print(f"area {area[0]:.3f} {area[1]:.3f} peak {periodic.max():.3f} {free.max():.3f}")
PYTHON
)
echo "$seen"
test "$seen" = "registered: equal True
area 0.362 0.284 peak 0.102 0.297"
