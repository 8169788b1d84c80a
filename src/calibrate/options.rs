//! What a program may ask of the start of an adaptive broad phase.

use crate::model::Model;
use crate::registry::Registry;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// How [`Adaptive::for_this_machine`](crate::Adaptive::for_this_machine) goes about it. The default is what most engines want.
///
/// ```
/// use sapwise::{Cache, StartOptions};
///
/// let options = StartOptions::new().background(false).cache(Cache::None);
/// ```
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct StartOptions {
    /// Whether the times of frames correct the predicted costs: [`Adaptive::set_learning`](crate::Adaptive::set_learning). On by
    /// default.
    pub learning: bool,
    /// Whether a frame is now and then run by another algorithm, to learn what it costs:
    /// [`Adaptive::set_exploring`](crate::Adaptive::set_exploring). On by default.
    pub exploring: bool,
    /// Whether all that takes time happens on a thread of its own, so that the constructor returns at once: looking for GPUs, reading
    /// the cache, measuring, predicting, making the algorithms. Until it is done [`Tuning::usual`](crate::Tuning::usual) decides.
    /// On by default. A program that shows a loading screen turns it off: what is measured while its other threads work is off by
    /// what they take, which can't be told from a slower machine, and is kept until [`save`](crate::Adaptive::save) has better.
    pub background: bool,
    /// How long the constructor waits for what happens in the background, which until then takes the machine for itself: for a program that
    /// has some time at its start, but not as much as a first measurement may take. Afterwards the background works a tenth of the time,
    /// some milliseconds at once where a sample is no longer, and takes ten times as long. Nothing by default.
    pub wait_at_most: Duration,
    /// Where tuning is kept from one start to the next. The user's cache folder by default.
    pub cache: Cache,
    /// A folder with a tuning for each kind of machine that is known beforehand: the nodes of a cluster, the consoles that a game runs on.
    /// `sapwise predict --report REPORTS --out FOLDER` writes it, [`Machine::tuning_file`](crate::Machine::tuning_file) names its files. Where
    /// the [`cache`](Self::cache) has nothing and the folder has a tuning of this kind of machine, that is taken and nothing is measured.
    /// `None` by default.
    pub tunings: Option<PathBuf>,
    /// The algorithms to choose from: the program's own, its thread pool ([`Registry::use_pool`]), its GPUs
    /// (`Registry::add_gpus`, with a `Gpus::set_wait_limit` of the program's). `None`, the default: ours on all usable cores, with
    /// threads that the system puts where it likes ([`Registry::pin_threads`] is for programs that have the machine to themselves), and with the feature `measure-gpu` on every GPU that is no software adapter.
    pub registry: Option<Arc<Registry>>,
    /// The model that predicts, for a program with algorithms of its own, which the built-in one does not know. `None`, the
    /// default: [`Model::built_in`].
    pub model: Option<Model>,
    /// Whether the hardware may be measured. Off: what is [kept](Self::cache) is taken however old it is, else what is
    /// [shipped](Self::tunings), else [`Tuning::usual`](crate::Tuning::usual), and the remarks say so. For a program that runs a frame or two
    /// and ends, which a measurement of two seconds would never pay for. On by default.
    pub measure: bool,
    /// The longest that the hardware may be measured, a sample more or less, and each GPU once more. Two seconds by default; where
    /// other programs work meanwhile less than one returns figures that are far off. What is had in the time is used. Pauses in the
    /// [background](Self::background) don't count.
    pub probe_limit: Duration,
}

/// Where tuning is kept from one start to the next.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Cache {
    /// The folder `sapwise` in the user's cache folder: `$XDG_CACHE_HOME` or `~/.cache`, `~/Library/Caches`, `%LOCALAPPDATA%`.
    #[default]
    User,
    /// This folder, which is made where it is missing.
    Folder(PathBuf),
    /// Nowhere: every start measures.
    None,
}

impl StartOptions {
    /// What most engines want.
    #[must_use]
    pub fn new() -> Self {
        Self {
            learning: true,
            exploring: true,
            background: true,
            wait_at_most: Duration::ZERO,
            cache: Cache::User,
            tunings: None,
            registry: None,
            model: None,
            measure: true,
            probe_limit: Duration::from_secs(2),
        }
    }

    /// The same with [`learning`](Self::learning) on or off.
    #[must_use]
    pub fn learning(self, learning: bool) -> Self {
        Self { learning, ..self }
    }

    /// The same with [`exploring`](Self::exploring) on or off.
    #[must_use]
    pub fn exploring(self, exploring: bool) -> Self {
        Self { exploring, ..self }
    }

    /// The same in the [`background`](Self::background) or not.
    #[must_use]
    pub fn background(self, background: bool) -> Self {
        Self { background, ..self }
    }

    /// The same with another [`wait_at_most`](Self::wait_at_most).
    #[must_use]
    pub fn wait_at_most(self, wait_at_most: Duration) -> Self {
        Self { wait_at_most, ..self }
    }

    /// The same with its tuning [kept](Self::cache) there.
    #[must_use]
    pub fn cache(self, cache: Cache) -> Self {
        Self { cache, ..self }
    }

    /// The same with the [`tunings`](Self::tunings) of this folder.
    #[must_use]
    pub fn tunings(self, folder: impl Into<PathBuf>) -> Self {
        Self { tunings: Some(folder.into()), ..self }
    }

    /// The same over the algorithms of this [`registry`](Self::registry).
    #[must_use]
    pub fn registry(self, registry: Arc<Registry>) -> Self {
        Self { registry: Some(registry), ..self }
    }

    /// The same with predictions of this [`model`](Self::model).
    #[must_use]
    pub fn model(self, model: Model) -> Self {
        Self { model: Some(model), ..self }
    }

    /// The same with leave to [measure](Self::measure) or without.
    #[must_use]
    pub fn measure(self, measure: bool) -> Self {
        Self { measure, ..self }
    }

    /// The same with another [`probe_limit`](Self::probe_limit).
    #[must_use]
    pub fn probe_limit(self, probe_limit: Duration) -> Self {
        Self { probe_limit, ..self }
    }
}

impl Default for StartOptions {
    fn default() -> Self {
        Self::new()
    }
}
