use super::*;

fn three() -> Curves {
    let areas = vec![vec![0.2, 0.3, 0.35], vec![0.1, 0.25, 0.4], vec![0.3, 0.5, 0.6]];
    Curves::new(vec![0.1, 0.2, 0.4], areas).expect("well formed")
}

fn assert_close(left: &[f64], right: &[f64]) {
    assert_eq!(left.len(), right.len());
    // A few roundings of numbers of order one.
    assert!(left.iter().zip(right).all(|(l, r)| (l - r).abs() < 1e-14), "{left:?} {right:?}");
}

#[test]
fn slope_of_the_mean_curve_is_the_mean_slope() {
    let (curves, data) = (three(), three().slope_data(Window::ALL));
    assert_close(&data.loads, &[0.05, 0.15, 0.3]);
    let mean = curves.mean();
    let expected = [mean[0] / 0.1, (mean[1] - mean[0]) / 0.1, (mean[2] - mean[1]) / 0.2];
    assert_close(&data.mean(), &expected);
}

#[test]
fn windowed_slopes_keep_their_neighbours_outside_the_window() {
    let all = three().slope_data(Window::ALL);
    let cut = three().slope_data(Window { from: 0.12, to: 0.2 });
    assert_eq!(cut.loads, all.loads[1..2]);
    assert_eq!(cut.mean(), all.mean()[1..2]);
}

#[test]
fn window_includes_its_ends_in_spite_of_rounding() {
    let window = Window { from: 0.1, to: 0.3 };
    assert!(window.contains(0.1) && window.contains(3.0 * 0.1));
    assert!(!window.contains(0.3001) && !window.contains(0.0999));
}

#[test]
fn equal_multiplicities_resample_to_the_mean() {
    let data = three().area_data(Window::ALL);
    assert_close(&data.resampled_mean(&[2, 2, 2]), &data.mean());
    assert_close(&data.resampled_mean(&[0, 3, 0]), &data.rows[1]);
}

#[test]
fn weights_are_inverse_variances_of_the_mean() {
    let data = three().area_data(Window { from: 0.1, to: 0.1 });
    assert_close(&data.variance().expect("three surfaces"), &[0.01]);
    assert!((data.weights().expect("scattered")[0] - 300.0).abs() < 1e-10);
}

#[test]
fn data_without_scatter_have_no_weights() {
    let single = Curves::new(vec![0.1], vec![vec![0.2]]).expect("well formed");
    assert_eq!(single.area_data(Window::ALL).weights(), None);
    let third = 1.0 / 3.0;
    let equal = Curves::new(vec![0.1], vec![vec![third]; 7]).expect("well formed");
    assert_eq!(equal.area_data(Window::ALL).weights(), None);
}

#[test]
fn malformed_curves_are_refused() {
    let refused = |loads: &[f64], areas: &[&[f64]]| {
        Curves::new(loads.to_vec(), areas.iter().map(|row| row.to_vec()).collect()).unwrap_err()
    };
    assert!(matches!(refused(&[0.1], &[]), FitError::Shape { surfaces: 0, .. }));
    assert!(matches!(refused(&[0.1], &[&[0.1, 0.2]]), FitError::Shape { areas: 2, .. }));
    assert!(matches!(refused(&[0.0], &[&[0.0]]), FitError::Loads { position: 0, .. }));
    assert!(matches!(refused(&[0.2, 0.1], &[&[0.1; 2]]), FitError::Loads { position: 1, .. }));
    assert!(matches!(refused(&[0.2], &[&[f64::NAN]]), FitError::Area { surface: 0, .. }));
}
