//! The searcher in a class that learns: behind a lock, made anew after a fork, saved at the end of a block.

use crate::{PyDecision, PyTuning, Start, call, failed, start, with_cause};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sapwise::Adaptive;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};

/// What searches with an [`Adaptive`].
pub(crate) trait Searcher: Send + Sync + Sized {
    /// The name of its class.
    const CLASS: &'static str;
    /// What its text says before the first search.
    const UNUSED: &'static str;

    /// Makes it anew in a forked process, which has none of its threads.
    ///
    /// # Errors
    /// In words.
    fn forked(parent: &RwLock<Self>, adaptive: Adaptive, start: &Start) -> Result<Self, String>;

    fn adaptive(&self) -> &Adaptive;
}

/// A searcher, until it is closed.
pub(crate) struct Held<T: Searcher> {
    pub(crate) start: Start,
    state: Mutex<State<T>>,
}

/// Locked only by a thread with the interpreter's lock, and for an instant: no fork finds it locked.
struct State<T: Searcher> {
    /// The process that made the searcher. Its threads are not in a forked one.
    pid: u32,
    /// `None` once it is closed. Only a thread without the interpreter's lock locks it.
    searcher: Option<Arc<RwLock<T>>>,
}

impl<T: Searcher> Drop for State<T> {
    fn drop(&mut self) {
        let searcher = self.searcher.take();
        if self.pid != std::process::id() {
            // Dropping it would wait for threads that are not in this process.
            std::mem::forget(searcher);
        } else if searcher.is_some() {
            // It waits until its measurement has ended. While the interpreter shuts down, it is dropped all the same.
            Python::try_attach(|py| py.detach(|| drop(searcher)));
        }
    }
}

impl<T: Searcher> Held<T> {
    pub(crate) fn new(py: Python<'_>, start: Start, make: impl FnOnce(Adaptive, &Start) -> T) -> PyResult<Self> {
        let searcher = make(start::adaptive(py, &start)?, &start);
        let state = State { pid: std::process::id(), searcher: Some(Arc::new(RwLock::new(searcher))) };
        Ok(Self { start, state: Mutex::new(state) })
    }

    fn state(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the searcher, made anew after a fork.
    pub(crate) fn shared(&self, py: Python<'_>) -> PyResult<Arc<RwLock<T>>> {
        let pid = std::process::id();
        let (known, made_here) = {
            let state = self.state();
            (state.searcher.clone(), state.pid == pid)
        };
        let closed = || failed(py, format!("this {} is closed; make another one", T::CLASS));
        let known = known.ok_or_else(closed)?;
        if made_here {
            return Ok(known);
        }
        let made = T::forked(&known, start::adaptive(py, &self.start)?, &self.start).map_err(|why| failed(py, why))?;
        let made = Arc::new(RwLock::new(made));
        let mut state = self.state();
        // Other threads ran meanwhile.
        if state.pid == pid || state.searcher.is_none() {
            let first = state.searcher.clone();
            drop(state);
            py.detach(|| drop(made));
            return first.ok_or_else(closed);
        }
        std::mem::forget((known, state.searcher.replace(Arc::clone(&made))));
        state.pid = pid;
        Ok(made)
    }

    /// Runs `what` on the searcher, without the interpreter's lock, while nothing else uses it.
    pub(crate) fn write<R: Send>(&self, py: Python<'_>, what: impl FnOnce(&mut T) -> R + Send) -> PyResult<R> {
        let shared = self.shared(py)?;
        // If another thread closes it meanwhile, it is dropped here.
        Ok(py.detach(move || what(&mut shared.write().unwrap_or_else(PoisonError::into_inner))))
    }

    /// Runs `what` on the searcher, without the interpreter's lock, while nothing changes it.
    pub(crate) fn read<R: Send>(&self, py: Python<'_>, what: impl FnOnce(&T) -> R + Send) -> PyResult<R> {
        let shared = self.shared(py)?;
        Ok(py.detach(move || what(&shared.read().unwrap_or_else(PoisonError::into_inner))))
    }

    pub(crate) fn last_decision(&self, py: Python<'_>) -> PyResult<Option<PyDecision>> {
        self.read(py, |searcher| searcher.adaptive().last_decision().map(PyDecision::from))
    }

    pub(crate) fn tuning(&self, py: Python<'_>) -> PyResult<PyTuning> {
        self.read(py, |searcher| PyTuning::from(searcher.adaptive().learned()))
    }

    pub(crate) fn setup<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let setup = self.read(py, |searcher| searcher.adaptive().setup().clone())?;
        crate::tuning::setup(py, &setup)
    }

    pub(crate) fn save(&self, py: Python<'_>) -> PyResult<bool> {
        let saved = self.read(py, |searcher| searcher.adaptive().save())?;
        let saved = saved.map_err(|error| failed(py, with_cause(&error)))?;
        if saved {
            crate::engine::start_again(py);
        }
        Ok(saved)
    }

    pub(crate) fn close(&self) {
        let mut state = self.state();
        let closed = State { pid: state.pid, searcher: state.searcher.take() };
        drop(state);
        // Waits without the lock.
        drop(closed);
    }

    pub(crate) fn is_closed(&self) -> bool {
        self.state().searcher.is_none()
    }

    /// Saves what was learned, if the start says so, and closes. What the block raised matters more than a cache that
    /// can't be written: that is a warning.
    pub(crate) fn exit(&self, py: Python<'_>) -> PyResult<bool> {
        if !self.is_closed() {
            let saved = if self.start.keeps { self.save(py).err() } else { None };
            self.close();
            if let Some(why) = saved {
                call(py, "sapwise._errors", "warn_unsaved", (why.value(py).to_string(),))?;
            }
        }
        Ok(false)
    }

    /// Returns the text of `repr`.
    pub(crate) fn text(&self, py: Python<'_>) -> PyResult<String> {
        if self.is_closed() {
            return Ok(format!("<sapwise.{}, closed>", T::CLASS));
        }
        let last = self.last_decision(py)?;
        Ok(last.map_or_else(
            || format!("<sapwise.{}, {}>", T::CLASS, T::UNUSED),
            |decision| format!("<sapwise.{}: {}>", T::CLASS, decision.sentence),
        ))
    }
}

/// Gives a class the methods of what it holds, in the field `$held`.
macro_rules! learning_methods {
    ($class:ident, $held:ident) => {
        #[pymethods]
        impl $class {
            /// Decision or None: what was decided for the last frame or update, and why; None before the first.
            #[getter]
            fn last_decision(&self, py: Python<'_>) -> PyResult<Option<$crate::decision::PyDecision>> {
                self.$held.last_decision(py)
            }

            /// Tuning: the expected cost of each algorithm, corrected by what was learned.
            #[getter]
            fn tuning(&self, py: Python<'_>) -> PyResult<$crate::tuning::PyTuning> {
                self.$held.tuning(py)
            }

            /// dict: where the tuning came from (``origin``), ``remarks`` on what went wrong, ``seconds``, the
            /// ``file`` of the cache.
            #[getter]
            fn setup<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, pyo3::types::PyDict>> {
                self.$held.setup(py)
            }

            /// Keep what was learned for the next start on this machine.
            ///
            /// Returns
            /// -------
            /// bool
            ///     False if there is nothing to keep: the measurement has not ended, or ``setup["remarks"]`` say why.
            ///
            /// Raises
            /// ------
            /// SapwiseError
            ///     There is no cache, or it can't be written.
            fn save(&self, py: Python<'_>) -> PyResult<bool> {
                self.$held.save(py)
            }

            /// End its threads and free its memory. It can't be used afterwards. Closing it twice does nothing.
            fn close(&self) {
                self.$held.close();
            }

            /// bool: whether it was closed.
            #[getter]
            fn closed(&self) -> bool {
                self.$held.is_closed()
            }

            fn __enter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
                this
            }

            #[pyo3(signature = (kind, value, trace))]
            fn __exit__(
                &self,
                py: Python<'_>,
                kind: Option<&Bound<'_, PyAny>>,
                value: Option<&Bound<'_, PyAny>>,
                trace: Option<&Bound<'_, PyAny>>,
            ) -> PyResult<bool> {
                let _ = (kind, value, trace);
                self.$held.exit(py)
            }

            fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
                self.$held.text(py)
            }
        }
    };
}
pub(crate) use learning_methods;
