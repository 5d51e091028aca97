//! Columns of measured surfaces.

use super::{integer, parameter, parameter_integer, parameter_text, text};
use asperity_tables::column::Column;

pub const CONTENT: Column = parameter_text("content", "hash of the measured surface's file");
pub const UNIT: Column = parameter_text("unit", "unit of length of the measured surface");
pub const EDGES: Column = parameter_text("edges", "how the map's edges are made to meet");
pub const HEIGHT_SCALE: Column =
    parameter("height_scale", "1", "factor from the file's heights to lengths");
pub const TAPER_FRACTION: Column =
    parameter("taper_fraction", "1", "share of the side over which heights fade at each edge");
pub const CHANNEL: Column = parameter_text(
    "channel",
    "which map of the file was asked for, by its name, or by its number from 1 on",
);
pub const CROP_FROM_X: Column = parameter(
    "crop_from_x",
    "length",
    "where the part of the map that was cut out begins along x; `side` is its side, and its nodes lie \
     where they lay",
);
pub const CROP_FROM_Y: Column =
    parameter("crop_from_y", "length", "where the part of the map that was cut out begins along y");
pub const CROP_SIZE_X: Column = parameter(
    "crop_size_x",
    "length",
    "side along x that the part was asked to have, before it was rounded to nodes",
);
pub const CROP_SIZE_Y: Column =
    parameter("crop_size_y", "length", "side along y that the part was asked to have");
pub const LEVEL: Column = parameter_text(
    "level",
    "which form was taken away: the mean, plane or quadric that fits the measured points best, or none",
);
pub const FILL: Column = parameter_text("fill", "how points that were not measured got heights");
pub const HIGH_PASS: Column = parameter(
    "high_pass",
    "length",
    "cutoff above which waves were removed, by the areal Gaussian filter of ISO 16610-61",
);
pub const LOW_PASS: Column = parameter(
    "low_pass",
    "length",
    "cutoff below which waves were removed, by the areal Gaussian filter of ISO 16610-61",
);
pub const RESAMPLED_X: Column = parameter_integer(
    "resampled_x",
    "1",
    "nodes along x that the map was interpolated on, by its Fourier modes",
);
pub const RESAMPLED_Y: Column =
    parameter_integer("resampled_y", "1", "nodes along y that the map was interpolated on");
pub const FORMAT: Column = text("format", "format of the measured surface's file");
pub const CHANNEL_READ: Column = text("channel_read", "name of the map of the file that was read");
pub const CHANNELS: Column = integer("channels", "1", "maps that the file holds");
pub const FILLED_NODES: Column = integer(
    "filled_nodes",
    "1",
    "nodes that were not measured and have the heights that `fill` says",
);

/// What places a measured surface among others, as far as the manifest asks for it.
pub const OF_MEASURED_SURFACES: [Column; 16] = [
    CONTENT,
    UNIT,
    HEIGHT_SCALE,
    EDGES,
    TAPER_FRACTION,
    CHANNEL,
    CROP_FROM_X,
    CROP_FROM_Y,
    CROP_SIZE_X,
    CROP_SIZE_Y,
    LEVEL,
    FILL,
    HIGH_PASS,
    LOW_PASS,
    RESAMPLED_X,
    RESAMPLED_Y,
];

/// What was found in a measured surface's file.
pub const FOUND_IN_FILES: [Column; 4] = [FORMAT, CHANNEL_READ, CHANNELS, FILLED_NODES];
