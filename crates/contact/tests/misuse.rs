//! Input that is invalid or means something else than its user thinks: typed errors, never panics.

use asperity_contact::*;

type Failure = Box<dyn std::error::Error>;

const ODD: [f64; 9] =
    [0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 5e-324, 1e-200, 1e200, f64::MAX];

fn grid() -> Grid {
    Grid::square(16, Length::micrometres(100.0)).unwrap()
}

fn elastic() -> Material {
    Material::elastic(Pressure::gigapascals(100.0)).unwrap()
}

fn random(rms_slope: f64) -> RandomSurface {
    RandomSurface::with_rms_slope(Spectrum::new(0.8, 1..=4).unwrap(), rms_slope)
}

fn rough() -> Surface {
    random(0.1).draw(grid()).unwrap()
}

#[test]
fn slopes_and_sides_other_than_one_press_the_same_contact() {
    // Raw heights of a slope of 0.02 or on a side of 1e-4 m were once full contact.
    let area = |rms_slope: f64, side: f64| -> Result<f64, Failure> {
        let surface = random(rms_slope).draw(Grid::square(16, Length::metres(side))?)?;
        let contact = Contact::periodic(&surface, Material::reduced())?;
        Ok(contact.press(ReducedPressure::new(0.05))?.area_fraction())
    };
    let expected = area(1.0, 1.0).unwrap();
    assert!(expected < 0.3);
    for (slope, side) in [(0.02, 1.0), (1.0, 1e-4), (0.02, 1e-4)] {
        assert_eq!(area(slope, side).unwrap(), expected, "{slope} {side}");
    }
}

#[test]
fn wavenumbers_that_do_not_ascend_are_errors() {
    let wrong = |k_lower: u32, k_upper: u32| Spectrum::new(0.8, k_lower..=k_upper).unwrap_err();
    for (k_lower, k_upper) in [(64, 8), (0, 8), (0, 0)] {
        assert!(matches!(wrong(k_lower, k_upper), SpectrumError::Wavenumbers { .. }));
    }
    let spectrum = Spectrum::new(0.8, 2..=8).unwrap();
    assert!(spectrum.rolloff(1).is_err() && spectrum.rolloff(9).is_err());
    for hurst in [0.0, -0.5, 1.01, f64::NAN, f64::INFINITY] {
        assert!(matches!(Spectrum::new(hurst, 2..=8), Err(SpectrumError::Hurst(_))), "{hurst}");
    }
    for odd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(spectrum.anisotropy(odd, 0.0).is_err());
    }
    assert!(spectrum.anisotropy(2.0, f64::NAN).is_err());
}

#[test]
fn meshes_that_are_too_coarse_and_cells_without_waves_are_errors() {
    let spectrum = Spectrum::new(0.8, 1..=9).unwrap();
    let error = RandomSurface::with_rms_slope(spectrum, 0.1).draw(grid()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "16 nodes along a side cannot resolve 9 waves; use at least 18 nodes, or a lower k_upper"
    );
    let all = Spectrum::new(0.8, 1..=u32::MAX).unwrap();
    assert!(RandomSurface::with_rms_slope(all, 0.1).draw(grid()).is_err());
    for slope in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        assert!(matches!(random(slope).draw(grid()), Err(DrawError::Roughness(_))), "{slope}");
    }
    let sides = [Length::micrometres(0.1), Length::micrometres(10.0)];
    let strip = Grid::new([4, 4], sides).unwrap();
    let grain = Spectrum::new(0.8, 2..=2).unwrap().anisotropy(1e6, 89.0).unwrap();
    let error = RandomSurface::with_rms_slope(grain, 0.1).draw(strip);
    assert_eq!(error, Err(DrawError::NoWaves));
}

#[test]
fn loads_that_are_not_positive_and_finite_are_errors() {
    let contact = Contact::periodic(&rough(), elastic()).unwrap();
    for odd in [0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let errors = [
            contact.press(Pressure::pascals(odd)).unwrap_err(),
            contact.press(Force::newtons(odd)).unwrap_err(),
            contact.press(ReducedPressure::new(odd)).unwrap_err(),
        ];
        assert!(errors.iter().all(|error| matches!(error, PressError::Load(_))), "{odd}");
        let gap = contact.press_to_gap(Length::metres(odd));
        assert!(matches!(gap, Err(PressError::MeanGap(_))), "{odd}");
    }
    let far = contact.press_to_gap(Length::metres(1.0));
    assert!(matches!(far, Err(PressError::NoContact)));
}

#[test]
fn lists_of_a_wrong_length_and_heights_that_are_not_finite_are_errors() {
    let unit = Length::micrometres(1.0);
    for count in [0, 255, 257] {
        let error = Surface::from_heights(grid(), vec![0.0; count], unit).unwrap_err();
        assert_eq!(
            error.to_string(),
            format!("{count} heights for 256 nodes; give one height for each node of the grid")
        );
        assert!(MeasuredMap::new(grid(), vec![0.0; count], unit).is_err());
    }
    for odd in [f64::NAN, f64::INFINITY, 1e200] {
        let mut heights = vec![0.0; 256];
        heights[17] = odd;
        let error = Surface::from_heights(grid(), heights, unit).unwrap_err();
        assert!(matches!(error, SurfaceError::Height { node: [1, 1], .. }), "{odd}");
    }
    for odd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = Surface::from_heights(grid(), vec![0.0; 256], Length::metres(odd));
        assert!(matches!(error, Err(SurfaceError::Unit { .. })));
    }
}

#[test]
fn surfaces_that_cannot_be_pressed_say_why() {
    let heights: Vec<f64> = rough().heights().map(Length::in_micrometres).collect();
    let open = Surface::from_heights(grid(), heights.clone(), Length::micrometres(1.0)).unwrap();
    let error = Contact::periodic(&open, elastic()).unwrap_err();
    assert_eq!(error, ContactError::NotPeriodic);
    assert!(Contact::periodic(&open.clone().assume_periodic(), elastic()).is_ok());
    assert!(Contact::isolated(&open, elastic()).is_ok());

    // Micrometres that are taken for metres.
    let steep = Surface::from_heights(grid(), heights, Length::metres(1.0)).unwrap();
    let error = Contact::isolated(&steep, elastic()).unwrap_err();
    assert!(matches!(error, ContactError::Steep { rms_slope, .. } if rms_slope > 1e4));

    let flat = Surface::from_heights(grid(), vec![3.0; 256], Length::nanometres(1.0)).unwrap();
    assert_eq!(Contact::isolated(&flat, elastic()).unwrap_err(), ContactError::Flat);
    let flat = flat.assume_periodic();
    assert_eq!(Contact::periodic(&flat, elastic()).unwrap_err(), ContactError::Flat);

    let layer = Layer::bonded(Length::micrometres(1.0), 0.3).unwrap();
    let error = Contact::isolated(&rough(), elastic().layer(layer)).unwrap_err();
    assert_eq!(error, ContactError::LayerOfPatch);
}

#[test]
fn materials_that_do_not_exist_are_errors() {
    for odd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let modulus = Pressure::pascals(odd);
        assert!(matches!(Material::elastic(modulus), Err(MaterialError::Modulus(_))));
        assert!(matches!(Material::from_young(modulus, 0.3), Err(MaterialError::Modulus(_))));
        assert!(matches!(elastic().hardness(modulus), Err(MaterialError::Hardness(_))));
        let thickness = Layer::bonded(Length::metres(odd), 0.3);
        assert!(matches!(thickness, Err(MaterialError::Thickness(_))));
        let ratio = Layer::on_half_space(Length::metres(1e-6), 0.3, odd, 0.3);
        assert!(matches!(ratio, Err(MaterialError::ModulusRatio(_))));
    }
    for odd in [-1.0, 0.51, f64::NAN] {
        let modulus = Pressure::gigapascals(1.0);
        assert!(matches!(Material::from_young(modulus, odd), Err(MaterialError::PoissonRatio(_))));
        let layer = Layer::frictionless(Length::metres(1e-6), odd);
        assert!(matches!(layer, Err(MaterialError::PoissonRatio(_))));
    }
    let soft = elastic().hardness(Pressure::megapascals(100.0)).unwrap();
    let error = Contact::periodic(&rough(), soft).unwrap().press(Pressure::megapascals(100.0));
    assert!(matches!(error, Err(PressError::AboveHardness { .. })));
}

#[test]
fn a_load_that_does_not_converge_is_an_error() {
    let contact = Contact::periodic(&rough(), elastic()).unwrap();
    for odd in [0.0, -1.0, f64::NAN, 0.1] {
        assert!(Contact::periodic(&rough(), elastic()).unwrap().tolerance(odd).is_err());
    }
    let hasty = contact.max_pairs(1).tolerance(1e-10).unwrap();
    let error = hasty.press(Pressure::megapascals(500.0)).unwrap_err();
    assert!(matches!(error, PressError::NotConverged { .. }), "{error}");
}

#[test]
fn attractions_that_the_mesh_cannot_resolve_are_errors() {
    let joules = EnergyPerArea::joules_per_square_metre;
    for odd in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(Adhesion::new(joules(odd), Length::nanometres(1.0)).is_err());
    }
    for odd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(Adhesion::new(joules(0.05), Length::metres(odd)).is_err());
    }
    let short = Adhesion::new(joules(0.05), Length::nanometres(1.0)).unwrap();
    let error = AdhesiveContact::periodic(&rough(), elastic(), short).unwrap_err();
    assert!(matches!(error, ContactError::TooCoarse { .. }), "{error}");
    let long = Adhesion::new(joules(0.05), Length::micrometres(1.0)).unwrap();
    let hard = elastic().hardness(Pressure::gigapascals(3.0)).unwrap();
    let error = AdhesiveContact::periodic(&rough(), hard, long).unwrap_err();
    assert_eq!(error, ContactError::AdhesionOfMaterial);
    let mut contact = AdhesiveContact::periodic(&rough(), elastic(), long).unwrap();
    for odd in [f64::NAN, f64::INFINITY] {
        assert!(contact.press(Pressure::pascals(odd)).is_err());
    }
    for odd in [0.0, -1.0, f64::NAN] {
        assert!(contact.press_to_gap(Length::metres(odd)).is_err());
    }
}

#[test]
fn flow_needs_a_periodic_gap() {
    let pressed = Contact::isolated(&rough(), elastic()).unwrap().press(Pressure::megapascals(1.0));
    assert_eq!(pressed.unwrap().flow(), Err(FlowError::Isolated));
}

#[test]
fn maps_without_points_or_roughness_are_errors() {
    let map =
        |height: f64| MeasuredMap::new(grid(), vec![height; 256], Length::nanometres(1.0)).unwrap();
    let missing = map(f64::NAN).level(Form::Quadric).fill(Fill::Harmonic).surface();
    assert!(matches!(missing, Err(SurfaceError::Missing { missing: 256, .. })), "{missing:?}");
    assert_eq!(map(2.0).level(Form::Plane).surface(), Err(SurfaceError::Flat));
    for odd in [0.0, -0.1, 0.6, f64::NAN] {
        let error = map(1.0).edges(Edges::Taper(odd)).surface();
        assert!(matches!(error, Err(SurfaceError::Taper(_))));
    }
}

/// Presses with numbers of any size, which may fail but not panic.
fn press(side: f64, slope: f64, modulus: f64, load: f64) -> Result<(), Failure> {
    let grid = Grid::square(8, Length::metres(side))?;
    let spectrum = Spectrum::new(0.8, 1..=3)?;
    let surfaces = [
        RandomSurface::with_rms_slope(spectrum, slope).draw(grid)?,
        RandomSurface::with_rms_height(spectrum, Length::metres(slope)).draw(grid)?,
    ];
    for surface in surfaces {
        surface.rms_height();
        let material = Material::elastic(Pressure::pascals(modulus))?;
        for contact in [Contact::periodic, Contact::isolated].map(|new| new(&surface, material)) {
            let pressed = contact?.max_pairs(50).press(Pressure::pascals(load))?;
            pressed.gaps();
            pressed.spots();
            pressed.flow()?;
        }
    }
    Ok(())
}

#[test]
fn no_number_panics() {
    for odd in ODD {
        for other in ODD.into_iter().chain([1e-9, 1.0, 1e9]) {
            // Whether they fail does not matter here.
            let _ = press(odd, other, 1e9, 1e6);
            let _ = press(1e-4, 0.1, odd, other);
            let _ = press(other, odd, 1e9, 1e6);
            let _ = press(odd, 0.1, other, 1e6);
        }
        for nodes in [[1, 1], [1, 8], [8, 1], [2, 2], [3, 5]] {
            let sides = [Length::metres(1e-5); 2];
            let grid = Grid::new(nodes, sides).unwrap();
            let heights = (0..nodes[0] * nodes[1]).map(|node| odd * (node % 2) as f64).collect();
            if let Ok(surface) = Surface::from_heights(grid, heights, Length::nanometres(1.0)) {
                surface.rms_height();
                if let Ok(contact) = Contact::isolated(&surface, elastic()) {
                    let _ = contact.press(Pressure::megapascals(1.0));
                }
                if let Ok(contact) = Contact::periodic(&surface.assume_periodic(), elastic()) {
                    let _ = contact.press(Pressure::megapascals(1.0));
                }
            }
        }
    }
    for nodes in [[0, 1], [usize::MAX, 2], [1 << 20, 1 << 20]] {
        assert!(matches!(Grid::new(nodes, [Length::metres(1.0); 2]), Err(GridError::Nodes { .. })));
    }
}
