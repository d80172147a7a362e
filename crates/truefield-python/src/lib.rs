//! The Python extension module `truefield._truefield`: convert, one door, convert back.

// Python has keyword arguments; their number is no burden there.
#![allow(clippy::too_many_arguments)]

mod adaptive;
mod check;
mod contour;
mod convert;
mod csg;
mod door;
mod edit;
mod field;
mod implicit;
mod marching;
mod mesh;
mod patch;
mod products;
mod render;
mod sampled;
mod shape;
mod store;
mod surface;
mod thickness;
mod transform;

use pyo3::prelude::*;

#[pymodule]
fn _truefield(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<surface::PySurface>()?;
    module.add_class::<field::PyCompleteField>()?;
    module.add_class::<sampled::PySampledField>()?;
    module.add_class::<adaptive::PyAdaptiveField>()?;
    module.add_class::<shape::PyShape>()?;
    module.add_class::<implicit::PyExpression>()?;
    module.add_class::<render::PyCamera>()?;
    module.add_class::<render::PyScene>()?;
    module.add_class::<mesh::PyDistinct>()?;
    module.add_function(wrap_pyfunction!(check::check_mesh, module)?)?;
    module.add_function(wrap_pyfunction!(thickness::thickness, module)?)?;
    module.add_function(wrap_pyfunction!(thickness::walls_at, module)?)?;
    module.add_function(wrap_pyfunction!(contour::contour_of, module)?)?;
    module.add_function(wrap_pyfunction!(sampled::sample_of, module)?)?;
    module.add_function(wrap_pyfunction!(transform::distance_transform, module)?)?;
    module.add_function(wrap_pyfunction!(transform::transform_bounds, module)?)?;
    module.add_function(wrap_pyfunction!(transform::skewed_transform, module)?)?;
    module.add_function(wrap_pyfunction!(transform::skewed_bounds, module)?)?;
    module.add_function(wrap_pyfunction!(transform::site_indices, module)?)?;
    module.add_function(wrap_pyfunction!(marching::voxels_of, module)?)?;
    module.add_function(wrap_pyfunction!(marching::marched_samples_of, module)?)?;
    module.add_function(wrap_pyfunction!(marching::wavefront_from, module)?)?;
    module.add_function(wrap_pyfunction!(marching::march_from, module)?)?;
    module.add_function(wrap_pyfunction!(marching::site_difference_of, module)?)?;
    module.add_function(wrap_pyfunction!(implicit::function_shape, module)?)?;
    module.add_function(wrap_pyfunction!(patch::patch_shape, module)?)?;
    module.add_function(wrap_pyfunction!(store::parts_of, module)?)?;
    module.add_function(wrap_pyfunction!(store::field_of, module)?)?;
    module.add_function(wrap_pyfunction!(csg::sphere, module)?)?;
    module.add_function(wrap_pyfunction!(csg::cuboid, module)?)?;
    module.add_function(wrap_pyfunction!(products::cast_rays, module)?)?;
    module.add_function(wrap_pyfunction!(products::occluded_rays, module)?)?;
    module.add_function(wrap_pyfunction!(products::adaptive_nearest, module)?)?;
    module.add_function(wrap_pyfunction!(products::adaptive_surface, module)?)?;
    module.add_function(wrap_pyfunction!(products::collide_solids, module)?)?;
    module.add_function(wrap_pyfunction!(products::field_outline, module)?)?;
    module.add_function(wrap_pyfunction!(products::draw_field, module)?)?;
    module.add_function(wrap_pyfunction!(csg::capsule, module)?)?;
    module.add_function(wrap_pyfunction!(csg::half_space, module)?)?;
    module.add_function(wrap_pyfunction!(csg::frustum, module)?)?;
    module.add_function(wrap_pyfunction!(csg::torus, module)?)?;
    module.add_function(wrap_pyfunction!(csg::ellipsoid, module)?)?;
    module.add_function(wrap_pyfunction!(csg::menger_sponge, module)?)?;
    module.add_function(wrap_pyfunction!(csg::molecule, module)?)?;
    module.add_function(wrap_pyfunction!(csg::union_of, module)?)?;
    module.add_function(wrap_pyfunction!(csg::intersection_of, module)?)?;
    module.add_function(wrap_pyfunction!(csg::difference_of, module)?)?;
    module.add_function(wrap_pyfunction!(csg::tube, module)?)?;
    module.add_function(wrap_pyfunction!(csg::sweep, module)?)?;
    module.add_function(wrap_pyfunction!(edit::edit_field, module)?)?;
    module.add_function(wrap_pyfunction!(edit::less_detail, module)?)?;
    module.add_function(wrap_pyfunction!(edit::merged_samples, module)?)?;
    module.add_function(wrap_pyfunction!(edit::polygon, module)?)?;
    module.add_function(wrap_pyfunction!(edit::levels_of, module)?)?;
    module.add_function(wrap_pyfunction!(edit::field_of_levels, module)?)?;
    Ok(())
}
