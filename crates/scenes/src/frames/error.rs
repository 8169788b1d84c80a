//! Errors of files of boxes.

use std::collections::TryReserveError;
use std::io;
use std::path::PathBuf;

/// Boxes can't be read from a file; the source says why.
#[derive(Debug, thiserror::Error)]
#[error("can't read boxes from {}", path.display())]
#[non_exhaustive]
pub struct FramesError {
    /// The file.
    pub path: PathBuf,
    /// The reason.
    pub source: NpyError,
}

/// The reason why a `.npy` file holds no boxes.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NpyError {
    /// The system can't open or read the file.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A folder, or a pipe or a device, which has no size and may never end.
    #[error("it is a folder, a pipe or a device; name a .npy file")]
    NotAFile,
    /// The file is empty.
    #[error("the file is empty; copy or make it again")]
    Empty,
    /// Another format.
    #[error("it is no .npy file: the first bytes aren't \\x93NUMPY; save it with numpy.save")]
    NotNpy,
    /// The file ends before its data begin.
    #[error("the file ends within its header")]
    CutHeader,
    /// An unknown version of the format.
    #[error("version {0} of the .npy format is unknown")]
    Version(u8),
    /// The dictionary of the header can't be read.
    #[error("the header is malformed: {0}")]
    Header(String),
    /// The elements are not little-endian float32.
    #[error("its elements are {}; save it with .astype('<f4')", elements(.0))]
    Elements(String),
    /// The shape is neither one frame of boxes nor several.
    #[error("its shape is {0:?}, where [n, 6] or [frames, n, 6] is needed")]
    Shape(Vec<u64>),
    /// The shape claims more frames, boxes or bytes than there can be.
    #[error("its header claims a shape of {shape:?}, more than {limit}")]
    TooLarge {
        /// The length of each axis.
        shape: Vec<u64>,
        /// The limit, in words.
        limit: &'static str,
    },
    /// Too many empty frames.
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
    /// An absent box precedes a present one.
    #[error("frame {frame}: row {row} is NaN, and row {last} is not; absent boxes stand at the end of a frame")]
    AbsentInside {
        /// The first frame with such a row.
        frame: usize,
        /// The row of NaN.
        row: usize,
        /// The last row of the frame that holds a box.
        last: usize,
    },
    /// The file became shorter while it was read.
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

/// A frame holds a box that every algorithm refuses.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("frame {frame}: {error}; in a stream of frames × n × 6, rows of NaN at the end of a frame are absent boxes")]
#[non_exhaustive]
pub struct InvalidFrame {
    /// Position of the first such frame.
    pub frame: usize,
    /// The first such box.
    pub error: sapwise::Error,
}
