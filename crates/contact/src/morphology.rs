//! Morphology: what the contact of two surfaces looks like, seen as a map of the nodes that touch.
//!
//! - [`map`] holds one bit a node;
//! - [`area`] counts the area and the switches between contact and gap, from which the perimeter
//!   follows, and estimates the area of the smooth contact from both;
//! - [`clusters`] finds connected contacts, and connected gaps.

pub mod area;
pub mod clusters;
pub mod map;
