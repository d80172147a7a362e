//! Pages: parts of a tree that fields share, and that an edit replaces as a whole.

use crate::geom::{DVec3, Interval};

/// Depth of the cells that are the roots of pages: branches there are kept in pages of their own.
pub(crate) const PAGE_DEPTH: u32 = 4;

/// What is stored of every cell, inner ones too.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Record {
    /// Values at the corners: bit 0 of the number picks high x, bit 1 high y, bit 2 high z.
    pub corners: [f32; 8],
    /// At most the least distance minus interpolated corners in the cell.
    pub lower: f32,
    /// At least the largest distance minus interpolated corners in the cell.
    pub upper: f32,
}

impl Record {
    /// Contains the distance minus the interpolated corners, everywhere in the cell.
    pub fn error(&self) -> Interval {
        Interval { lower: f64::from(self.lower), upper: f64::from(self.upper) }
    }

    /// Trilinear interpolation; coordinates run from 0 to 1.
    #[inline]
    pub fn value(&self, at: DVec3) -> f64 {
        let c = self.corners.map(f64::from);
        let along = |low: f64, high: f64, part: f64| low + (high - low) * part;
        let row = |a: usize| along(c[a], c[a + 1], at.x);
        along(along(row(0), row(2), at.y), along(row(4), row(6), at.y), at.z)
    }

    /// Slopes of the interpolation along the three axes, per cell.
    #[inline]
    pub fn slopes(&self, at: DVec3) -> DVec3 {
        let c = self.corners.map(f64::from);
        let between = |a: f64, b: f64, part: f64| a + (b - a) * part;
        let slope = |step: usize, first: [usize; 4], u: f64, v: f64| {
            let d = first.map(|low| c[low + step] - c[low]);
            between(between(d[0], d[1], u), between(d[2], d[3], u), v)
        };
        DVec3::new(slope(1, [0, 2, 4, 6], at.y, at.z), slope(2, [0, 1, 4, 5], at.x, at.z), slope(4, [0, 1, 2, 3], at.x, at.y))
    }

    /// No less than the slope of the interpolation anywhere in a cell of this size.
    pub(crate) fn steepest(&self, size: DVec3) -> f64 {
        let c = self.corners.map(f64::from);
        let along = |axis: usize| {
            let step = 1 << axis;
            (0..8).filter(|corner| corner & step == 0).map(|low| (c[low + step] - c[low]).abs()).fold(0.0, f64::max)
        };
        (DVec3::new(along(0), along(1), along(2)) / size).length()
    }

    /// Least and largest corner.
    pub fn range(&self) -> Interval {
        let fold = |f: fn(f32, f32) -> f32| f64::from(self.corners.iter().copied().fold(self.corners[0], f));
        Interval { lower: fold(f32::min), upper: fold(f32::max) }
    }
}

/// What a cell is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Its children follow each other in the page, from this number on.
    Branch(u32),
    /// The record says all.
    Linear,
    /// Number of its samples in the page.
    Cubic(u32),
    /// Number of its list in the page.
    Exact(u32),
    /// Number of the page whose root it is.
    Portal(u32),
}

const SHIFT: u32 = 29;

/// A [`Kind`] in four bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Word(u32);

impl Word {
    pub fn kind(self) -> Kind {
        let number = self.0 & ((1 << SHIFT) - 1);
        match self.0 >> SHIFT {
            0 => Kind::Branch(number),
            1 => Kind::Linear,
            2 => Kind::Cubic(number),
            3 => Kind::Exact(number),
            _ => Kind::Portal(number),
        }
    }
}

impl From<Kind> for Word {
    fn from(kind: Kind) -> Self {
        let (tag, number) = match kind {
            Kind::Branch(number) => (0, number),
            Kind::Linear => (1, 0),
            Kind::Cubic(number) => (2, number),
            Kind::Exact(number) => (3, number),
            Kind::Portal(number) => (4, number),
        };
        debug_assert!(number < 1 << SHIFT);
        Self(tag << SHIFT | number)
    }
}

/// The side of all points of an exact leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ListSide {
    /// It may have points of both sides.
    #[default]
    Asked,
    /// No triangle touches it, and it lies inside.
    Inside,
    /// No triangle touches it, and it lies outside.
    Outside,
}

/// Triangle lists, one after the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lists {
    /// Where each list ends in `triangles`; it starts where the one before ends.
    pub ends: Vec<u32>,
    /// The side of each list's leaf.
    pub sides: Vec<ListSide>,
    /// Numbers of triangles of the surface.
    pub triangles: Vec<u32>,
}

impl Lists {
    /// Adds a list and returns its number.
    pub fn push(&mut self, side: ListSide, triangles: &[u32]) -> usize {
        self.add(side, triangles.iter().copied())
    }

    /// Adds all lists of others.
    pub(crate) fn append(&mut self, others: &Self) {
        let before = self.triangles.len() as u32;
        self.triangles.extend_from_slice(&others.triangles);
        self.sides.extend_from_slice(&others.sides);
        self.ends.extend(others.ends.iter().map(|end| before + end));
    }

    /// [`Lists::push`] of what is not an array yet.
    pub(crate) fn add(&mut self, side: ListSide, triangles: impl Iterator<Item = u32>) -> usize {
        self.triangles.extend(triangles);
        self.ends.push(self.triangles.len() as u32);
        self.sides.push(side);
        self.ends.len() - 1
    }

    /// A list and the side of its leaf. An empty list stands for all triangles.
    pub fn get(&self, number: usize) -> (ListSide, &[u32]) {
        let start = number.checked_sub(1).map_or(0, |before| self.ends[before]);
        (self.sides[number], &self.triangles[start as usize..self.ends[number] as usize])
    }

    /// Bytes taken.
    pub fn bytes(&self) -> u64 {
        (self.ends.len() * 5 + self.triangles.len() * 4) as u64
    }
}

/// Samples of a tricubic leaf at thirds of its edges, x slowest and z fastest.
pub type Samples = [f32; 64];

/// A part of a tree: its cells level by level, siblings side by side.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Page {
    pub words: Vec<Word>,
    pub records: Vec<Record>,
    pub cubics: Vec<Samples>,
    pub lists: Lists,
}

impl Page {
    /// Adds a cell whose kind is still to be set.
    pub fn push(&mut self, record: Record) -> usize {
        self.words.push(Word::from(Kind::Linear));
        self.records.push(record);
        self.words.len() - 1
    }

    /// Bytes taken.
    pub fn bytes(&self) -> u64 {
        (size_of::<Self>() + self.words.len() * 4 + self.records.len() * size_of::<Record>() + self.cubics.len() * size_of::<Samples>())
            as u64
            + self.lists.bytes()
    }
}
