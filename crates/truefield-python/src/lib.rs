//! The Python extension module `truefield._truefield`: convert, one door, convert back.

use pyo3::prelude::*;

#[pymodule]
fn _truefield(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))
}
