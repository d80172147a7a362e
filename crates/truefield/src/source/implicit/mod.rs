//! Shapes given by a formula: where it is negative is inside.

mod bend;
mod boxes;
mod expression;
mod foot;
mod interval;
mod jet;
mod matrix;
mod number;
mod residual;
mod search;
mod shape;
mod sheet;
mod tape;
mod taylor;
mod tilt;

pub use expression::{Binary, Expression, Unary};
pub use shape::Implicit;
pub use tape::Tape;
