use super::*;
use crate::Quantity;

#[track_caller]
fn channels(text: &str) -> Vec<Channel<'_>> {
    read(text.as_bytes()).unwrap()
}

#[track_caller]
fn refused(text: &str, message: &str) {
    let error = read(text.as_bytes()).unwrap_err();
    assert_eq!(error.to_string(), message);
}

#[test]
fn a_matrix_alone_has_no_size_and_no_unit() {
    let channel = &channels("1 2 3 4\n5 6 7 8\n")[0];
    assert_eq!(channel.nodes(), [4, 2]);
    assert_eq!(channel.size(), Size::Unknown);
    assert_eq!(channel.quantity(), &Quantity::Unitless);
    assert_eq!(channel.map().get(3, 0), Some(4.0));
}

#[test]
fn decimal_commas_are_not_taken_for_separators() {
    let channel = &channels("0,5 1 2 3\n4 5,5 6 7\n")[0];
    assert_eq!(channel.nodes(), [4, 2]);
    assert_eq!(channel.map().get(1, 1), Some(5.5));
    let channel = &channels("0.5, 1, 2, 3\n4, 5.5, 6, 7\n")[0];
    assert_eq!(channel.map().get(1, 1), Some(5.5));
}

#[test]
fn maps_below_each_other_have_headers_of_their_own() {
    let one = "# Channel: A\n# Width: 1 µm\n# Height: 2 µm\n# Value units: m\n1 2\n3 4\n";
    let other = "# Channel: B\n# Width: 3 µm\n# Height: 2 µm\n# Value units: V\n1 2 3\n";
    let text = format!("{one}\n{other}");
    let channels = channels(&text);
    let listed: Vec<_> = channels.iter().map(|c| (c.name(), c.unit(), c.nodes()[0])).collect();
    assert_eq!(listed, [("A", Some("m"), 2), ("B", Some("V"), 3)]);
}

#[test]
fn pixels_give_the_size() {
    let text = "pixel size = 2 nm\nheight conversion factor (-> nm) = 3\n1 2 3 4\n5 6 7 8\n";
    let channel = &channels(text)[0];
    let sides = channel.size().sides().unwrap();
    assert!((sides[0] / 8e-9 - 1.0).abs() < 1e-14 && (sides[1] / 4e-9 - 1.0).abs() < 1e-14);
    assert!((channel.map().get(1, 1).unwrap() / 18e-9 - 1.0).abs() < 1e-14);
}

#[test]
fn a_header_that_contradicts_the_matrix_is_refused() {
    refused("h=3 w=4\n1 2 3 4\n5 6 7 8\n", "`y-pixels` is 3, it must be 2, as many as there are");
    refused("1 2 3 4\n5 6 7\n", "line 2: it has 3 numbers, those above have 4");
    refused("1 2 3 4\n5 6 x 8\n", "line 2: `5 6 x 8` is no line of numbers");
}

#[test]
fn a_profile_is_no_map() {
    refused("0 1\n1 2\n2 3\n", "one or two columns of numbers: a profile and no map");
    refused("0 0 1\n1 1 2\n2 2 3\n3 3 3\n", "4 triplets along a line are a profile and no map");
}

#[test]
fn triplets_are_put_onto_their_grid() {
    let text = "0 0 1\n0 2 2\n1.001 0 3\n1 2 4\n2 0 5\n2 2 6\n";
    let channel = &channels(text)[0];
    assert_eq!(channel.nodes(), [3, 2]);
    assert_eq!(channel.size(), Size::Unitless([3.0, 4.0]));
    assert_eq!(channel.map().heights(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
}

#[test]
fn a_line_of_the_grid_may_lack() {
    let text = "0 0 1\n0 1 2\n1 0 3\n1 1 4\n3 0 5\n3 1 6\n";
    let map = channels(text)[0].map();
    assert_eq!(map.nodes(), [4, 2]);
    assert_eq!((map.get(2, 0), map.get(3, 1)), (None, Some(6.0)));
}

#[test]
fn triplets_that_lie_on_no_grid_are_refused() {
    refused("0 0 1\n0 1 2\n0 1 2\n1 0 3\n1 1 4\n", "two triplets have x = 0, y = 1");
    refused(
        "0 0 1\n0 1 2\n1 0 3\n1 1 4\n2.5 0 5\n2.5 1 6\n3.77 0 1\n3.77 1 1\n",
        "the triplets' x are not evenly spaced",
    );
}

#[test]
fn letters_that_are_no_text_are_named() {
    let error = decoded(b"1 2\x00").unwrap_err();
    assert_eq!(error.to_string(), "not text: it has the letter \\u{0}");
}
