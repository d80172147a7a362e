//! One error enum: every message names the input, what is wrong with it and what to do.

use std::fmt;

/// What a truefield function returns.
pub type Result<T> = std::result::Result<T, Error>;

/// Why a truefield function could not answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Error {
    /// An argument or a shape cannot be used; the sentence says which and what to do.
    Invalid(String),
    /// The job would need more memory than it may take.
    Memory {
        /// What was asked for, in words.
        what: String,
        /// Estimated need in bytes.
        needed: u64,
        /// What was allowed in bytes.
        allowed: u64,
    },
    /// A stored field is damaged, truncated or of another version.
    Format(String),
    /// The caller asked the job to stop.
    Cancelled,
}

impl Error {
    /// An [`Error::Invalid`] from anything that reads as a sentence.
    pub fn invalid(sentence: impl Into<String>) -> Self {
        Self::Invalid(sentence.into())
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Invalid(sentence) | Self::Format(sentence) => f.write_str(sentence),
            Self::Memory { what, needed, allowed } => write!(
                f,
                "{what} would need about {:.1} MiB but only {:.1} MiB are allowed; choose a coarser resolution or a larger budget",
                *needed as f64 / 1_048_576.0,
                *allowed as f64 / 1_048_576.0
            ),
            Self::Cancelled => f.write_str("cancelled"),
        }
    }
}

impl std::error::Error for Error {}
