//! A formula as a list of operations: equal parts once, each after what it works on.

use std::collections::HashMap;
use std::sync::Arc;

use super::expression::{Binary, Expression, Node, Unary};
use super::jet::Jet;
use super::number::Number;
use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Interval};
use crate::run::Run;

/// Points that are evaluated together: an operation is looked up once for all of them.
const BLOCK: usize = 64;

/// Points that one thread takes at a time.
const POINTS: usize = 4096;

/// More operations than this are refused: a formula of that length is a program that went wrong.
const LONGEST: usize = 1 << 20;

/// One operation; its operands are numbers of operations before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Operation {
    /// The bits of a number.
    Constant(u64),
    Axis(u8),
    Unary(Unary, u32),
    Power(u32, i32),
    Binary(Binary, u32, u32),
}

/// The operations of a formula; the last one is its value.
#[derive(Clone, Debug)]
pub struct Tape(Vec<Operation>);

impl Tape {
    /// The operations of `expression`; equal parts are computed once. O(n).
    pub fn new(expression: &Expression) -> Result<Self> {
        let mut operations = Vec::new();
        let mut known: HashMap<Operation, u32> = HashMap::new();
        let mut places: HashMap<*const Node, u32> = HashMap::new();
        let mut pending = vec![expression];
        while let Some(next) = pending.last().copied() {
            let key = Arc::as_ptr(&next.0);
            if places.contains_key(&key) {
                pending.pop();
                continue;
            }
            let before = pending.len();
            pending.extend(next.0.parts().filter(|part| !places.contains_key(&Arc::as_ptr(&part.0))));
            if pending.len() > before {
                continue;
            }
            pending.pop();
            let place = |part: &Expression| places[&Arc::as_ptr(&part.0)];
            let operation = match &*next.0 {
                Node::Constant(value) if !value.is_finite() => {
                    return Err(Error::invalid(format!("the expression has {value} in it; all its numbers must be finite")));
                }
                Node::Constant(value) => Operation::Constant(value.to_bits()),
                Node::Axis(axis) => Operation::Axis(*axis),
                Node::Unary(function, a) => Operation::Unary(*function, place(a)),
                Node::Power(a, exponent) => Operation::Power(place(a), *exponent),
                Node::Binary(function, a, b) => tidy(*function, place(a), place(b)),
            };
            let place = *known.entry(operation).or_insert_with(|| {
                operations.push(operation);
                (operations.len() - 1) as u32
            });
            if operations.len() > LONGEST {
                return Err(Error::invalid(format!("the expression has more than {LONGEST} operations; make a simpler one")));
            }
            places.insert(key, place);
        }
        // Equal parts may leave the value elsewhere than at the end.
        let value = places[&Arc::as_ptr(&expression.0)] as usize;
        operations.truncate(value + 1);
        Ok(Self(operations))
    }

    /// The number of operations.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Never: a formula has a value.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The formula's values at many points; what is not defined there is not a number.
    pub fn values(&self, points: &[DVec3], run: &Run<'_>) -> Result<Vec<f64>> {
        let mut out = vec![0.0; points.len()];
        run.chunks("values", &mut out, POINTS, |chunk, out| {
            self.values_into(&points[chunk * POINTS..][..out.len()], out);
            Ok(())
        })?;
        Ok(out)
    }

    /// [`Tape::values`] on this thread; `out` is as long as `points`.
    pub fn values_into(&self, points: &[DVec3], out: &mut [f64]) {
        let mut slots = vec![[0.0; BLOCK]; self.0.len()];
        for (points, out) in points.chunks(BLOCK).zip(out.chunks_mut(BLOCK)) {
            for (index, &operation) in self.0.iter().enumerate() {
                let (before, rest) = slots.split_at_mut(index);
                let slot = &mut rest[0];
                match operation {
                    Operation::Constant(bits) => *slot = [f64::from_bits(bits); BLOCK],
                    Operation::Axis(axis) => {
                        for (slot, p) in slot.iter_mut().zip(points) {
                            *slot = p[usize::from(axis)];
                        }
                    }
                    Operation::Unary(function, a) => each(slot, &before[a as usize], function),
                    Operation::Power(a, exponent) => {
                        for (slot, &a) in slot.iter_mut().zip(&before[a as usize]) {
                            *slot = a.powi(exponent);
                        }
                    }
                    Operation::Binary(function, a, b) => both(slot, &before[a as usize], &before[b as usize], function),
                }
            }
            if let Some(last) = slots.last() {
                out.copy_from_slice(&last[..out.len()]);
            }
        }
    }

    /// The formula's value at one point.
    pub(super) fn value(&self, p: DVec3) -> f64 {
        self.run(&p.to_array(), &mut Vec::new())
    }

    /// Contains the formula's value at one point, whatever rounding does.
    pub(super) fn certain(&self, p: DVec3) -> Interval {
        self.run(&p.to_array().map(Interval::exact), &mut Vec::new())
    }

    /// Contains the formula's values over a box.
    pub fn over(&self, cell: &Aabb) -> Interval {
        self.run(&sides(cell), &mut Vec::new())
    }

    /// Value and derivatives at one point, in plain numbers.
    pub(super) fn jet<const H: usize>(&self, p: DVec3) -> Jet<f64, H> {
        let coordinates = p.to_array();
        self.run(&std::array::from_fn(|axis| Jet::axis(axis, coordinates[axis])), &mut Vec::new())
    }

    /// Contains value and derivatives everywhere in a box.
    pub(super) fn jet_over<const H: usize>(&self, cell: &Aabb) -> Jet<Interval, H> {
        let sides = sides(cell);
        self.run(&std::array::from_fn(|axis| Jet::axis(axis, sides[axis])), &mut Vec::new())
    }

    /// Contains the gradient over a box.
    pub fn slopes(&self, cell: &Aabb) -> [Interval; 3] {
        self.jet_over::<0>(cell).gradient
    }

    /// Contains the second derivatives over a box: xx, yy, zz, xy, xz, yz.
    pub fn bends(&self, cell: &Aabb) -> [Interval; 6] {
        self.jet_over::<6>(cell).hessian
    }

    /// The gradient at a point, in plain numbers.
    pub fn gradient(&self, p: DVec3) -> DVec3 {
        DVec3::from_array(self.jet::<0>(p).gradient)
    }

    fn run<N: Number>(&self, axes: &[N; 3], slots: &mut Vec<N>) -> N {
        slots.reserve(self.0.len());
        for &operation in &self.0 {
            let at = |index: u32| slots[index as usize];
            let value = match operation {
                Operation::Constant(bits) => N::constant(f64::from_bits(bits)),
                Operation::Axis(axis) => axes[usize::from(axis)],
                Operation::Unary(function, a) => unary(at(a), function),
                Operation::Power(a, exponent) => at(a).power(exponent),
                Operation::Binary(function, a, b) => binary(at(a), at(b), function),
            };
            slots.push(value);
        }
        slots[self.0.len() - 1]
    }
}

/// The order of operands that may change places does not make two operations of one.
fn tidy(function: Binary, a: u32, b: u32) -> Operation {
    match function {
        Binary::Multiply if a == b => Operation::Unary(Unary::Square, a),
        Binary::Add | Binary::Multiply => Operation::Binary(function, a.min(b), a.max(b)),
        _ => Operation::Binary(function, a, b),
    }
}

fn sides(cell: &Aabb) -> [Interval; 3] {
    std::array::from_fn(|axis| Interval { lower: cell.min[axis], upper: cell.max[axis] })
}

fn unary<N: Number>(a: N, function: Unary) -> N {
    match function {
        Unary::Negative => a.neg(),
        Unary::Absolute => a.abs(),
        Unary::Square => a.square(),
        Unary::SquareRoot => a.sqrt(),
        Unary::Sine => a.sin(),
        Unary::Cosine => a.cos(),
        Unary::Tangent => a.tan(),
        Unary::ArcTangent => a.atan(),
        Unary::Exponential => a.exp(),
        Unary::Logarithm => a.ln(),
        Unary::Floor => a.floor(),
    }
}

fn binary<N: Number>(a: N, b: N, function: Binary) -> N {
    match function {
        Binary::Add => a.add(b),
        Binary::Subtract => a.sub(b),
        Binary::Multiply => a.mul(b),
        Binary::Divide => a.div(b),
        Binary::Minimum => a.min(b),
        Binary::Maximum => a.max(b),
        Binary::ArcTangent2 => a.atan2(b),
    }
}

/// One function of a block; the choice is made once, outside the loop.
fn each(slot: &mut [f64; BLOCK], a: &[f64; BLOCK], function: Unary) {
    macro_rules! loops {
        ($($name:ident),*) => {
            match function {
                $(Unary::$name => for (slot, &a) in slot.iter_mut().zip(a) { *slot = unary(a, Unary::$name); },)*
            }
        };
    }
    loops!(Negative, Absolute, Square, SquareRoot, Sine, Cosine, Tangent, ArcTangent, Exponential, Logarithm, Floor);
}

/// [`each`] of two blocks.
fn both(slot: &mut [f64; BLOCK], a: &[f64; BLOCK], b: &[f64; BLOCK], function: Binary) {
    macro_rules! loops {
        ($($name:ident),*) => {
            match function {
                $(Binary::$name => for ((slot, &a), &b) in slot.iter_mut().zip(a).zip(b) { *slot = binary(a, b, Binary::$name); },)*
            }
        };
    }
    loops!(Add, Subtract, Multiply, Divide, Minimum, Maximum, ArcTangent2);
}
