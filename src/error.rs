//! What can go wrong while pairs are searched.

use crate::AlgorithmId;
use std::fmt;

/// Why a broad phase gave no answer. The list of pairs is unspecified after an error and valid again after the next success.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// A box that no algorithm can order.
    InvalidBox {
        /// Position of the first such box in the input.
        index: usize,
        /// What is wrong with it.
        defect: BoxDefect,
    },
    /// More boxes than pair members of 32 bits can name.
    TooManyObjects {
        /// Boxes in the input.
        objects: usize,
    },
    /// More pairs than [`Pairs::set_limit`](crate::Pairs::set_limit) allows.
    TooManyPairs {
        /// The limit that was set.
        limit: usize,
        /// Overlapping pairs in the input that the [`Filter`](crate::Filter) wants, all counted.
        pairs: u64,
    },
    /// A pair has a member that has no id in [`Changes::update`](crate::Changes::update).
    MissingId {
        /// The position of the member in the input.
        position: u32,
        /// Ids that were given.
        ids: usize,
    },
    /// An allocation was refused.
    OutOfMemory {
        /// What the memory was for.
        what: &'static str,
        /// Elements that were asked for.
        elements: usize,
    },
    /// The algorithm is known but can't run here.
    Unavailable {
        /// The algorithm that was asked for.
        algorithm: AlgorithmId,
        /// Why it can't run.
        reason: String,
    },
    /// No algorithm of this name is registered.
    UnknownAlgorithm {
        /// The text that was given.
        text: String,
        /// What would have been accepted.
        hint: String,
    },
}

/// What makes a box invalid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BoxDefect {
    /// A bound is not a number.
    NotANumber,
    /// A minimum lies above its maximum.
    Inverted,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::InvalidBox { index, defect } => {
                let what = match defect {
                    BoxDefect::NotANumber => "has a bound that is not a number (NaN)",
                    BoxDefect::Inverted => "is inverted: a minimum lies above its maximum",
                };
                write!(f, "box {index} {what}; correct or leave out this box")
            }
            Error::TooManyObjects { objects } => {
                write!(
                    f,
                    "{objects} boxes are more than the {} that 32-bit pair members can name; split the scene",
                    u32::MAX
                )
            }
            Error::TooManyPairs { limit, pairs } => {
                write!(f, "{pairs} pairs overlap, more than the limit of {limit}; raise the limit or thin out the scene")
            }
            Error::MissingId { position, ids } => {
                write!(f, "box {position} is in a pair and has no id: {ids} were given; give one for each box")
            }
            Error::OutOfMemory { what, elements } => {
                write!(f, "no memory for {elements} {what}; set a limit on the pairs or use fewer boxes")
            }
            Error::Unavailable { algorithm, reason } => {
                write!(f, "{algorithm} can't run here: {reason}")
            }
            Error::UnknownAlgorithm { text, hint } => {
                write!(f, "no algorithm is called {text:?}; {hint}")
            }
        }
    }
}

impl std::error::Error for Error {}
