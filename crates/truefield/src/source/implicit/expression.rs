//! Formulas of x, y and z, as they are written down.

use std::ops::{Add, Div, Mul, Neg, Sub};
use std::sync::Arc;

/// A formula of x, y and z. Cheap to copy: parts are shared, and a part that is used twice is computed once.
#[derive(Clone, Debug)]
pub struct Expression(pub(super) Arc<Node>);

/// One operation and what it works on.
#[derive(Debug)]
pub(super) enum Node {
    Constant(f64),
    Axis(u8),
    Unary(Unary, Expression),
    Power(Expression, i32),
    Binary(Binary, Expression, Expression),
}

/// Functions of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Unary {
    /// -a
    Negative,
    /// |a|
    Absolute,
    /// a a
    Square,
    /// The root, of numbers that are not negative.
    SquareRoot,
    /// The sine of radians.
    Sine,
    /// The cosine of radians.
    Cosine,
    /// The tangent of radians.
    Tangent,
    /// The angle of a tangent, from -pi/2 to pi/2.
    ArcTangent,
    /// e to the power of a.
    Exponential,
    /// The natural logarithm, of positive numbers.
    Logarithm,
    /// The largest whole number that is not above a.
    Floor,
}

/// Functions of two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Binary {
    /// a + b
    Add,
    /// a - b
    Subtract,
    /// a b
    Multiply,
    /// a / b
    Divide,
    /// The lesser.
    Minimum,
    /// The greater.
    Maximum,
    /// The angle of the point (b, a), from -pi to pi.
    ArcTangent2,
}

impl Expression {
    /// A number.
    pub fn constant(value: f64) -> Self {
        Self(Arc::new(Node::Constant(value)))
    }

    /// x, y and z.
    pub fn axes() -> [Self; 3] {
        [0, 1, 2].map(|axis| Self(Arc::new(Node::Axis(axis))))
    }

    /// A function of this.
    #[must_use]
    pub fn unary(&self, function: Unary) -> Self {
        Self(Arc::new(Node::Unary(function, self.clone())))
    }

    /// A function of this and another.
    #[must_use]
    pub fn binary(&self, function: Binary, other: &Self) -> Self {
        if function == Binary::Multiply && Arc::ptr_eq(&self.0, &other.0) {
            return self.unary(Unary::Square);
        }
        Self(Arc::new(Node::Binary(function, self.clone(), other.clone())))
    }

    /// This to a whole power.
    #[must_use]
    pub fn power(&self, exponent: i32) -> Self {
        match exponent {
            0 => Self::constant(1.0),
            1 => self.clone(),
            2 => self.unary(Unary::Square),
            _ => Self(Arc::new(Node::Power(self.clone(), exponent))),
        }
    }
}

impl Node {
    /// What it works on, in order.
    pub(super) fn parts(&self) -> impl Iterator<Item = &Expression> {
        let (first, second) = match self {
            Self::Constant(_) | Self::Axis(_) => (None, None),
            Self::Unary(_, a) | Self::Power(a, _) => (Some(a), None),
            Self::Binary(_, a, b) => (Some(a), Some(b)),
        };
        first.into_iter().chain(second)
    }
}

impl Drop for Expression {
    /// A sum of a million terms is a million deep: parts are let go one after another and not inside each other.
    fn drop(&mut self) {
        fn children(node: &mut Node) -> [Option<&mut Expression>; 2] {
            match node {
                Node::Constant(_) | Node::Axis(_) => [None, None],
                Node::Unary(_, a) | Node::Power(a, _) => [Some(a), None],
                Node::Binary(_, a, b) => [Some(a), Some(b)],
            }
        }
        let Some(node) = Arc::get_mut(&mut self.0) else { return };
        if node.parts().next().is_none() {
            return;
        }
        let leaf = Self::constant(0.0);
        let mut pending: Vec<Self> = Vec::new();
        let take = |node: &mut Node, pending: &mut Vec<Self>| {
            for child in children(node).into_iter().flatten() {
                // What others still hold, or has no parts, goes without help.
                if Arc::strong_count(&child.0) == 1 && child.0.parts().next().is_some() {
                    pending.push(std::mem::replace(child, leaf.clone()));
                }
            }
        };
        take(node, &mut pending);
        while let Some(mut next) = pending.pop() {
            if let Some(node) = Arc::get_mut(&mut next.0) {
                take(node, &mut pending);
            }
        }
    }
}

macro_rules! operator {
    ($operation:ident, $method:ident, $function:expr) => {
        impl $operation for &Expression {
            type Output = Expression;
            fn $method(self, other: Self) -> Expression {
                self.binary($function, other)
            }
        }
        impl $operation for Expression {
            type Output = Expression;
            fn $method(self, other: Self) -> Expression {
                self.binary($function, &other)
            }
        }
        impl $operation<f64> for Expression {
            type Output = Expression;
            fn $method(self, other: f64) -> Expression {
                self.binary($function, &Expression::constant(other))
            }
        }
    };
}

operator!(Add, add, Binary::Add);
operator!(Sub, sub, Binary::Subtract);
operator!(Mul, mul, Binary::Multiply);
operator!(Div, div, Binary::Divide);

impl Neg for Expression {
    type Output = Self;
    fn neg(self) -> Self {
        self.unary(Unary::Negative)
    }
}
