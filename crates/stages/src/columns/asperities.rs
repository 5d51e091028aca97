//! Columns of asperity models on the surfaces that are solved.

use super::{integer, parameter_text, real};
use asperity_tables::column::Column;

pub const INTERACTION: Column = parameter_text(
    "interaction",
    "how asperities act on each other, where Hertz' contacts of the summits stand for the solved \
     contact: `none`, `mean-field` or `explicit`; `contact_nodes` and maps are then of the nodes within \
     their ellipses, and `residual` is the largest change of a displacement that one more iteration would \
     make; null where the contact of every node is solved",
);
pub const CONTACTS: Column = integer("contacts", "1", "summits that touch");
pub const OVERLAPPING_CONTACTS: Column =
    integer("overlapping_contacts", "1", "summits that touch on an ellipse that overlaps another");
pub const ASPERITY_AREA_FRACTION: Column = real(
    "asperity_area_fraction",
    "1",
    "sum of the areas of the ellipses over the nominal area; what overlaps counts twice",
);
pub const OVERLAPPING_SHARE: Column = real(
    "overlapping_share",
    "1",
    "share of the ellipses' area in ellipses that overlap another: the model is of contacts that stay \
     apart",
);
pub const NOMINAL_DISPLACEMENT: Column = real(
    "nominal_displacement",
    "length",
    "mean displacement of a square of the cell's area under the mean pressure, by which the reference \
     plane is nearer to the unloaded body; zero without interaction",
);

/// What is known of a load on asperities beyond what solvers tell.
pub const OF_ASPERITIES: [Column; 5] = [
    CONTACTS,
    OVERLAPPING_CONTACTS,
    ASPERITY_AREA_FRACTION,
    OVERLAPPING_SHARE,
    NOMINAL_DISPLACEMENT,
];
