use super::*;
use crate::{Quantity, Size};

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
fn commas_that_may_separate_thousands_are_a_note() {
    let notes = |text: &str| channels(text)[0].notes().len();
    assert_eq!(notes("1,234\t2,345\t3,456\t1\n3,456\t4,567\t5,678\t2\n"), 1);
    assert_eq!(notes("\"1,234\",2,3,4\n5,6,7,8\n"), 1);
    assert_eq!(notes("1,234\t2,345\t3,456\t1\n3,456\t4,56\t5,678\t2\n"), 0);
    assert_eq!(notes("0,123\t2,345\t3,456\t1\n3,456\t4,567\t5,678\t2\n"), 0);
}

#[test]
fn a_comment_after_the_numbers_is_no_part_of_the_map() {
    for text in ["1 2 3 4 # a\n5 6 7 8\n", "1,2,3,4,# a\n5,6,7,8\n", "1 2 3 4\n5 6 7 8 % a\n"] {
        assert_eq!(channels(text)[0].nodes(), [4, 2], "{text}");
    }
}

#[test]
fn names_of_lines_in_tables_of_r_are_no_heights() {
    for titles in ["\"V1\" \"V2\" \"V3\"", "V1 V2 V3"] {
        let text = format!("{titles}\n1 7 5 9\n2 3 8 1\n");
        let channel = &channels(&text)[0];
        assert_eq!(channel.map().heights(), [7.0, 3.0, 5.0, 8.0, 9.0, 1.0], "{titles}");
        assert_eq!(channel.notes(), ["the first column is taken for numbers of lines"]);
    }
}

#[test]
fn several_maps_in_a_file_have_separate_headers() {
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
    refused("h=3 w=4\n1 2 3 4\n5 6 7 8\n", "`y pixels` is 3; expected 2, the number in the matrix");
    refused("1 2 3 4\n5 6 7\n", "line 2: it has 3 numbers, but the lines above have 4");
    let unknown = "is neither a number nor a known word for a missing point";
    refused("1 2 3 4\n5 6 x 8\n", &format!("line 2: `x` at column 5 {unknown}"));
    refused("1 2 x 4\n5 6 7 8\n", &format!("line 1: `x` at column 5 {unknown}"));
    refused("1 2 3 4\nend of file\n", "line 2: `end of file` is not a line of numbers");
}

#[test]
fn a_profile_is_refused() {
    refused("0 1\n1 2\n2 3\n", "one or two columns of numbers are a profile, not a map");
    refused("0 0 1\n1 1 2\n2 2 3\n3 3 3\n", "4 triplets along a line are a profile, not a map");
}

fn profile(text: &str) -> Result<Channel<'static>, String> {
    super::profile(text).map_err(|error| error.to_string())
}

#[test]
fn columns_are_a_profile_if_the_user_says_so() {
    let channel = profile("0 1\n1 2\n2 3\n").unwrap();
    assert_eq!((channel.nodes(), channel.unit()), ([3, 1], None));
    assert_eq!(channel.size(), Size::Unitless([3.0, 1.0]));
    assert_eq!(channel.map().heights(), [1.0, 2.0, 3.0]);

    // Decimal commas, titles with units, and positions that fall.
    let channel = profile("X (mm);Z (um)\n1,0;4\n0,5;5,5\n0,0;6\n").unwrap();
    let [side, step] = channel.size().sides().unwrap();
    assert!((side - 1.5e-3).abs() < 1e-15 && (step - 0.5e-3).abs() < 1e-15);
    for (found, exact) in channel.map().heights().iter().zip([6e-6, 5.5e-6, 4e-6]) {
        assert!((found - exact).abs() < 1e-18);
    }

    let channel = profile("# stylus\nheight [nm]\n1\nnan\n3\n4\n").unwrap();
    assert_eq!((channel.size(), channel.unit()), (Size::Unknown, Some("m")));
    assert_eq!(channel.map().missing(), [false, true, false, false]);
}

#[test]
fn profiles_have_even_steps_and_one_column_of_heights() {
    let uneven = profile("0 1\n1 2\n2 3\n3.5 4\n").unwrap_err();
    assert!(uneven.starts_with("the positions in the first column are not evenly"), "{uneven}");
    assert!(uneven.ends_with("numbers 3 and 4 are 1.5000e0 apart"), "{uneven}");
    let three = profile("0 1 2\n1 2 3\n").unwrap_err();
    assert!(three.ends_with("this text has 3"), "{three}");
    assert!(profile("no numbers\n").is_err());
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
fn titles_of_columns_may_give_the_units() {
    let text = "max [V]\nx (µm); y (mm); Height z [nm]\n0;0;1\n0;1;2\n2;0;3\n2;1;4\n";
    let channel = &channels(text)[0];
    assert_eq!(channel.size(), Size::Metres([4e-6, 2e-3]));
    assert_eq!(channel.map().get(1, 1), Some(4e-9));
    let text = "X[s] Y[nm] Z[nm]\n0 0 1\n0 1 2\n2 0 3\n2 1 4\n";
    refused(text, "`unit of y` is nm; expected a unit like that of x, `s`");
}

#[test]
fn a_grid_may_have_missing_lines() {
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
        "the x coordinates of the triplets are not evenly spaced",
    );
}

#[test]
fn control_characters_are_named() {
    let error = decoded(b"1 2\x00").unwrap_err();
    assert_eq!(error.to_string(), "not a text file: it has the character \\u{0}");
}

#[track_caller]
fn missing(text: &str, expected: &[[usize; 2]]) {
    let map = channels(text)[0].map();
    let [nodes_x, nodes_y] = map.nodes();
    let nodes = (0..nodes_x).flat_map(|i| (0..nodes_y).map(move |j| [i, j]));
    let found: Vec<[usize; 2]> = nodes.filter(|[i, j]| map.get(*i, *j).is_none()).collect();
    assert_eq!(found, expected, "{text}");
}

#[test]
fn empty_cells_are_missing_points_and_separators_at_all_ends_are_not() {
    missing("1,2,3,4\n5,,7,8\n", &[[1, 1]]);
    missing("1,2,3,4\n5,6,7,\n", &[[3, 1]]);
    missing("1,2,3,\n5,6,7,8\n", &[[3, 0]]);
    missing("1;2;3;4;\n5;6;;8;\n", &[[2, 1]]);
    missing("1\t2\t3\t4\n5\t\t7\t8\n", &[[1, 1]]);
    missing("1\t\t2\t\t3\t\t4\n5\t\t6\t\t7\t\t8\n", &[]);
    missing("1;2;3;4;\n5;6;7;8\n", &[]);
    missing("1;2;3;4\n5;6;7;8;\n", &[]);
    missing("1,2,3,4\n,,,\n5,6,7,8\n", &[[0, 1], [1, 1], [2, 1], [3, 1]]);
}

#[test]
fn lines_may_end_with_cr() {
    let map = channels("# Width: 3 um\r# Height: 2 um\r1 2 3\r4 5 6\r")[0].map();
    assert_eq!((map.nodes(), map.get(2, 1)), ([3, 2], Some(6.0)));
}

/// Returns a map of 4 × 3 points as lines of points, each with `more` at its end.
fn points(title: &str, separator: &str, more: impl Fn(usize) -> String) -> String {
    let mut text = title.to_owned();
    for index in 0..12 {
        let (x, y) = (index % 4, index / 4);
        let cells = [0.5 * x as f64, 2.0 * y as f64, (index * index) as f64];
        let cells = cells.map(|cell| cell.to_string()).join(separator);
        text += &format!("{cells}{}\n", more(index));
    }
    text
}

#[track_caller]
fn is_grid(text: &str, size: Size, height: f64) {
    let channel = &channels(text)[0];
    assert_eq!(channel.nodes(), [4, 3], "{text}");
    let (found, expected) = (channel.size().sides().unwrap(), size.sides().unwrap());
    let agrees = |axis: usize| (found[axis] / expected[axis] - 1.0).abs() < 1e-12;
    assert!(agrees(0) && agrees(1), "{text}: {:?}", channel.size());
    assert_eq!(std::mem::discriminant(&channel.size()), std::mem::discriminant(&size), "{text}");
    let found = channel.map().get(3, 2).unwrap();
    assert!((found / height - 1.0).abs() < 1e-12, "{text}: {found}");
}

#[test]
fn titles_give_the_units_of_points_in_all_spellings() {
    let metres = Size::Metres([2e-6, 6e-6]);
    for titles in [
        "x in µm,y in µm,z in nm\n",
        "x_um,y_um,z_nm\n",
        "X_(microns),Y_(microns),Height(nm)\n",
        "X / µm,Y / µm,Z / nm\n",
        "x [um],y [um],z [nm]\n",
        "X,Y,Z\n[um],[um],[nm]\n",
        "X,Y,Height\nµm,µm,nm\n",
        "\"X (µm)\",\"Y (µm)\",\"Z (nm)\"\n",
    ] {
        is_grid(&points(titles, ",", |_| String::new()), metres, 121e-9);
    }
    for titles in ["X, µm\tY, µm\tZ, nm\n", "# x[um] y[um] z[nm]\n", "x in µm  y in µm  z in nm\n"]
    {
        is_grid(&points(titles, "\t", |_| String::new()), metres, 121e-9);
    }
    let text = points("x [furlong],y [furlong],z [nm]\n", ",", |_| String::new());
    refused(&text, "`unit of column x` is furlong; expected a known unit, such as µm");
}

#[test]
fn further_columns_of_points_are_an_index_a_flag_or_channels() {
    let size = Size::Unitless([2.0, 6.0]);
    is_grid(&points("", " ", |index| format!(" {index}")), size, 121.0);
    is_grid(&points("x,y,z,intensity\n", ",", |index| format!(",{index}")), size, 121.0);
    let text = points("x,y,z,valid\n", ",", |index| format!(",{}", usize::from(index != 5)));
    is_grid(&text, size, 121.0);
    missing(&text, &[[1, 1]]);
    let text = points("x [um],y [um],height [nm],current [nA]\n", ",", |index| format!(",{index}"));
    let found = channels(&text);
    let listed: Vec<_> = found.iter().map(|one| (one.name(), one.unit())).collect();
    assert_eq!(listed, [("height", Some("m")), ("current", Some("nA"))]);
    // The index of `to_csv` of pandas.
    let text: String = points("", ",", |_| String::new())
        .lines()
        .enumerate()
        .map(|(index, line)| format!("{index},{line}\n"))
        .collect();
    is_grid(&format!(",x,y,z\n{text}"), size, 121.0);
    is_grid(&text, size, 121.0);
    assert!(channels(&text)[0].notes()[0].starts_with("columns 2, 3 and 4 are taken for x, y"));
}

#[test]
fn labels_of_a_matrix_are_no_heights() {
    let rows = ["7,1,4,9", "2,8,3,6", "5,2,9,1"];
    let with = |title: &str, labels: [&str; 3]| {
        let rows = labels.iter().zip(rows).map(|(label, row)| format!("{label}{row}\n"));
        format!("{title}{}", rows.collect::<String>())
    };
    let plain = channels(&with("", [""; 3]))[0].map();
    for text in [
        with(",0,1,2,3\n", ["0,", "1,", "2,"]),
        with(",a,b,c,d\n", ["0,", "1,", "2,"]),
        with("0,1,2,3\n", [""; 3]),
        with("y0,y1,y2,y3\n", [""; 3]),
        with("A,B,C,D\n", [""; 3]),
    ] {
        assert_eq!(channels(&text)[0].map(), plain, "{text}");
    }
    let axes = with("µm,0.5,1,1.5,2\n", ["0,", "2,", "4,"]);
    let channel = &channels(&axes)[0];
    assert_eq!(channel.map().heights(), plain.heights());
    assert_eq!(channel.size(), Size::Metres([2e-6, 6e-6]));
    assert_eq!(channel.notes(), ["the first line and the first column are taken for axes in µm"]);
    // The axis along y descends.
    let axes = with(",0.5,1,1.5,2\n", ["4,", "2,", "0,"]);
    let channel = &channels(&axes)[0];
    assert_eq!((channel.map().get(0, 0), channel.size()), (Some(5.0), Size::Unitless([2.0, 6.0])));
}

#[test]
fn tables_that_are_no_maps_are_refused() {
    let rows = "1,2,3,4\n5,6,7,8\n9,10,11,13\n";
    let named = "are a table, not a map, or points with the columns x and y";
    refused(
        &format!("Z(nm),T(V),Z2(nm),T2(V)\n{rows}"),
        &format!("the columns `Z`, `T`, `Z2`, `T2` {named}"),
    );
    refused(
        &format!("Time,Force,Height,Phase\n{rows}"),
        &format!("the columns `Time`, `Force`, `Height`, `Phase` {named}"),
    );
    refused(
        "X;Y;valid\n[mm];[mm];[1/0]\n1;2;1\n2;3;1\n",
        "the columns `X`, `Y`, `valid` are a profile, not a map",
    );
    refused(
        "ply\nformat ascii 1.0\nend_header\n0 0 1\n",
        "a PLY mesh or point cloud is not a height map",
    );
    refused(
        "#FORMAT      : EMSA/MAS SPECTRAL DATA STANDARD\n#NCOLUMNS    : 2.\n1, 2,\n3, 5,\n",
        "an EMSA/MAS spectrum is not a height map",
    );
}

#[test]
fn empty_lines_separate_maps_but_not_lines_of_a_scan() {
    let two = channels("1 2 3 4\n5 6 7 8\n\n9 8 7 6\n5 4 3 2\n1 0 1 0\n");
    let nodes: Vec<_> = two.iter().map(|one| one.nodes()).collect();
    assert_eq!(nodes, [[4, 2], [4, 3]]);
    assert_eq!(
        channels(
            "1 2 3 4\n5 6 7 8\n\n9 8 7\n5 4 3\n"
                .replace("9 8 7\n5 4 3", "9 8 7 6 5\n1 2 3 4 5")
                .as_str()
        )
        .len(),
        2
    );
    assert_eq!(channels("1 2 3 4\n\n5 6 7 8\n\n9 8 7 6\n")[0].nodes(), [4, 3]);
    assert_eq!(channels("0 0 1\n0 1 2\n\n1 0 3\n1 1 4\n")[0].nodes(), [2, 2]);
}

#[test]
fn numbers_may_have_groups_of_thousands() {
    let map = channels("1,500.0\t2\t3\t4\n5\t6,000\t7\t1,234,567.5\n")[0].map();
    assert_eq!(
        (map.get(0, 0), map.get(1, 1), map.get(3, 1)),
        (Some(1500.0), Some(6000.0), Some(1234567.5))
    );
}

#[test]
fn lines_of_a_header_may_look_like_numbers() {
    let rows = "1 5 3 4\n5 6 7 9\n6 1 2 8\n";
    let plain = channels(rows)[0].map();
    for header in [
        "# 1 2 3\n",
        "#1 2 3 4\n",
        "% 10 20 30\n",
        "Scan 1 2 3\n",
        "2024-01-05 12 13 14\n",
        "10 x 10 nm\n",
        "512 512 10 µm\n",
        "*****\nInstrument X\n*****\n",
        "None\n",
    ] {
        assert_eq!(channels(&format!("{header}{rows}"))[0].map(), plain, "{header}");
    }
    let cells = rows.replace(' ', ",");
    for header in ["Date,2024-01-05,,\n", "A,B,C,D\n", "a0_um,a1_um,a2_um,a3_um\n"] {
        assert_eq!(channels(&format!("{header}{cells}"))[0].map(), plain, "{header}");
    }
}

#[test]
fn heights_may_count() {
    // The header gives the sides, so that no line is labels.
    let header = "# Width: 4 um\n# Height: 2 um\n";
    assert_eq!(channels(&format!("{header}0\t1\t2\t3\n5\t3\t8\t1\n"))[0].nodes(), [4, 2]);
    assert_eq!(channels("0 1 2 3\n5 3 8 1\n")[0].nodes(), [4, 2]);
}

#[test]
fn tabs_may_align_columns() {
    let map = channels("1\t\t2\t3\t4\n1000000\t2\t3\t5\n")[0].map();
    assert_eq!((map.nodes(), map.get(3, 1)), ([4, 2], Some(5.0)));
}

#[test]
fn empty_lines_within_the_lines_of_the_header_separate_no_maps() {
    let text = "nx=4 ny=4\n1 2 3 4\n5 6 7 8\n\n9 8 7 6\n5 4 3 2\n";
    assert_eq!(channels(text)[0].nodes(), [4, 4]);
    let two = channels(text.split_once('\n').unwrap().1);
    assert_eq!(two.len(), 2);
    assert_eq!(two[0].notes(), ["empty lines separate 2 maps of the text"]);
}

#[test]
fn a_quantity_beside_the_heights_may_have_any_unit() {
    let text = points("x,y,z,Quality (good)\n", ",", |index| format!(",{index}"));
    let units: Vec<_> = channels(&text).iter().map(|one| one.unit().map(str::to_owned)).collect();
    assert_eq!(units, [None, Some("good".to_owned())]);
    refused(
        &points("x,y,z (good)\n", ",", |_| String::new()),
        "`unit of column z` is good; expected a known unit, such as µm",
    );
}

#[test]
fn lines_of_a_spreadsheet_are_filled_up_with_separators() {
    let text = "Width,10,um,\nHeight,20,um,\n,,,\n1,2,3,4\n5,6,7,9\n";
    assert_eq!(channels(text)[0].nodes(), [4, 2]);
    // The first line of a map may be missing.
    assert_eq!(channels(",,,\n1,2,3,4\n5,6,7,9\n")[0].nodes(), [4, 3]);
}

#[test]
fn empty_columns_between_tabs_are_named() {
    let channel = &channels("1\t\t2\t3\t4\n5\t\t6\t7\t9\n")[0];
    assert_eq!(channel.nodes(), [4, 2]);
    assert_eq!(channel.notes(), ["1 columns between tabs are empty and are not used"]);
}
