//! Tests of the recipes of surfaces. Keys are digests of the text of recipes.

use crate::generate::*;
use crate::map_file::{ChannelChoice, MapChoice, Reader};
use crate::per_axis::PerAxis;
use crate::reduced_units::{GivenHardness, PressureUnit};
use crate::solve;
use crate::surface::labels::Labels;
use crate::surface::origin::{InspectedMap, MeasuredSurface};
use crate::surface::pair::{MirrorAxis, Pair, Yielded};
use crate::surface::spectrum::PrescribedHeights;
use crate::surface_files::ContentHash;
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::topography::alignment::{Alignment, LineFit};
use asperity_mechanics::topography::fill::Fill;
use asperity_mechanics::topography::level::{Level, ThreePoints};
use asperity_mechanics::topography::outliers::Spikes;
use asperity_mechanics::topography::periodic::Edges;
use asperity_mechanics::topography::preparation::{Crop, FoundCutoff, LowPass, Preparation};
use asperity_mechanics::topography::random::{Amplitude, RandomSurface};
use asperity_mechanics::topography::shapes::Shape;
use asperity_mechanics::topography::spectrum::{Anisotropy, Spectrum};
use asperity_mechanics::topography::surface::Axis;

#[test]
fn a_surface_is_known_from_its_recipe() {
    let spectrum = Spectrum { hurst: 0.8, k_lower: 4, k_rolloff: 4, k_upper: 32, anisotropy: None };
    let surface = RandomSurface {
        spectrum,
        amplitude: Amplitude::Deterministic,
        rms_slope: 0.02,
        seed: i64::MAX as u64,
        realization: 7,
    };
    let measured = MeasuredSurface {
        content: ContentHash::new(b"heights"),
        unit: "µm".to_owned(),
        height_scale: 1e-3,
        edges: Edges::Taper { taper_fraction: 0.1 },
        reader: None,
        choice: MapChoice::default(),
        preparation: Preparation::default(),
        tip_version: None,
        seen: InspectedMap::default(),
        labels: Labels::default(),
    };
    let shape = Shape::Punch { radius: 0.25, depth: 0.5 };
    let prepared = MeasuredSurface {
        reader: Some(Reader::of_format("x3p")),
        choice: MapChoice {
            channel: Some(ChannelChoice::Name("2".to_owned())),
            missing: Some(-9999.0),
            ignores_mask: true,
            profile: true,
            line: Some(3),
        },
        preparation: Preparation {
            crop: Some(Crop { from: [0.1, 0.0], size: [0.25, 1e-7] }),
            spikes: Some(Spikes { threshold: 8.0, window: 5 }),
            islands: Some(20),
            align: Some(Alignment { along: Axis::Y, by: LineFit::Polynomial { degree: 2 } }),
            level: Some(Level::Quadric),
            level_through: Some(ThreePoints { a: [0.0, 0.1], b: [1e-7, 0.0], c: [0.2, 0.2] }),
            fill: Some(Fill::Harmonic),
            high_pass: Some(0.5),
            low_pass: Some(LowPass::Wavelength(0.1)),
            resample: Some([128, 64]),
            ..Preparation::default()
        },
        ..measured.clone()
    };
    let reliable = MeasuredSurface {
        preparation: Preparation {
            low_pass: Some(LowPass::Found(FoundCutoff::Reliable)),
            tip_radius: Some(1e-8),
            tip_along: Some(Axis::Y),
            noise_floor: true,
            ..Preparation::default()
        },
        ..measured.clone()
    };
    let open = MeasuredSurface { edges: Edges::Open, ..measured.clone() };
    let [square, rectangle] = [[128, 128], [128, 64]].map(PerAxis);
    let skewed = |heights: PrescribedHeights| Origin::Random {
        nodes: square,
        surface,
        has_unit_ratio: false,
        rms_height: Some(1e-3),
        height_distribution: Some(heights),
        unit: String::new(),
    };
    let scan = Params {
        heights: Heights::Redraw,
        side: None,
        origin: Origin::File(Box::new(measured.clone())),
    };
    for origin in [
        Origin::Random {
            nodes: square,
            surface,
            has_unit_ratio: false,
            rms_height: None,
            height_distribution: None,
            unit: String::new(),
        },
        Origin::Random {
            nodes: rectangle,
            surface,
            has_unit_ratio: false,
            rms_height: None,
            height_distribution: None,
            unit: String::new(),
        },
        skewed(PrescribedHeights::Moments { skewness: -1.5, kurtosis: 6.0 }),
        skewed(PrescribedHeights::Surface { from: Box::new(scan) }),
        Origin::File(Box::new(measured)),
        Origin::File(Box::new(open)),
        Origin::File(Box::new(prepared)),
        Origin::File(Box::new(reliable)),
        Origin::Shape { nodes: square, shape, unit: String::new() },
        Origin::Shape { nodes: rectangle, shape, unit: String::new() },
    ] {
        for side in [None, Some(PerAxis([1.0, 1.0])), Some(PerAxis([2.0, 1.0]))] {
            let params = Params { heights: Heights::Redraw, side, origin: origin.clone() };
            let recipe = serde_json::to_string(&params).unwrap();
            assert_eq!(serde_json::from_str::<Params>(&recipe).unwrap(), params);
            for mirror in [None, Some(MirrorAxis::X)] {
                let shift = PerAxis([0.1, 0.0]);
                let pair = Pair::new([&params, &params], shift, mirror, [false; 2]);
                let origin = Origin::Pair(Box::new(pair));
                let params = Params { heights: Heights::Redraw, side: None, origin };
                let recipe = serde_json::to_string(&params).unwrap();
                assert_eq!(serde_json::from_str::<Params>(&recipe).unwrap(), params);
            }
        }
    }
}

#[test]
fn a_surface_that_has_yielded_is_known_from_its_recipe() {
    let shape = Shape::Paraboloid { radius: 0.25 };
    let origin = Origin::Shape { nodes: PerAxis([64, 64]), shape, unit: "mm".to_owned() };
    let body = Params { heights: Heights::Redraw, side: Some(PerAxis([1.0, 1.0])), origin };
    for boundary in [Boundary::Periodic, Boundary::Free] {
        let yielded = Yielded {
            body: Box::new(body.clone()),
            load: 0.1,
            load_unit: PressureUnit::Absolute,
            hardness: GivenHardness { pressure: 0.5, unit: PressureUnit::Relative },
            effective_modulus: 2.0,
            tolerance: 1e-5,
            max_pairs: 100,
            boundary,
            solve_version: solve::VERSION.number(),
        };
        let origin = Origin::Yielded(Box::new(yielded));
        let params = Params { heights: Heights::Keep, side: None, origin };
        let recipe = serde_json::to_string(&params).unwrap();
        assert_eq!(serde_json::from_str::<Params>(&recipe).unwrap(), params);
        assert_eq!((params.nodes(), params.origin.unit()), ([64, 64], "mm"));
    }
}

#[test]
fn the_recipe_of_an_array_is_what_it_was_before_there_were_other_files() {
    let content = ContentHash::new(b"heights");
    let params = Params {
        heights: Heights::Keep,
        side: Some(PerAxis([2.0, 1.0])),
        origin: Origin::File(Box::new(MeasuredSurface {
            content,
            unit: "µm".to_owned(),
            height_scale: 1e-3,
            edges: Edges::Taper { taper_fraction: 0.1 },
            reader: None,
            choice: MapChoice::default(),
            preparation: Preparation::default(),
            tip_version: None,
            seen: InspectedMap { missing: 3, ..InspectedMap::default() },
            labels: Labels::default(),
        })),
    };
    let expected = format!(
        r#"{{"heights":"keep","side":[2.0,1.0],"method":"file","content":"{content}","unit":"µm","height_scale":0.001,"edges":"taper","taper_fraction":0.1}}"#
    );
    assert_eq!(serde_json::to_string(&params).unwrap(), expected);
}

#[test]
fn a_grain_is_written_where_there_is_one() {
    let params = |anisotropy: Option<Anisotropy>, has_unit_ratio: bool| Params {
        heights: Heights::Keep,
        side: Some(PerAxis::same(1.0)),
        origin: Origin::Random {
            nodes: PerAxis::same(64),
            surface: RandomSurface {
                spectrum: Spectrum {
                    hurst: 0.8,
                    k_lower: 2,
                    k_rolloff: 4,
                    k_upper: 16,
                    anisotropy,
                },
                amplitude: Amplitude::Gaussian,
                rms_slope: 1.0,
                seed: 1,
                realization: 0,
            },
            has_unit_ratio,
            rms_height: None,
            height_distribution: None,
            unit: String::new(),
        },
    };
    let written = |params: &Params| serde_json::to_string(params).unwrap();
    let head = r#"{"heights":"keep","side":1.0,"nodes":64,"hurst":0.8,"k_lower":2,"k_rolloff":4,"#;
    let tail = r#""method":"filter","rms_slope":1.0,"seed":1,"realization":0}"#;
    let isotropic = params(None, false);
    assert_eq!(written(&isotropic), format!(r#"{head}"k_upper":16,{tail}"#));
    let of_ratio_one = params(Anisotropy::new(1.0, 30.0), true);
    assert_ne!(written(&of_ratio_one), written(&isotropic));
    assert_eq!(of_ratio_one.surface_key(), isotropic.surface_key());
    let stretched = params(Anisotropy::new(2.0, 30.0), false);
    let grain = r#""anisotropy_ratio":2.0,"anisotropy_angle":30.0"#;
    assert_eq!(written(&stretched), format!(r#"{head}"k_upper":16,{grain},{tail}"#));
    for params in [isotropic, of_ratio_one, stretched] {
        assert_eq!(serde_json::from_str::<Params>(&written(&params)).unwrap(), params);
    }
}

#[test]
fn a_surface_with_a_given_spectrum_is_known_from_its_recipe() {
    for source in [
        Source::File { content: ContentHash::new(b"spectrum"), unit: "µm".to_owned() },
        Source::Stage { spectrum_of: None },
    ] {
        let moments = PrescribedHeights::Moments { skewness: -1.5, kurtosis: 6.0 };
        for (rms_slope, height_distribution) in [(None, None), (Some(0.1), Some(moments))] {
            let params = Params {
                heights: Heights::Keep,
                side: Some(PerAxis([2.0, 1.0])),
                origin: Origin::Spectrum {
                    nodes: PerAxis([64, 32]),
                    surface: SpectrumSurface {
                        rms_height: None,
                        source: source.clone(),
                        rms_slope,
                        seed: 5,
                        realization: 2,
                    },
                    height_distribution,
                },
            };
            let recipe = serde_json::to_string(&params).unwrap();
            assert_eq!(serde_json::from_str::<Params>(&recipe).unwrap(), params);
        }
    }
}

#[test]
fn the_recipe_of_a_square_is_what_it_was_before_there_were_rectangles() {
    let params = Params {
        heights: Heights::Keep,
        side: Some(PerAxis::same(1.0)),
        origin: Origin::Shape {
            nodes: PerAxis::same(64),
            shape: Shape::Paraboloid { radius: 0.5 },
            unit: String::new(),
        },
    };
    let recipe = serde_json::to_string(&params).unwrap();
    let expected = r#"{"heights":"keep","side":1.0,"nodes":64,"method":"paraboloid","radius":0.5}"#;
    assert_eq!(recipe, expected);
}
