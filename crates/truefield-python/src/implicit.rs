//! `Expression`, and shapes of expressions and of Python functions.

use std::sync::{Mutex, PoisonError};

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use truefield::source::function::{Callback, Function, Meaning};
use truefield::source::implicit::{Binary, Expression, Implicit, Tape, Unary};
use truefield::{Aabb, DVec3, Error};

use crate::convert::{column, points, rows};
use crate::door::{Threads, job, raise};
use crate::shape::PyShape;

/// A formula of x, y and z; see `truefield.implicit.Expression`.
#[pyclass(name = "Expression", module = "truefield._truefield", frozen)]
pub struct PyExpression(Expression);

fn unary(name: &str) -> Option<Unary> {
    Some(match name {
        "negative" => Unary::Negative,
        "absolute" => Unary::Absolute,
        "square" => Unary::Square,
        "sqrt" => Unary::SquareRoot,
        "sin" => Unary::Sine,
        "cos" => Unary::Cosine,
        "tan" => Unary::Tangent,
        "arctan" => Unary::ArcTangent,
        "exp" => Unary::Exponential,
        "log" => Unary::Logarithm,
        "floor" => Unary::Floor,
        _ => return None,
    })
}

fn binary(name: &str) -> Option<Binary> {
    Some(match name {
        "add" => Binary::Add,
        "subtract" => Binary::Subtract,
        "multiply" => Binary::Multiply,
        "divide" => Binary::Divide,
        "minimum" => Binary::Minimum,
        "maximum" => Binary::Maximum,
        "arctan2" => Binary::ArcTangent2,
        _ => return None,
    })
}

fn unknown(name: &str) -> PyErr {
    raise(Error::invalid(format!("there is no function {name:?} of expressions")))
}

#[pymethods]
impl PyExpression {
    #[staticmethod]
    fn axes() -> [Self; 3] {
        Expression::axes().map(Self)
    }

    #[staticmethod]
    fn constant(value: f64) -> Self {
        Self(Expression::constant(value))
    }

    fn unary(&self, name: &str) -> PyResult<Self> {
        Ok(Self(self.0.unary(unary(name).ok_or_else(|| unknown(name))?)))
    }

    fn binary(&self, name: &str, other: &Self) -> PyResult<Self> {
        Ok(Self(self.0.binary(binary(name).ok_or_else(|| unknown(name))?, &other.0)))
    }

    fn power(&self, exponent: i32) -> Self {
        Self(self.0.power(exponent))
    }

    #[pyo3(signature = (points, threads=None, progress=None))]
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        threads: Option<Threads>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let points = self::points(&points)?;
        let values = job(py, threads, progress, |run| Tape::new(&self.0)?.values(&points, run))?;
        Ok(column(py, values.into_iter()))
    }

    /// The solid where it is negative, within a box.
    #[pyo3(signature = (low, high, threads=None, progress=None))]
    fn shape(
        &self,
        py: Python<'_>,
        low: [f64; 3],
        high: [f64; 3],
        threads: Option<Threads>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyShape> {
        let domain = Aabb::new(DVec3::from_array(low), DVec3::from_array(high));
        job(py, threads, progress, |run| Implicit::new(&self.0, domain, run)).map(PyShape::of)
    }
}

/// What functions raised, by the sentence that says so; the door takes it out as the cause of its exception.
static RAISED: Mutex<Vec<(String, PyErr)>> = Mutex::new(Vec::new());

/// The exception that a function raised, if that is what `sentence` says.
pub fn cause(py: Python<'_>, sentence: &str) -> Option<PyErr> {
    let raised = RAISED.lock().unwrap_or_else(PoisonError::into_inner);
    raised.iter().rev().find(|(known, _)| known == sentence).map(|(_, error)| error.clone_ref(py))
}

/// A Python function of points.
struct PyFunction(Py<PyAny>);

impl PyFunction {
    fn call(&self, py: Python<'_>, points: &[DVec3]) -> PyResult<Vec<f64>> {
        let array = rows(py, points.iter().copied())?;
        let answer = self.0.bind(py).call1((array,))?;
        let answer = py.import("numpy")?.call_method1("ascontiguousarray", (answer, "float64"))?;
        let shape: Vec<usize> = answer.getattr("shape")?.extract()?;
        if shape != [points.len()] {
            let count = points.len();
            return Err(raise(Error::invalid(format!(
                "the function answers {count} points of shape ({count}, 3) with an array of shape {shape:?}; give one number each, ({count},)"
            ))));
        }
        let values: PyReadonlyArray1<'_, f64> = answer.extract()?;
        Ok(values.as_slice().map_err(|_| raise(Error::invalid("the function's numbers must be C-contiguous")))?.to_vec())
    }
}

impl Callback for PyFunction {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> truefield::Result<()> {
        Python::attach(|py| match self.call(py, points) {
            Ok(values) => {
                out.copy_from_slice(&values);
                Ok(())
            }
            Err(error) => {
                let kind = error.get_type(py).name().map_or_else(|_| "an exception".to_owned(), |name| name.to_string());
                let sentence = if kind == "TruefieldError" {
                    error.value(py).to_string()
                } else {
                    format!("the function raised {kind}: {}", error.value(py))
                };
                let mut raised = RAISED.lock().unwrap_or_else(PoisonError::into_inner);
                // The latest few: every failure is asked for soon after.
                if raised.len() >= 16 {
                    raised.remove(0);
                }
                raised.push((sentence.clone(), error));
                Err(Error::Invalid(sentence))
            }
        })
    }
}

/// A vectorised function of (n, 3) points as a shape; `values` is "bound" or "distance".
#[pyfunction]
pub fn function_shape(function: Py<PyAny>, lipschitz: f64, domain: Option<([f64; 3], [f64; 3])>, values: &str) -> PyResult<PyShape> {
    let meaning = match values {
        "bound" => Meaning::Bound,
        "distance" => Meaning::Distance,
        _ => return Err(raise(Error::invalid(format!("values is {values:?}; choose \"bound\" or \"distance\"")))),
    };
    let domain = domain.map(|(low, high)| Aabb::new(DVec3::from_array(low), DVec3::from_array(high)));
    Function::new(PyFunction(function), lipschitz, domain, meaning).map(PyShape::of).map_err(raise)
}
