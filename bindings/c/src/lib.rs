//! The C interface of Sapwise. The doc comments of exported items are the header's: `tests/header.rs` generates
//! `include/sapwise.h` from them.

#![allow(non_camel_case_types, reason = "the names of the header")]
#![allow(clippy::missing_safety_doc, reason = "the head of the header has what every function demands")]

mod arrays;
mod body;
mod boxes;
mod guarded;
mod options;
mod queries;
mod search;
mod space;
mod status;
mod text;

use arrays::{check, flat, put, slice};
use boxes::{Boxes, read};
use guarded::Guarded;
use status::{Failure, call, value};

pub use body::*;
pub use boxes::{sw_box_from_doubles, sw_box_sweep};
pub use options::*;
pub use queries::*;
pub use search::*;
pub use space::*;
pub use status::{sw_last_error, sw_last_status, sw_status, sw_version};
