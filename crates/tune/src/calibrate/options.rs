//! The options of a start on this machine.

use etcetera::BaseStrategy;
use sapwise::Registry;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Options of [`for_this_machine`](crate::for_this_machine).
///
/// ```
/// use sapwise_tune::StartOptions;
///
/// let options = StartOptions::new().background(false).cache(None);
/// ```
#[derive(Debug, Clone)]
pub struct StartOptions {
    pub(super) background: bool,
    pub(super) cache: Option<PathBuf>,
    pub(super) max_age: Duration,
    pub(super) measure: Option<Duration>,
    pub(super) registry: Option<Arc<Registry>>,
}

impl StartOptions {
    /// A start in the background, with the user's cache folder and two seconds of measurement.
    pub fn new() -> Self {
        let user = etcetera::base_strategy::choose_native_strategy().ok();
        Self {
            background: true,
            cache: user.map(|user| user.cache_dir().join("sapwise")),
            max_age: Duration::from_secs(30 * 24 * 60 * 60),
            measure: Some(Duration::from_secs(2)),
            registry: None,
        }
    }

    /// Whether to read, measure and predict on a thread of its own, so that the constructor returns at once.
    /// [default: yes]
    ///
    /// Turn it off while a loading screen is shown: other threads that work during the measurement make the machine
    /// look slower.
    #[must_use]
    pub fn background(self, background: bool) -> Self {
        Self { background, ..self }
    }

    /// The folder in which to keep the tuning; `None` keeps nothing. [default: `sapwise` in the user's cache folder,
    /// that is in `$XDG_CACHE_HOME` or `~/.cache`, `~/Library/Caches`, or `%LOCALAPPDATA%`]
    #[must_use]
    pub fn cache(self, folder: Option<PathBuf>) -> Self {
        Self { cache: folder, ..self }
    }

    /// The age from which a kept tuning is measured again. [default: 30 days]
    #[must_use]
    pub fn max_age(self, max_age: Duration) -> Self {
        Self { max_age, ..self }
    }

    /// The longest that the CPU may be measured, and each GPU once more; one sample more or less. `None` measures
    /// nothing: a kept tuning of any age is used, else [`Tuning::usual`](sapwise::Tuning::usual). [default: 2 s]
    #[must_use]
    pub fn measure(self, limit: Option<Duration>) -> Self {
        Self { measure: limit, ..self }
    }

    /// The algorithms to choose from: your own, your thread pool ([`Registry::use_pool`]), your GPUs
    /// (`sapwise_gpu::add_to`). [default: ours on all usable cores, without pinned threads, and with the feature
    /// `gpu` on every GPU that is not a software adapter]
    #[must_use]
    pub fn registry(self, registry: Arc<Registry>) -> Self {
        Self { registry: Some(registry), ..self }
    }
}

impl Default for StartOptions {
    fn default() -> Self {
        Self::new()
    }
}
