//! Contact of one surface under a sequence of loads.

use std::sync::{Mutex, MutexGuard};

use asperity::direct;
use asperity::session::error::StageError;
use asperity_mechanics::threads::available_cores;
use numpy::PyArray2;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::conversion::{self, HeightMap};
use crate::errors::{direct_error, surface_error};
use crate::interruption::Signals;
use crate::table::Table;

/// Surface with its loads, which are solved one after the other on request.
#[pyclass(frozen, module = "asperity._asperity")]
pub struct Pressing(Mutex<direct::Pressing>);

impl Pressing {
    fn lock(&self) -> MutexGuard<'_, direct::Pressing> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    fn field<'py, T: numpy::Element>(
        &self,
        py: Python<'py>,
        load: usize,
        of: impl FnOnce(&mut direct::Pressing) -> Option<Vec<T>> + Send,
    ) -> PyResult<Bound<'py, PyArray2<T>>> {
        let (values, nodes) = py.detach(|| {
            let mut pressing = self.lock();
            (of(&mut pressing), pressing.grid().nodes())
        });
        conversion::map(py, values.ok_or_else(|| not_available(load))?, nodes)
    }
}

#[pymethods]
impl Pressing {
    #[new]
    #[expect(clippy::too_many_arguments, reason = "the Python package passes all arguments")]
    fn new(
        py: Python<'_>,
        heights: HeightMap<'_>,
        unit: Option<String>,
        rms_slope: Option<f64>,
        is_periodic: bool,
        keys: &Bound<'_, PyDict>,
        keeps_fields: bool,
        jobs: Option<usize>,
    ) -> PyResult<Pressing> {
        let keys = conversion::keys(keys)?;
        let map = direct::Map {
            surface: conversion::surface(py, &heights)?,
            unit: unit.unwrap_or_default(),
            rms_slope,
            is_periodic,
        };
        let cores = conversion::jobs(py, jobs)?.unwrap_or_else(available_cores);
        let prepared = py.detach(|| direct::Pressing::new_on(cores, map, &keys));
        let mut pressing = prepared.map_err(|error| direct_error(py, &error))?;
        if !keeps_fields {
            pressing = pressing.without_fields();
        }
        Ok(Pressing(Mutex::new(pressing)))
    }

    /// Solves the next load, or returns false if there is none.
    fn press(&self, py: Python<'_>) -> PyResult<bool> {
        let (pressed, signals) = py.detach(|| {
            let signals = Signals::new();
            let pressed = self.lock().press(&|| signals.received());
            (pressed, signals.exception())
        });
        match (pressed, signals) {
            (Ok(is_solved), None) => Ok(is_solved),
            (Err(StageError::Interrupted), Some(exception)) | (Ok(_), Some(exception)) => {
                Err(exception)
            }
            (Err(error), _) => Err(surface_error(py, &error)),
        }
    }

    /// Returns the number of solved loads.
    fn count(&self, py: Python<'_>) -> usize {
        py.detach(|| self.lock().count())
    }

    /// Returns the table of partial slip, or `None` without friction.
    fn partial_slip(&self, py: Python<'_>) -> PyResult<Option<Table>> {
        let table = py.detach(|| self.lock().partial_slip());
        Ok(table.map_err(|error| surface_error(py, &error))?.map(Table::from))
    }

    fn table(&self, py: Python<'_>) -> PyResult<Table> {
        let table = py.detach(|| self.lock().table());
        Ok(Table::from(table.map_err(|error| surface_error(py, &error))?))
    }

    /// Returns the warnings about the contact.
    fn warnings(&self, py: Python<'_>) -> Vec<String> {
        py.detach(|| self.lock().warnings().to_vec())
    }

    fn contact<'py>(&self, py: Python<'py>, load: usize) -> PyResult<Bound<'py, PyArray2<bool>>> {
        self.field(py, load, |pressing| pressing.contact(load))
    }

    fn repulsive<'py>(&self, py: Python<'py>, load: usize) -> PyResult<Bound<'py, PyArray2<bool>>> {
        self.field(py, load, |pressing| pressing.repulsive(load))
    }

    fn pressure<'py>(&self, py: Python<'py>, load: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.field(py, load, |pressing| pressing.pressure(load))
    }

    fn displacement<'py>(
        &self,
        py: Python<'py>,
        load: usize,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.field(py, load, |pressing| pressing.displacement(load))
    }

    fn gap<'py>(&self, py: Python<'py>, load: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.field(py, load, |pressing| pressing.gap(load))
    }
}

/// Returns the heights of a second rough surface where they are added to those of the first one.
#[pyfunction]
pub fn placed<'py>(
    py: Python<'py>,
    heights: HeightMap<'py>,
    keys: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let keys = conversion::keys(keys)?;
    let surface = conversion::surface(py, &heights)?;
    let nodes = surface.grid().nodes();
    let placed =
        py.detach(|| direct::placed(surface, &keys)).map_err(|error| direct_error(py, &error))?;
    conversion::map(py, placed.into_heights(), nodes)
}

fn not_available(load: usize) -> PyErr {
    PyIndexError::new_err(format!(
        "no map for load {load}: the load is not solved yet, or `fields=False` was given, which stores \
         contact maps only"
    ))
}
