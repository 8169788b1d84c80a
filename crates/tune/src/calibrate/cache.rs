//! The file that keeps the tuning of this machine from one start to the next.
//!
//! It is a `tuning/3` file. Its name is a hash of everything that the tuning depends on, and its modification time is
//! the time of the measurement.

use crate::json;
use crate::measure::{fnv1a, machine};
use sapwise::algorithm::usable_cores;
use sapwise::internals::{GpuIdentity, SaveError};
use sapwise::{Registry, Tuning};
use std::fs;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// The file for this machine, this build and these algorithms.
#[derive(Debug, Clone)]
pub(super) struct CacheFile {
    pub(super) path: PathBuf,
}

impl CacheFile {
    pub(super) fn new(folder: &Path, registry: &Registry) -> Self {
        Self { path: folder.join(format!("tuning-{:016x}.json", fnv1a(&key(registry)))) }
    }

    /// Returns the tuning and when its hardware was measured; `None` if there is no file.
    ///
    /// # Errors
    /// A sentence that says why the file can't be used.
    pub(super) fn read(&self) -> Result<Option<(Tuning, SystemTime)>, String> {
        let ignored = |why: &dyn std::fmt::Display| format!("{} is ignored: {why}", self.path.display());
        let measured = match fs::metadata(&self.path).and_then(|found| found.modified()) {
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
            found => found.map_err(|e| ignored(&e))?,
        };
        let text = fs::read_to_string(&self.path).map_err(|e| ignored(&e))?;
        Ok(Some((json::tuning(&text).map_err(|e| ignored(&e))?, measured)))
    }

    /// Replaces the file. A reader sees the old file or the new one, never a part.
    pub(super) fn write(&self, tuning: &Tuning, measured: SystemTime) -> Result<(), SaveError> {
        let text = json::write_tuning(tuning).map_err(io::Error::other);
        text.and_then(|text| self.replace(&text, measured))
            .map_err(|source| SaveError::Write { file: self.path.clone(), source })
    }

    fn replace(&self, text: &str, measured: SystemTime) -> io::Result<()> {
        let folder = self.path.parent().unwrap_or(Path::new("."));
        fs::create_dir_all(folder)?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(".sapwise-").suffix(".tmp");
        // The default is private; the umask decides for every other program's files.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let mut temporary = builder.tempfile_in(folder)?;
        // Without a sync: measuring again after a power failure costs less than a sync in every session.
        temporary.write_all(text.as_bytes())?;
        // Learning from frames does not make the measurement younger.
        temporary.as_file().set_modified(measured)?;
        temporary.persist(&self.path).map_err(|failed| failed.error)?;
        Ok(())
    }
}

/// Everything that a tuning depends on, as text: this version, whether it was built for debugging, the machine, its
/// usable cores, which threads help, the algorithms, the GPUs with their drivers, and the model.
///
/// Built for debugging, the probes find a tenth of the memory bandwidth.
fn key(registry: &Registry) -> String {
    let version = (env!("CARGO_PKG_VERSION"), cfg!(debug_assertions));
    let machine = (machine(), registry.simd(), usable_cores(), registry.helpers());
    let algorithms: Vec<_> = registry.available().into_iter().map(|e| (e.id, e.revision)).collect();
    format!("{:?}", (version, machine, algorithms, gpus(registry), fnv1a(json::BUILT_IN)))
}

/// Returns the GPUs of a registry.
#[cfg(feature = "gpu")]
fn gpus(registry: &Registry) -> Vec<GpuIdentity> {
    registry.source::<sapwise_gpu::Gpus>().map_or_else(Vec::new, |gpus| gpus.identities().cloned().collect())
}

/// Returns the GPUs of a registry: none in this build.
#[cfg(not(feature = "gpu"))]
fn gpus(_: &Registry) -> Vec<GpuIdentity> {
    Vec::new()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise::AlgorithmId;
    use sapwise::algorithm::SimdLevel;
    use sapwise::tuning::Step;
    use std::collections::BTreeSet;

    /// A tuning that names its writer.
    fn tuning(writer: u32) -> Tuning {
        let step = |from_objects| Step::new(from_objects, AlgorithmId::cpu("brute", 1));
        let steps = std::iter::once(0).chain(1_000 * writer + 1..1_000 * writer + 200);
        Tuning::from_steps(steps.map(step).collect()).unwrap()
    }

    fn file(folder: &Path) -> CacheFile {
        CacheFile::new(folder, &Registry::with_cores(2))
    }

    fn names(folder: &Path) -> Vec<String> {
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_damaged_file_is_reported_and_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let file = file(folder.path());
        let whole = json::write_tuning(&tuning(1)).unwrap();
        for text in ["", &whole[..whole.len() / 2], &whole.replacen("\"from_objects\": 0", "\"from_objects\": 7", 1)] {
            fs::write(&file.path, text).unwrap();
            assert!(file.read().unwrap_err().contains("is ignored"));
            file.write(&tuning(2), SystemTime::now()).unwrap();
            assert_eq!(file.read().unwrap().unwrap().0, tuning(2));
        }
        fs::remove_file(&file.path).unwrap();
        fs::create_dir_all(file.path.join("inside")).unwrap();
        assert!(file.read().is_err() && file.write(&tuning(1), SystemTime::now()).is_err());
        assert_eq!(names(folder.path()).len(), 1);
    }

    #[test]
    fn every_part_of_the_key_has_its_own_file() {
        let mut registry = Registry::with_cores(2);
        let mut names = vec![key(&registry), key(&Registry::with_cores(1))];
        registry.add(AlgorithmId::cpu("brute", 1), 99, || unreachable!("nothing runs"));
        names.push(key(&registry));
        if SimdLevel::in_use() > SimdLevel::Portable {
            registry.limit_simd(SimdLevel::Portable);
            names.push(key(&registry));
        }
        assert_eq!(names.iter().collect::<BTreeSet<_>>().len(), names.len());
    }

    #[test]
    fn concurrent_writers_leave_a_whole_file() {
        let folder = tempfile::tempdir().unwrap();
        let file = file(folder.path());
        file.write(&tuning(0), SystemTime::now()).unwrap();
        std::thread::scope(|scope| {
            let write = |writer| (0..100).for_each(|_| file.write(&tuning(writer), SystemTime::now()).unwrap());
            let writers = [1, 2].map(|writer| scope.spawn(move || write(writer)));
            while writers.iter().any(|w| !w.is_finished()) {
                let (seen, _) = file.read().unwrap().unwrap();
                assert!((0..=2).any(|writer| seen == tuning(writer)));
            }
        });
        assert_eq!(names(folder.path()).len(), 1);
    }
}
