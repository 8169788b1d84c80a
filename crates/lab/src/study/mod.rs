//! The study of Section 6 of Avril, Gouranton and Arnaldi (ISVRI 2011), from any set of reports: hardware against performance.

mod accuracy;
mod claims;
mod curves;
mod entry;
mod folder;
mod hardware;
mod influence;
mod map;
mod material;
mod rank;
mod ratios;
mod restrictions;
mod sections;
mod side_crossovers;
mod sources;
mod speed;
mod summary;
mod timings;
mod write;

pub use folder::{PAGE, prepare};
pub use material::Study;
pub use sources::{NotAmongReports, Sources};
pub use summary::{StudiedReport, StudyClaim, StudyFile, Summary};
