//! HDF5 files with maps, and helpers for the formats that are built on HDF5.
//!
//! The crate `hdf5-reader` decodes the container: it is pure Rust and reads what h5py, MATLAB 7.3
//! and netCDF4 write. Where its version 0.12.1 is wrong, this module does it: integers of fewer
//! bits and texts ([`stored`]), members of a group ([`container`]). A dataset whose chunks it would
//! misplace is refused.
//!
//! The channels are the arrays of numbers with two long dimensions in the root group or, if there
//! are none, in all groups. The module [`labelled`](super::labelled) documents how axes, sides,
//! units and missing points follow from attributes. They come from, in this order:
//!
//! - dimension scales (netCDF4 1.7.5, xarray 2026.9, h5py 3.16);
//! - `axes` of a group `NXdata` or of its dataset (NeXus definitions 2024.02), whose last axis is x
//!   unless the names tell;
//! - groups `axis-0`, `axis-1`, … with `name`, `scale` and `units` beside the dataset (HyperSpy
//!   2.5), whose last axis is x;
//! - `xreal`, `yreal`, `si_unit_xy`, `si_unit_z` and `name` of the group (gwyddionpy 0.1.0), in
//!   lines along x;
//! - `system_size` and `discretization` of the root group (Tamaas 2.9.0).
//!
//! Otherwise the first index is x, as in the reader of SurfaceTopography, in the 2048 × 2048
//! surface of the contact-mechanics challenge, and in MATLAB matrices whose first index is y, which
//! MATLAB stores by columns. Texts of MATLAB are no maps.
//!
//! Files of TopoStats have a dataset `pixel_to_nm_scaling`, which is the step in nanometres. Lines
//! of their images run along x, the first line has y = 0, and heights are in nanometres.
//! `image_original` is the map as measured; TopoStats 2 has flattened and smoothed `image`.

mod container;
mod filters;
mod stored;

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};

use hdf5_reader::group::Group;
use hdf5_reader::{Dataset, Datatype};

pub(crate) use self::container::Container;
use self::container::Members;
use super::channel::{Channel, Sides};
use super::direction::Direction;
use super::labelled::{AXES, Array, Attributes, Axis, CONVENTIONS, Coordinates, DEGREES};
use super::netcdf::complete_heights;
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

pub(crate) const FORMAT: Format = Format::new("hdf5", "HDF5", read).changed(&[
    CONVENTIONS,
    DEGREES,
    "labels of dimensions tell x and y",
    AXES,
]);

/// Maximum number of groups that are searched for datasets.
const MAX_GROUPS: usize = 10_000;
/// Maximum number of HyperSpy's groups of axes.
const MAX_AXES: usize = 8;

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let container = Container::open(bytes)?;
    let root = container.root()?;
    let members = container.members(&root, "the root group")?;
    let scaling = |dataset: &&Dataset| dataset.name() == "pixel_to_nm_scaling";
    if let Some(step) = members.datasets.iter().find(scaling) {
        return topostats(&container, &members.datasets, step);
    }
    maps(&container, &root, members)
}

/// Reads all maps of a file.
pub(crate) fn maps(
    container: &Container,
    root: &Group,
    members: Members,
) -> Result<Vec<Channel<'static>>, FormatError> {
    let mut file = Groups {
        container,
        root: container.group_attributes(root)?,
        known: BTreeMap::new(),
        read: BTreeSet::new(),
        unreadable: vec![],
        is_located: Cell::new(false),
    };
    let (groups, folder) = file.folder(String::new(), root, members)?;
    let mut channels = file.channels(&folder);
    if channels.is_empty() {
        for folder in file.nested(groups) {
            channels.extend(file.channels(&folder));
        }
    }
    if channels.is_empty() {
        return Err(file.unreadable.into_iter().next().unwrap_or_else(|| {
            FormatError::unsupported(
                "the file has no dataset of numbers with two dimensions longer than one",
            )
        }));
    }
    let note = |error| format!("a part of the file was not read: {error}");
    let notes: Vec<String> = file.unreadable.iter().map(note).collect();
    Ok(channels.into_iter().map(|channel| channel.noted(&notes)).collect())
}

/// Reads the images of a file of TopoStats.
fn topostats(
    container: &Container,
    datasets: &[Dataset],
    step: &Dataset,
) -> Result<Vec<Channel<'static>>, FormatError> {
    let step = container.numbers(step)?;
    let &[step] = step.as_slice() else {
        let allowed = "one number";
        return Err(FormatError::value("pixel_to_nm_scaling", step.len(), allowed));
    };
    let is_map = |dataset: &&Dataset| dataset.ndim() == 2 && Array::is_map_of(dataset.shape());
    let images =
        datasets.iter().filter(is_map).filter(|dataset| dataset.name().starts_with("image"));
    let channels = images.map(|dataset| {
        let raster = container.raster(dataset)?;
        let nanometres = Unit::parse("nm");
        let size = Sides::new(raster.nodes().map(|nodes| nodes as f64 * step), &nanometres)?;
        let channel = Channel::new(dataset.name(), nanometres, size, raster);
        let is_processed = dataset.name() == "image";
        let note = "TopoStats has flattened and smoothed `image`";
        Ok(channel.noted(is_processed.then_some(note)))
    });
    at_least_one(channels, "image")
}

/// Groups of a file, from which maps are read.
struct Groups<'a> {
    container: &'a Container,
    /// Attributes of the root group.
    root: Attributes,
    /// Datasets by their addresses, to which lists of dimensions refer.
    known: BTreeMap<u64, Dataset>,
    /// Addresses of the datasets that were read.
    read: BTreeSet<u64>,
    /// Reasons why parts of the file could not be read.
    unreadable: Vec<FormatError>,
    /// True if the coordinates of the current group are those of one of its maps.
    is_located: Cell<bool>,
}

/// Group with its datasets.
struct Folder {
    /// Path, empty or with a slash at its end.
    path: String,
    attributes: Attributes,
    datasets: Vec<Dataset>,
    /// Attributes of the groups `axis-0`, `axis-1`, …
    axes: Vec<Attributes>,
}

impl Groups<'_> {
    /// Returns the groups in a group, and its datasets.
    fn folder(
        &mut self,
        path: String,
        group: &Group,
        members: Members,
    ) -> Result<(Vec<Group>, Folder), FormatError> {
        let Members { groups, datasets, unreadable } = members;
        self.unreadable.extend(unreadable);
        for dataset in &datasets {
            self.known.insert(dataset.address(), dataset.clone());
        }
        let axis = |index| groups.iter().find(|group| group.name() == format!("axis-{index}"));
        let found = (0..MAX_AXES).map_while(axis).map(|axis| self.container.group_attributes(axis));
        let axes = found.collect::<Result<_, _>>()?;
        let attributes = self.container.group_attributes(group)?;
        Ok((groups, Folder { path, attributes, datasets, axes }))
    }

    /// Returns all groups below the given ones. Those of NeXus data come first, because they have
    /// axes; other groups may link to the same datasets.
    fn nested(&mut self, groups: Vec<Group>) -> Vec<Folder> {
        let mut folders = Vec::new();
        let mut visited = BTreeSet::new();
        let below = |path: &str, groups: Vec<Group>| -> Vec<(String, Group)> {
            let named = |group: Group| (format!("{path}{}/", group.name()), group);
            groups.into_iter().rev().map(named).collect()
        };
        let mut left = below("", groups);
        while let Some((path, group)) = left.pop() {
            // Links may form loops.
            if !visited.insert(group.address()) || visited.len() > MAX_GROUPS {
                continue;
            }
            let members = self.container.members(&group, &path);
            match members.and_then(|members| self.folder(path.clone(), &group, members)) {
                Ok((groups, folder)) => {
                    folders.push(folder);
                    left.extend(below(&path, groups));
                }
                Err(error) => self.unreadable.push(error),
            }
        }
        folders.sort_by_key(|folder| !folder.is_nexus());
        folders
    }

    /// Reads the maps of a group. The signal of NeXus data comes first.
    fn channels(&mut self, folder: &Folder) -> Vec<Channel<'static>> {
        let mut channels = Vec::new();
        let named = folder.attributes.text("signal").ok().flatten();
        let name = named.filter(|_| folder.is_nexus()).unwrap_or_default();
        let is_signal = |dataset: &&Dataset| dataset.name() == name;
        let coordinates = folder.coordinates();
        let is_coordinate = |dataset: &&Dataset| {
            coordinates.is_some_and(|of| of.iter().any(|one| one.name() == dataset.name()))
        };
        let mut datasets: Vec<&Dataset> = folder.datasets.iter().collect();
        datasets.sort_by_key(|dataset| (is_coordinate(dataset), !is_signal(dataset)));
        self.is_located.set(false);
        for dataset in datasets {
            if is_coordinate(&dataset) && self.is_located.get() {
                break;
            }
            // The same dataset may have several names.
            if Array::is_map_of(dataset.shape()) && self.read.insert(dataset.address()) {
                match self.channels_of(folder, dataset) {
                    Ok(maps) => channels.extend(maps),
                    Err(error) => self.unreadable.push(error),
                }
            }
        }
        channels
    }

    fn channels_of(
        &self,
        folder: &Folder,
        dataset: &Dataset,
    ) -> Result<Vec<Channel<'static>>, FormatError> {
        let attributes = self.container.attributes(dataset)?;
        let is_number =
            matches!(dataset.dtype(), Datatype::FixedPoint { .. } | Datatype::FloatingPoint { .. });
        if !is_number || attributes.text("MATLAB_class")? == Some("char") {
            return Ok(vec![]);
        }
        let find = |name: &str| folder.datasets.iter().find(|dataset| dataset.name() == name);
        if dataset.name() == "mask"
            && let Some(heights) = find("heights")
            && self.is_surface(heights)?
        {
            return Ok(vec![]);
        }
        let mut array = self.array(folder, dataset, attributes)?;
        if dataset.name() == "heights" && self.is_surface(dataset)? {
            let mask = find("mask").map(|mask| {
                let attributes = self.container.attributes(mask)?;
                self.array(folder, mask, attributes)
            });
            complete_heights(&mut array, mask.transpose()?)?;
        }
        array.channels()
    }

    /// Returns true for the heights of SurfaceTopography, whose axes state sides.
    fn is_surface(&self, heights: &Dataset) -> Result<bool, FormatError> {
        let axes = self.scales(heights)?.unwrap_or_default();
        Ok(axes.iter().any(|axis| axis.side.is_some()))
    }

    fn array(
        &self,
        folder: &Folder,
        dataset: &Dataset,
        attributes: Attributes,
    ) -> Result<Array, FormatError> {
        let (element, order, bytes) = self.container.bytes(dataset)?;
        let name = format!("{}{}", folder.path, dataset.name());
        let mut array = Array {
            attributes,
            unwritten: self.container.unwritten(dataset),
            ..Array::new(name, dataset.shape(), element, order, bytes)
        };
        if let Some(axes) = self.scales(dataset)? {
            array.axes = axes;
        } else if let Some(axes) = self.nexus(folder, &array)? {
            (array.axes, array.last_is_x) = (axes, true);
        } else if folder.axes.len() == dataset.ndim() {
            self.hyperspy(folder, &mut array)?;
        } else if let Some(axes) = folder.gwyddion()?.filter(|_| dataset.ndim() == 2) {
            array.axes = axes;
            array.unit = folder.attributes.text("si_unit_z")?.map(Unit::parse);
            if let Some(name) = folder.attributes.text("name")? {
                name.clone_into(&mut array.name);
            }
        } else if let Some(axes) = self.coordinates(folder, dataset)? {
            array.axes = axes;
        }
        self.tamaas(&mut array);
        Ok(array)
    }

    /// Returns the axes of a dataset with coordinates x and y beside it.
    fn coordinates(
        &self,
        folder: &Folder,
        dataset: &Dataset,
    ) -> Result<Option<Vec<Axis>>, FormatError> {
        let (Some(of), &[first, second]) = (folder.coordinates(), dataset.shape()) else {
            return Ok(None);
        };
        let read = of.map(|one| {
            Ok(Coordinates {
                name: one.name().to_owned(),
                shape: lengths(one),
                numbers: self.container.numbers(one)?,
                attributes: self.container.attributes(one)?,
            })
        });
        let [x, y] = read;
        let axes = Coordinates::axes([first, second].map(|length| length as usize), &x?, &y?)?;
        self.is_located.set(self.is_located.get() || axes.is_some());
        Ok(axes)
    }

    /// Returns the axes of a dataset with dimension scales or with names of its dimensions.
    fn scales(&self, dataset: &Dataset) -> Result<Option<Vec<Axis>>, FormatError> {
        let attributes = self.container.attributes(dataset)?;
        let labels = attributes.texts("DIMENSION_LABELS")?;
        let Ok(list) = dataset.attribute("DIMENSION_LIST") else {
            let axes = || labels.iter().map(Axis::named).collect();
            return Ok((labels.len() == dataset.ndim()).then(axes));
        };
        let file = self.container.file();
        let size = usize::from(file.superblock().offset_size);
        let references = list.raw_data.chunks_exact(8 + size);
        let found = references.zip(dataset.shape()).map(|(reference, &length)| {
            let address = stored::heap_bytes(file, reference, size).and_then(|bytes| {
                let mut wide = [0; 8];
                wide[..size].copy_from_slice(bytes.get(..size)?);
                Some(u64::from_le_bytes(wide))
            });
            match address.and_then(|address| self.known.get(&address)) {
                Some(scale) => self.axis(scale, length),
                None => Ok(Axis::default()),
            }
        });
        let mut axes = found.collect::<Result<Vec<Axis>, FormatError>>()?;
        // Labels name the dimensions; scales are coordinates along them and may have other names.
        for (axis, label) in axes.iter_mut().zip(labels) {
            if !label.is_empty() {
                axis.name.clone_from(label);
            }
        }
        Ok((axes.len() == dataset.ndim()).then_some(axes))
    }

    /// Returns the axis of which a dataset has the coordinates.
    fn axis(&self, scale: &Dataset, length: u64) -> Result<Axis, FormatError> {
        let attributes = self.container.attributes(scale)?;
        let name = attributes.text("NAME")?.unwrap_or_default();
        // A dimension without a variable has a dataset of zeros.
        let is_variable = !name.starts_with("This is a netCDF dimension but not a netCDF variable");
        if is_variable && scale.shape() == [length] {
            Axis::new(scale.name(), &self.container.numbers(scale)?, &attributes)
        } else {
            Ok(Axis::named(scale.name()))
        }
    }

    /// Returns the axes that a group of NeXus data or its dataset names.
    fn nexus(&self, folder: &Folder, array: &Array) -> Result<Option<Vec<Axis>>, FormatError> {
        let own = array.attributes.texts("axes")?;
        let names = if own.is_empty() { folder.attributes.texts("axes")? } else { own };
        let names: Vec<&str> = match names {
            [one] => one.split([':', ',']).map(str::trim).collect(),
            several => several.iter().map(String::as_str).collect(),
        };
        if names.len() != array.shape.len() || names.is_empty() {
            return Ok(None);
        }
        let axes = names.iter().zip(&array.shape).map(|(name, &length)| {
            match folder.datasets.iter().find(|dataset| dataset.name() == *name) {
                Some(scale) => self.axis(scale, length as u64),
                // NeXus names an axis without coordinates by a dot.
                None => Ok(Axis::named(name.trim_matches('.'))),
            }
        });
        axes.collect::<Result<_, _>>().map(Some)
    }

    /// Sets the axes of a signal of HyperSpy, and the unit of its quantity, such as `Height (µm)`.
    fn hyperspy(&self, folder: &Folder, array: &mut Array) -> Result<(), FormatError> {
        let axes = folder.axes.iter().enumerate().map(|(index, axis)| {
            let unit = axis.unit()?.filter(|unit| *unit != Unit::parse("<undefined>"));
            let name = axis.text("name")?.unwrap_or_default();
            let file = self.container.file();
            let listed = match file.dataset(&format!("{}axis-{index}/axis", folder.path)) {
                Ok(dataset) => self.container.numbers(&dataset)?,
                Err(_) => vec![],
            };
            let read = Axis::new(name, &listed, axis)?;
            Ok(Axis { step: axis.number("scale").or(read.step), unit, ..read })
        });
        array.axes = axes.collect::<Result<_, FormatError>>()?;
        array.last_is_x = true;
        let signal = self.container.file().group(&format!("{}metadata/Signal", folder.path));
        if let Ok(signal) = signal {
            let attributes = self.container.group_attributes(&signal)?;
            let quantity = attributes.text("quantity")?.unwrap_or_default();
            let unit = quantity.rsplit_once('(').and_then(|(_, unit)| unit.split(')').next());
            array.unit = unit.map(Unit::parse);
        }
        Ok(())
    }

    /// Sets the sides that the root group states for all fields of a Tamaas model.
    fn tamaas(&self, array: &mut Array) {
        let [.., x_side, y_side] = *self.root.numbers("system_size") else { return };
        let [.., x_nodes, y_nodes] = *self.root.numbers("discretization") else { return };
        let long = |axis: &usize| array.shape[*axis] > 1;
        let mut long = (0..array.shape.len()).filter(long);
        let (Some(x), Some(y)) = (long.next(), long.next()) else { return };
        let is_model = [array.shape[x], array.shape[y]].map(|count| count as f64);
        let is_known = array.axes[x].step.is_some() || array.axes[y].step.is_some();
        if is_model == [x_nodes, y_nodes] && !is_known {
            array.axes[x] = Axis::of_side("x", x_side, None);
            array.axes[y] = Axis::of_side("y", y_side, None);
        }
    }
}

/// Returns the lengths of the dimensions of a dataset.
fn lengths(dataset: &Dataset) -> Vec<usize> {
    let whole = |&length: &u64| usize::try_from(length).unwrap_or(usize::MAX);
    dataset.shape().iter().map(whole).collect()
}

impl Folder {
    /// Returns the datasets with the coordinates x and y of the points of a map, if there is one of
    /// each: a list, or an array of the shape of the map.
    fn coordinates(&self) -> Option<[&Dataset; 2]> {
        let find = |wanted| {
            let is_it = |dataset: &&Dataset| {
                let is_number = matches!(
                    dataset.dtype(),
                    Datatype::FixedPoint { .. } | Datatype::FloatingPoint { .. }
                );
                let long = dataset.shape().iter().filter(|&&length| length > 1).count();
                is_number
                    && (1..=2).contains(&long)
                    && Direction::of_name(dataset.name()) == Some(wanted)
            };
            let mut found = self.datasets.iter().filter(is_it);
            found.next().filter(|_| found.next().is_none())
        };
        Some([find(Direction::X)?, find(Direction::Y)?])
    }

    fn is_nexus(&self) -> bool {
        matches!(self.attributes.text("NX_class"), Ok(Some("NXdata")))
    }

    /// Returns the axes y and x that gwyddionpy writes as attributes of the group of a dataset.
    fn gwyddion(&self) -> Result<Option<Vec<Axis>>, FormatError> {
        let sides = ["yreal", "xreal"].map(|name| self.attributes.number(name));
        let [Some(y), Some(x)] = sides else { return Ok(None) };
        let unit = self.attributes.text("si_unit_xy")?.map(Unit::parse);
        Ok(Some(vec![Axis::of_side("y", y, unit.clone()), Axis::of_side("x", x, unit)]))
    }
}
