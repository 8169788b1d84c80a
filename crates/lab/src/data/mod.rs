//! Reports, read from files, reduced to profiles, and selected for training.

mod compared;
pub mod files;
mod profile;
mod published;
mod selection;

pub(crate) use compared::is_real;
pub use compared::{COMPARED, COMPARED_OF_GPUS, figure};
pub use files::{Document, read_document, read_report, read_reports, read_text, report_files};
pub use profile::{Profile, Spot, host, is_sound, machines, usual_scenario};
pub use published::Published;
pub use selection::Selection;
pub(crate) use selection::{MethodKey, method_key};
