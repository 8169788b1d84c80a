//! The evaluation of reports: cost models, their validation on held-out machines, studies, figures and pages.
//!
//! A [`report`](report::Report) holds the measurements of one machine. The steps from reports to a model are
//!
//! 1. [`data`]: a report becomes a [`Profile`](data::Profile), and a [`Selection`](data::Selection) keeps the profiles
//!    that can be trained on;
//! 2. [`fit`]: cost terms are fitted to the profiles, which makes a [`Model`](sapwise_tune::Model);
//! 3. [`evaluate`]: each machine is held out in turn, and every strategy is judged on it by its regret;
//! 4. [`train()`]: all of these steps; [`Training`] describes the result.
//!
//! ```no_run
//! use sapwise_lab::data::{Selection, read_reports};
//! use sapwise_lab::progress::Silent;
//!
//! let reports = read_reports(&["datasets".into()], &Silent)?;
//! let trained = sapwise_lab::train(Selection::of(&reports), "mine", &Silent)?;
//! for score in &trained.training.validation.methods {
//!     println!("{}: {}", score.name, sapwise_lab::spread::percent(score.mean_regret, score.regret_range(), 1));
//! }
//! # Ok::<(), anyhow::Error>(())
//! ```
//!
//! `examples/leave_one_out.rs` trains without one report and prints the regrets on it.
//!
//! Times are in nanoseconds, and a regret is the time of the choice over that of the best choice, less one.

pub mod data;
pub mod evaluate;
pub mod figures;
pub mod fit;
pub mod kinds;
pub mod label_text;
pub mod model_card;
mod paired;
pub mod progress;
pub mod report;
mod schemas;
pub mod spread;
pub mod study;
pub mod sweep;
#[cfg(test)]
mod synthetic;
pub mod text;
mod train;
mod training;
pub mod write;

pub use report::Report;
pub use schemas::schemas;
pub use train::{Trained, train, without};
pub use training::{
    Coverage, Floor, MethodScore, Outside, PublishedShares, Regrets, Split, StoredModel, Training, TrainingReport,
    Validation, read_model, write_model,
};
