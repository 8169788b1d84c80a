//! Shared by the fuzz targets.

pub mod checked;
pub mod json;
pub mod oracle;
pub mod scene;
mod source;

pub use source::{Random, Source};
