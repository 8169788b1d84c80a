//! Why ranks find no pairs.

use sapwise::error::BoxDefect;

/// Why no rank has pairs of this frame, the same on all ranks. The next frame starts from scratch.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A box that can't be ordered. If several ranks have one, that of the lowest rank.
    #[error("box {index} of rank {rank} {defect}; correct it or leave it out")]
    InvalidBox {
        /// The rank.
        rank: usize,
        /// Position of the first such box in its input.
        index: u64,
        /// What is wrong with it.
        defect: BoxDefect,
    },
    /// A rank did not pass one id for each box.
    #[error("rank {rank} passed {boxes} boxes and {ids} ids; give one for each box")]
    MissingIds {
        /// The rank.
        rank: usize,
        /// Its boxes.
        boxes: u64,
        /// Its ids.
        ids: u64,
    },
    /// A rank has more pairs than its list may hold.
    #[error("rank {rank} has more pairs than its limit of {limit}; raise the limit or thin out the scene")]
    TooManyPairs {
        /// The rank.
        rank: usize,
        /// Its limit.
        limit: u64,
    },
    /// The search of a rank failed.
    #[error("the search of rank {rank} failed: {failure}")]
    Search {
        /// The rank.
        rank: usize,
        /// Why.
        failure: Failure,
    },
}

/// Why the search of a rank failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Failure {
    /// More boxes in the region than 32 bits can number.
    #[error("its region has {0} boxes, more than 32 bits can number; use more ranks")]
    TooManyBoxes(u64),
    /// An allocation of this many elements was refused.
    #[error("no memory for {0} elements; use more ranks or set a limit on the pairs")]
    OutOfMemory(u64),
    /// No algorithm of its tuning runs there.
    #[error("no algorithm of its tuning runs there; run `sapwise predict` there again")]
    NoAlgorithm,
    /// Another error: [`Distributed::search_error`](crate::Distributed::search_error) has it on that rank.
    #[error("`search_error` on that rank says why")]
    Other,
}

/// The outcome of one rank's search as words: 0 or the kind of error, and its number.
pub(crate) type Outcome = [u64; 2];

pub(crate) const DONE: Outcome = [0, 0];

/// Encodes the result of a search. Invalid boxes were found before.
pub(crate) fn outcome(result: &Result<(), sapwise::Error>) -> Outcome {
    match result {
        Ok(()) => DONE,
        Err(sapwise::Error::TooManyPairs { limit }) => [1, *limit as u64],
        Err(sapwise::Error::TooManyObjects { objects }) => [2, *objects as u64],
        Err(sapwise::Error::OutOfMemory { elements, .. }) => [3, *elements as u64],
        Err(
            sapwise::Error::Unavailable { .. } | sapwise::Error::UnknownAlgorithm { .. } | sapwise::Error::NoAlgorithm,
        ) => [4, 0],
        Err(_) => [5, 0],
    }
}

/// Decodes an outcome; `None` for success.
pub(crate) fn error_of(rank: usize, [what, number]: Outcome) -> Option<Error> {
    let failure = match what {
        0 => return None,
        1 => return Some(Error::TooManyPairs { rank, limit: number }),
        2 => Failure::TooManyBoxes(number),
        3 => Failure::OutOfMemory(number),
        4 => Failure::NoAlgorithm,
        _ => Failure::Other,
    };
    Some(Error::Search { rank, failure })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_outcome_is_a_sentence() {
        assert_eq!(error_of(3, outcome(&Ok(()))), None);
        let text = |e| error_of(3, outcome(&Err(e))).map(|e| e.to_string()).unwrap_or_default();
        assert!(text(sapwise::Error::TooManyPairs { limit: 7 }).contains("rank 3 has more pairs than its limit of 7"));
        assert!(text(sapwise::Error::TooManyObjects { objects: 5 }).contains("its region has 5 boxes"));
        assert!(text(sapwise::Error::OutOfMemory { what: "pairs", elements: 9 }).contains("no memory for 9 elements"));
        assert!(text(sapwise::Error::NoAlgorithm).contains("`sapwise predict` there again"));
        let invalid = Error::InvalidBox { rank: 2, index: 8, defect: BoxDefect::NotANumber };
        assert!(invalid.to_string().starts_with("box 8 of rank 2 has a bound that is not a number"));
    }
}
