//! How a picture is stored.

use std::path::{Path, PathBuf};

/// How a picture is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Picture {
    /// Lines and text, which stay sharp at every size.
    Svg,
    /// Pixels, two for each unit of length.
    Png,
}

impl Picture {
    /// What the name of a file asks for.
    ///
    /// # Errors
    /// When it ends in neither `.svg` nor `.png`.
    pub fn of(path: &Path) -> Result<Self, UnknownPicture> {
        match path.extension().and_then(|e| e.to_str()) {
            Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            _ => Err(UnknownPicture { path: path.to_owned() }),
        }
    }
}

/// The name of a file that does not say which kind of picture it is.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("name a file that ends in .svg or .png")]
#[non_exhaustive]
pub struct UnknownPicture {
    /// The file.
    pub path: PathBuf,
}
