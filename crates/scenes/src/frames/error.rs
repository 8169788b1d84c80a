//! What may be wrong with a file of boxes.

use std::collections::TryReserveError;
use std::io;
use std::path::PathBuf;

/// Boxes can't be read from a file; its source says why.
#[derive(Debug, thiserror::Error)]
#[error("can't read boxes from {}", path.display())]
#[non_exhaustive]
pub struct FramesError {
    /// The file that was asked for.
    pub path: PathBuf,
    /// What is wrong with it.
    pub source: NpyError,
}

/// What is wrong with a `.npy` file that is to hold boxes.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NpyError {
    /// The system can't open or read it.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A pipe or a device has no size, and some never end.
    #[error("it is no regular file")]
    NotAFile,
    /// It holds no byte.
    #[error("the file is empty")]
    Empty,
    /// Another format.
    #[error("it is no .npy file: the first bytes aren't \\x93NUMPY")]
    NotNpy,
    /// It is cut before its data begin.
    #[error("the file ends within its header")]
    CutHeader,
    /// A version of the format that is not known here.
    #[error("version {0} of the .npy format is unknown")]
    Version(u8),
    /// The dictionary of the header can't be read, for this reason.
    #[error("the header is malformed: {0}")]
    Header(String),
    /// Elements of another type than little-endian float32.
    #[error("its elements are {}; save it with .astype('<f4')", elements(.0))]
    Elements(String),
    /// Neither one frame of boxes nor several.
    #[error("its shape is {0:?}, where [n, 6] or [frames, n, 6] is needed")]
    Shape(Vec<u64>),
    /// More frames, boxes or bytes than there can be.
    #[error("its header claims a shape of {shape:?}, more than {limit}")]
    TooLarge {
        /// The length of each axis.
        shape: Vec<u64>,
        /// What it exceeds, in words.
        limit: &'static str,
    },
    /// Too many frames that hold nothing.
    #[error("its header claims {0} frames without a box")]
    EmptyFrames(u64),
    /// Fewer bytes of data than the header claims.
    #[error("it is truncated: {missing} bytes of {bytes} are missing")]
    Truncated {
        /// Bytes that are not there.
        missing: u64,
        /// Bytes that the shape takes.
        bytes: u64,
    },
    /// More bytes of data than the header claims.
    #[error("{extra} bytes follow its {bytes} bytes of data")]
    Trailing {
        /// Bytes behind the data.
        extra: u64,
        /// Bytes that the shape takes.
        bytes: u64,
    },
    /// An absent box before one that is there.
    #[error("frame {frame}: row {row} is NaN, and row {last} is not; absent boxes stand at the end of a frame")]
    AbsentInside {
        /// The first frame that has such a row.
        frame: usize,
        /// The row that is NaN throughout.
        row: usize,
        /// The last row of that frame that holds a box.
        last: usize,
    },
    /// It is shorter than it was a moment ago.
    #[error("it changed while it was read")]
    Changed,
    /// The boxes don't fit into memory.
    #[error("its boxes don't fit into memory")]
    Memory(#[from] TryReserveError),
}

fn elements(descr: &str) -> String {
    match descr {
        ">f4" => "big-endian (>f4)".to_owned(),
        other => format!("{other}, where float32 (<f4) is needed"),
    }
}

/// A frame holds a box that no algorithm can order.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("frame {frame}: {error}; only rows at the end of a frame may be NaN throughout, which are absent boxes")]
#[non_exhaustive]
pub struct InvalidFrame {
    /// Position of the first such frame.
    pub frame: usize,
    /// Names the first such box in it.
    pub error: sapwise::Error,
}
