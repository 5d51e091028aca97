"""Tests short programs of users against closed forms."""

import numpy as np
import pytest

import asperity


def test_hertz_has_his_closed_form():
    radius, contact_radius = 2.0, 0.2
    ball = asperity.surface(method="paraboloid", nodes=256, radius=radius)
    force = 4 / 3 * contact_radius**3 / radius
    contact = asperity.press(ball, pressures=force, boundary="free")
    peak = 2 / np.pi * contact_radius / radius
    area = asperity.corrected_area(contact.contact(0), boundary="free").corrected
    assert abs(area / (np.pi * contact_radius**2) - 1) < 0.002
    assert abs(contact.pressure(0).max() / peak - 1) < 0.001
    approach = contact_radius**2 / radius
    assert abs(contact.displacement(0).max() / approach - 1) < 0.001
    distance = np.hypot(*np.meshgrid(*[(np.arange(256) - np.argmax(ball.heights) // 256) / 256] * 2))
    hertz = peak * np.sqrt(np.maximum(1 - (distance / contact_radius) ** 2, 0))
    assert abs(contact.pressure(0) - hertz).max() < 0.05 * peak


def test_the_mean_area_of_twenty_surfaces_is_above_persson_and_near_bush():
    loads = [0.01, 0.02, 0.05]
    areas = []
    for number in range(20):
        rough = asperity.surface(nodes=128, hurst=0.8, k_lower=4, k_upper=16, seed=1, realization=number)
        contact = asperity.press(rough, loads=loads, fields=False)
        areas.append([asperity.corrected_area(state.contact()).corrected for state in contact])
    areas = np.array(areas)
    mean, error = areas.mean(axis=0), areas.std(axis=0, ddof=1) / np.sqrt(20)
    nayak = rough.statistics()["nayak"]
    assert (error < 0.02 * mean).all()
    assert (mean - 3 * error > asperity.persson.area(loads)).all()
    assert (abs(mean / asperity.models.bush_gibson_thomas(nayak).at_load(loads).area - 1) < 0.2).all()


def test_a_measured_x3p_is_pressed_with_nothing_around_it(repository):
    scan = asperity.read(repository / "data/topography/testing.x3p").detrend()
    contact = asperity.press(scan, loads=[0.01, 0.1], boundary="free", effective_modulus=1e9)
    assert contact.converged and contact.area[0] < contact.area[1]
    # The highest point touches first.
    top = np.unravel_index(np.argmax(scan.heights), scan.nodes)
    assert contact.contact(0)[top]


def test_tamaas_has_the_same_contacts_node_by_node():
    import tamaas

    tamaas.initialize(1)
    tamaas.set_log_level(tamaas.LogLevel.error)
    rough = asperity.surface(nodes=128, hurst=0.8, k_lower=2, k_upper=24, rms_slope=0.05, seed=3)
    pressures = [2e-4, 2e-3, 2e-2]
    ours = asperity.press(rough, pressures=pressures, tolerance=1e-8)
    model = tamaas.Model(tamaas.model_type.basic_2d, [1.0, 1.0], [128, 128])
    model.E, model.nu = 1.0, 0.0
    for number, pressure in enumerate(pressures):
        solver = tamaas.PolonskyKeerRey(model, rough.heights.filled(), 1e-12)
        solver.max_iter = 20_000
        solver.solve(pressure)
        theirs = np.array(model.traction).reshape(128, 128)
        assert ((theirs > 0) == ours.contact(number)).all()
        assert abs(theirs - ours.pressure(number)).max() < 1e-5 * theirs.max()


def test_contactmechanics_has_the_same_contacts_of_bonded_layers_node_by_node():
    mechanics = pytest.importorskip("ContactMechanics")
    from SurfaceTopography import Topography

    rough = asperity.surface(nodes=96, hurst=0.8, k_lower=2, k_upper=16, rms_slope=0.05, seed=3)
    for thickness, poisson_ratio in [(0.2, 0.0), (0.05, 0.3), (0.02, 0.45)]:
        layer = {"thickness": thickness, "poisson_ratio": poisson_ratio}
        ours = asperity.press(rough, pressures=[1e-3, 1e-2], layer=layer, tolerance=1e-9)
        assert ours.converged
        substrate = mechanics.PeriodicFFTElasticHalfSpace(
            rough.nodes, 1 - poisson_ratio**2, rough.size, thickness=thickness, poisson=poisson_ratio
        )
        surface = Topography(rough.heights.filled(), rough.size, periodic=True)
        system = mechanics.make_system(substrate=substrate, surface=surface)
        for number, pressure in enumerate([1e-3, 1e-2]):
            solved = system.minimize_proxy(external_force=pressure, pentol=1e-13, maxiter=5000)
            assert solved.success
            theirs = np.asarray(system.force) * system.force.size
            assert ((theirs > 0) == ours.contact(number)).all()
            assert abs(theirs - ours.pressure(number)).max() < 1e-6 * theirs.max()


def test_a_law_is_found_again_that_made_the_areas():
    law = asperity.EvolutionLaw(kappa=2.4, beta=0.9, mu=0.7)
    loads = np.linspace(0.01, 0.3, 30)
    found = asperity.EvolutionLaw.fit(loads, [law.area(loads)] * 3, kappa="free")
    assert np.allclose([found.kappa, found.beta, found.mu], [2.4, 0.9, 0.7], rtol=1e-5)
