//! Reasons of the versions of readers.

use super::Format;

/// The reader takes another default channel.
const CHANNEL: &str = "the name of a channel decides before its unit which one is read";
/// A reader of netCDF or HDF5 applies more attributes.
const CONVENTIONS: &str = "fill values, valid ranges, scale factors and coordinates count for all \
                           variables";
/// A reader of netCDF or HDF5 turns the map if its coordinates descend.
const DEGREES: &str = "coordinates that descend turn the map in any unit, such as degrees";
/// A reader of netCDF or HDF5 knows more names of axes.
const AXES: &str = "`axis`, `standard_name` and more names tell x and y";

/// What changed in the numbers that a reader decodes: for each format the reasons of the versions
/// from 2 on. [`Format::version`] is raised together with its reason here.
const CHANGES: &[(&str, &[&str])] = &[
    ("bcrf", &["1.7e38 marks a missing point also in single precision"]),
    ("datx", &["integers may have fewer bits than their bytes"]),
    ("esri-asc", &["grids of GRASS, `xdim`, `nodata` and other spellings"]),
    ("frt", &[CHANNEL]),
    ("gwy", &[CHANNEL]),
    ("gxyzf", &["titles that count from 0"]),
    ("h5-jpk", &["integers may have fewer bits than their bytes"]),
    ("hdf5", &[CONVENTIONS, DEGREES, "labels of dimensions tell x and y", AXES]),
    ("ibw", &[CHANNEL]),
    ("jpk", &[CHANNEL]),
    ("mi", &[CHANNEL]),
    (
        "nanoscope",
        &["`Aspect Ratio`, stopped scans and `Valid data len` give the lines and the side along y"],
    ),
    ("netcdf", &[CONVENTIONS, DEGREES, AXES]),
    ("netcdf4", &[CONVENTIONS, DEGREES, AXES]),
    ("nid", &[CHANNEL]),
    (
        "npz",
        &["`side` may have any type of numbers", "arrays x and y give sides and order of the axes"],
    ),
    ("nrrd", &["`space directions` give the sides"]),
    ("opd", &[CHANNEL]),
    ("opdx", &[CHANNEL]),
    (
        "sdf",
        &[
            "the lowest number marks missing points of all types, in BCR-1.0 the highest; the first \
           profile of BCR-1.0 has the largest y",
        ],
    ),
    ("sur", &["heights include the offset of the file"]),
    (
        "text",
        &[
            "units in all spellings of titles convert the numbers; labels are no heights; maps \
             that empty lines separate are channels",
            "lines above the numbers that look like numbers are a header",
            "more spellings of titles, headers and missing points",
        ],
    ),
    (
        "tiff",
        &[
            "the matrix of a GeoTIFF gives steps and directions",
            "kilometres, centimetres and millimetres are units of the sides",
            "masks in the file of GDAL; units of heights from vertical systems",
        ],
    ),
    ("vk", &[CHANNEL]),
    ("wsxm", &["decimal commas, and files without `Maximum` and `Minimum`"]),
    ("x3p", &["files with a list of data"]),
];

impl Format {
    /// Returns what changed in the numbers that the reader decodes: the reason of each version from
    /// 2 to [`Format::version`].
    #[doc(hidden)]
    pub fn changes(&self) -> &'static [&'static str] {
        let known = CHANGES.iter().find(|(name, _)| *name == self.name());
        known.map_or(&[], |(_, changes)| changes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats;

    #[test]
    fn each_raised_version_of_a_reader_has_a_reason() {
        for format in formats() {
            let reasons = format.changes().len() as u32;
            assert_eq!(format.version(), 1 + reasons, "add the reason of `{}`", format.name());
        }
        let is_format = |name: &str| formats().iter().any(|format| format.name() == name);
        assert!(CHANGES.iter().all(|(name, _)| is_format(name)));
    }
}
