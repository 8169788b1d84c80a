//! Tuning kept from one start of a program to the next.
//!
//! A file for each [`Key`], and beside it what a measurement that was stopped has found so far. It is written beside its place and renamed, so that two processes at once leave one whole file; what
//! was cut off by a crash of the machine can't be read and is replaced.

use super::options::Cache;
use crate::adaptive::{Keeper, SaveError};
use crate::algorithm::AlgorithmId;
use crate::entry::Entry;
use crate::hardware::{GpuIdentity, Hardware, Machine, Measurement, Parameter};
use crate::json::{self, Format};
use crate::measure::{fnv1a, machine};
use crate::model::Model;
use crate::registry::{Registry, usable_cores};
use crate::tuning::Tuning;
use etcetera::BaseStrategy;
use std::fs::{self, File, TryLockError};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// How the files are read and written.
const FORMAT: Format = Format::new("cache", 4, 0);

/// How what a stopped measurement has found is read and written.
const UNFINISHED: Format = Format::new("unfinished", 1, 0);

/// The file that a process locks while it measures.
const LOCK: &str = ".sapwise.lock";

/// How often to look whether another process is done.
const LOOK_AGAIN: Duration = Duration::from_millis(20);

/// How the names of files begin and end while they are written.
const TEMPORARY: (&str, &str) = (".sapwise-", ".tmp");

/// To write a file takes milliseconds: what is as old was left by a crash.
const CRASHED: Duration = Duration::from_secs(60 * 60);

/// What was neither read nor written for as long is of a machine, a driver or a build that is gone.
const UNUSED: Duration = Duration::from_secs(90 * 24 * 60 * 60);

/// A stopped measurement is gone on with for as long: its figures are to be of one time.
const OUTDATED: Duration = Duration::from_secs(7 * 24 * 60 * 60);

/// A file that is longer was written by something else.
const LONGEST_BYTES: u64 = 16 << 20;

/// The file.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct Cached {
    /// What the tuning holds for.
    key: Key,
    /// When and how the hardware was measured from which it was predicted.
    measured: Measurement,
    /// The tuning, predicted or learned.
    tuning: Tuning,
}

/// What a measurement that was stopped has found.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
struct Unfinished {
    /// What the figures hold for.
    key: Key,
    /// Those that were measured.
    hardware: Hardware,
}

/// All that tuning depends on, in plain words. Names no host, no user and no single piece of hardware.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub(super) struct Key {
    /// Version of this library.
    version: String,
    /// The machine; its SIMD level is the one that the algorithms use.
    machine: Machine,
    /// Cores that this process may use.
    usable_cores: u32,
    /// Which threads help the calling one: `pinned`, `free`, or `given` by the program.
    helpers: String,
    /// The algorithms that can run.
    algorithms: Vec<Known>,
    /// The GPUs that they run on, with their drivers.
    gpus: Vec<GpuIdentity>,
    /// Name of the model.
    model: String,
    /// FNV-1a of its file, as 16 hex digits.
    model_hash: String,
}

/// An algorithm that can run.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
struct Known {
    /// The algorithm.
    algorithm: AlgorithmId,
    /// Its revision.
    revision: u32,
}

impl Key {
    pub(super) fn new(registry: &Registry, model: &Model) -> Result<Self, json::Error> {
        let known = |e: Entry| Known { algorithm: e.id, revision: e.revision };
        Ok(Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            machine: Machine { simd: registry.simd().to_string(), ..machine() },
            usable_cores: usable_cores(),
            helpers: registry.helpers().to_owned(),
            algorithms: registry.available().into_iter().map(known).collect(),
            gpus: registry.gpu_identities(),
            model: model.name.clone(),
            model_hash: format!("{:016x}", fnv1a(&json::write_model(model)?)),
        })
    }
}

/// The file of one key.
#[derive(Debug, Clone)]
pub(super) struct CacheFile {
    key: Key,
    path: PathBuf,
    /// What is kept was predicted from this, or was learned upon that.
    measured: Measurement,
}

impl CacheFile {
    /// The file of a key; `None` where nothing is to be kept.
    ///
    /// # Errors
    /// A sentence, when the user has no cache folder.
    pub(super) fn new(cache: &Cache, key: Key) -> Result<Option<Self>, String> {
        let folder = match cache {
            Cache::None => return Ok(None),
            Cache::Folder(folder) => folder.clone(),
            Cache::User => etcetera::base_strategy::choose_native_strategy()
                .map_err(|e| format!("the user has no cache folder ({e}); name one with `Cache::Folder`"))?
                .cache_dir()
                .join("sapwise"),
        };
        let text = serde_json::to_string(&key).map_err(|e| e.to_string())?;
        let path = folder.join(format!("tuning-{:016x}.json", fnv1a(&text)));
        Ok(Some(Self { key, path, measured: Measurement::now(Vec::new(), None) }))
    }

    /// The same, for tuning of that measurement.
    pub(super) fn of(self, measured: Measurement) -> Self {
        Self { measured, ..self }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new("."))
    }

    /// Where the figures of an unfinished measurement are.
    fn unfinished(&self) -> PathBuf {
        self.path.with_extension("unfinished.json")
    }

    /// Waits until no other process measures, but no longer than `patience` and not when it is to stop. What comes back is to be kept while
    /// this one measures; the system gives it back when a process dies. `None` after the time, and where there is no folder or no lock.
    pub(super) fn wait_for_turn(&self, patience: Duration, stop: impl Fn() -> bool) -> Option<File> {
        fs::create_dir_all(self.folder()).ok()?;
        let lock = File::create(self.folder().join(LOCK)).ok()?;
        let began = Instant::now();
        loop {
            match lock.try_lock() {
                Ok(()) => return Some(lock),
                Err(TryLockError::WouldBlock) if began.elapsed() < patience && !stop() => {
                    std::thread::sleep(LOOK_AGAIN)
                }
                Err(_) => return None,
            }
        }
    }

    /// What a measurement has found that was stopped; nothing where there is none that can be used.
    pub(super) fn read_unfinished(&self) -> Vec<Parameter> {
        let fresh = |m: &fs::Metadata| m.modified().is_ok_and(|at| at.elapsed().is_ok_and(|age| age < OUTDATED));
        let usable = |m: &fs::Metadata| m.is_file() && m.len() <= LONGEST_BYTES && fresh(m);
        let text = Some(self.unfinished()).filter(|p| fs::metadata(p).is_ok_and(|m| usable(&m)));
        let text = text.and_then(|path| fs::read_to_string(path).ok());
        let found = text.and_then(|text| UNFINISHED.read::<Unfinished>(&text).ok()).map(|read| read.value);
        found.filter(|of| of.key == self.key).map(|of| of.hardware.parameters).unwrap_or_default()
    }

    /// Keeps what was measured so far, until a tuning is kept.
    pub(super) fn keep_unfinished(&self, measured: &[Parameter]) -> Result<(), SaveError> {
        let hardware = Hardware::new(self.key.machine.clone(), measured.to_vec());
        self.write(&self.unfinished(), UNFINISHED.write(&Unfinished { key: self.key.clone(), hardware }))
    }

    /// Drops them: the measurement is finished, well or not.
    pub(super) fn forget_unfinished(&self) {
        // Where it stays because it can't be removed it could not be written either.
        let _ = fs::remove_file(self.unfinished());
    }

    fn write(&self, path: &Path, text: Result<String, json::Error>) -> Result<(), SaveError> {
        let text = text.map_err(|e| SaveError::Encode(e.into()))?;
        self.replace(path, &text).map_err(|source| SaveError::Write { file: path.to_owned(), source })
    }

    /// Removes what no process will use again: temporary files of those that crashed, and files that none has read or written for long.
    fn clean(&self) {
        let Ok(entries) = fs::read_dir(self.folder()) else { return };
        for entry in entries.flatten() {
            let name = entry.file_name();
            let Some(name) = name.to_str() else { continue };
            let most = match name {
                _ if name.starts_with(TEMPORARY.0) && name.ends_with(TEMPORARY.1) => CRASHED,
                _ if name.starts_with("tuning-") && name.ends_with(".json") => UNUSED,
                _ => continue,
            };
            let age =
                entry.metadata().ok().filter(fs::Metadata::is_file).and_then(|m| m.modified().ok()?.elapsed().ok());
            if age.is_some_and(|age| age > most) {
                // Another process may have been quicker.
                let _ = fs::remove_file(entry.path());
            }
        }
    }

    /// The tuning that is kept, and what it is of; `None` where there is none.
    ///
    /// # Errors
    /// A sentence that says why what is there can't be used.
    pub(super) fn read(&self) -> Result<Option<(Tuning, Measurement)>, String> {
        let ignored = |why: &str| format!("{} is ignored and replaced: {why}", self.path.display());
        match fs::metadata(&self.path) {
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(ignored(&e.to_string())),
            // To open a pipe would wait for its writer.
            Ok(found) if !found.is_file() => return Err(ignored("it is no file")),
            Ok(found) if found.len() > LONGEST_BYTES => return Err(ignored("it is too long")),
            Ok(_) => {}
        }
        let text = fs::read_to_string(&self.path).map_err(|e| ignored(&e.to_string()))?;
        let cached: Cached = FORMAT.read(&text).map_err(|e| ignored(&told(&e)))?.value;
        if cached.key != self.key {
            return Err(ignored("it is of another machine, another build or another model"));
        }
        // It is in use, which keeps it from being cleaned; where it can't be written nobody else cleans it either.
        let _ = File::options().append(true).open(&self.path).and_then(|f| f.set_modified(SystemTime::now()));
        Ok(Some((cached.tuning, cached.measured)))
    }

    fn replace(&self, path: &Path, text: &str) -> std::io::Result<()> {
        let folder = self.folder();
        fs::create_dir_all(folder)?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(TEMPORARY.0).suffix(TEMPORARY.1);
        // Private otherwise, where every other program's files follow the umask.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let mut temporary = builder.tempfile_in(folder)?;
        // Not forced to the disk, which may take longer than measuring again what a crash of the machine cuts off.
        temporary.write_all(text.as_bytes())?;
        temporary.persist(path).map_err(|failed| failed.error)?;
        Ok(())
    }
}

impl Keeper for CacheFile {
    fn keep(&self, tuning: Tuning, over_predicted: f64) -> Result<(), SaveError> {
        // Another process, or the background of this one, may have measured since: what is learned upon older figures does not take its place.
        if self.read().is_ok_and(|kept| kept.is_some_and(|(_, since)| since.at_unix_s > self.measured.at_unix_s)) {
            return Ok(());
        }
        let mut measured = self.measured.clone();
        measured.frames_over_predicted *= over_predicted;
        let cached = Cached { key: self.key.clone(), measured, tuning };
        self.write(&self.path, FORMAT.write(&cached))?;
        self.clean();
        Ok(())
    }
}

/// The JSON Schema of the files in the cache: name and text.
///
/// # Errors
/// When the schema can't be written.
#[cfg(feature = "schema")]
pub fn cache_schema() -> Result<(String, String), json::Error> {
    FORMAT.json_schema::<Cached>()
}

/// Whether a text could be a file of the cache or of an unfinished measurement. For fuzzing: files are read only where their key is this machine's.
#[cfg(fuzzing)]
pub fn is_readable_cache(text: &str) -> bool {
    let reads_back = |cached: Cached| {
        let again: Cached = FORMAT.read(&FORMAT.write(&cached).unwrap()).unwrap().value;
        assert_eq!(again, cached);
    };
    FORMAT.read(text).map(|read| reads_back(read.value)).is_ok() || UNFINISHED.read::<Unfinished>(text).is_ok()
}

/// What is wrong with a file. An old one is not worth the command that converts files.
fn told(error: &json::Error) -> String {
    match error {
        json::Error::OldSchema { found, .. } => format!("the schema {found:?} is of an older version"),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests;
