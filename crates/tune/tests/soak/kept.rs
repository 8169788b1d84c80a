//! Programs that start from a cache whose files get damaged.

use super::{Machine, Tally, below, life, registry};
use crate::common::Random;
use sapwise::internals::Origin;
use sapwise_tune::StartOptions;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// A cache folder that lasts from start to start, as that of a user does.
pub(crate) struct Kept {
    folder: tempfile::TempDir,
    /// Files that were made unreadable, which the next start must report.
    damaged: Vec<PathBuf>,
    /// Number of programs that have saved a tuning, or failed to.
    turns: u64,
    cores: u32,
}

impl Kept {
    pub(crate) fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap(), damaged: Vec::new(), turns: 0, cores: 1 }
    }

    /// One program from start to end. Then something happens to its file.
    pub(crate) fn program(&mut self, frames: u64, random: &mut Random, tally: &mut Tally) {
        let mut machine = Machine::new(random);
        // Three programs in turn use the same number of cores, and so the same file. The folder of the second is
        // occupied.
        if self.turns.is_multiple_of(3) {
            self.cores = machine.cores;
        }
        machine.cores = self.cores;
        let occupied = self.turns % 3 == 1;
        tally.starts += 1;
        let cache = self.folder.path().join(if occupied { "occupied/cache" } else { "cache" });
        // A file where the folder should be: it can be neither read nor made, as on a disk that can't be written.
        fs::write(self.folder.path().join("occupied"), "").unwrap();
        let options = StartOptions::new()
            .background(below(random, 4) == 0)
            .cache(Some(cache))
            .registry(Arc::new(registry(machine.cores, &machine.slot)))
            // As briefly as possible: no assertion uses the values.
            .measure(Some(Duration::ZERO));
        let mut adaptive = sapwise_tune::for_this_machine(&options).unwrap();
        life(&mut adaptive, &mut machine, frames, random, tally);
        // The thread in the background still has its memory.
        while adaptive.setup().origin == Origin::Awaited {
            std::thread::sleep(Duration::from_millis(10));
            life(&mut adaptive, &mut machine, 1, random, tally);
        }
        let setup = adaptive.setup();
        // So brief a measurement on a busy machine may yield an impossible value. The prediction without it is not
        // saved.
        let left_out = setup.remarks.iter().any(|r| r.contains("it is left out"));
        let Some(file) = setup.file.clone() else {
            assert!(left_out, "nothing is kept, and nothing was told: {setup:?}");
            return;
        };
        // At times the third program finds the file as the first one left it.
        let spared = self.turns.is_multiple_of(6);
        self.turns += 1;
        let told = setup.remarks.iter().any(|r| r.contains("is ignored"));
        match setup.origin {
            Origin::Cached => tally.cached += 1,
            Origin::Probed => tally.probed += 1,
            other => panic!("{other:?}: {:?}", setup.remarks),
        }
        tally.unreadable += u64::from(told);
        let damaged = self.damaged.contains(&file);
        assert!(told || !damaged && !occupied, "{} was damaged, and nothing was told: {setup:?}", file.display());
        let saved = adaptive.save();
        assert_eq!(saved.is_ok(), file.is_file(), "{saved:?}");
        if saved.is_ok() {
            self.damaged.retain(|d| *d != file);
        }
        tally.unwritable += u64::from(saved.is_err());
        if file.is_file() && !spared {
            self.damage(&file, random);
        } else if file.is_dir() && below(random, 2) == 0 {
            // Only a user removes such a folder.
            fs::remove_dir(&file).unwrap();
            self.damaged.retain(|d| *d != file);
        }
        // One file for each number of cores. A write that failed has left nothing behind.
        let entries = fs::read_dir(self.folder.path().join("cache")).into_iter().flatten().flatten();
        let names: Vec<_> = entries.map(|e| e.file_name().into_string().unwrap()).collect();
        assert!(names.len() <= 4 && names.iter().all(|n| n.starts_with("tuning-")), "{names:?} in the cache");
    }

    /// Something happens to a file, or nothing does.
    fn damage(&mut self, file: &Path, random: &mut Random) {
        let mut bytes = fs::read(file).unwrap();
        match below(random, 6) {
            0 => fs::remove_file(file).unwrap(),
            1 => {
                bytes.truncate(below(random, bytes.len() as u64 - 1) as usize);
                fs::write(file, bytes).unwrap();
                self.damaged.push(file.to_owned());
            }
            // The file may stay readable: with another number, or with another known key.
            2 => {
                let at = below(random, bytes.len() as u64) as usize;
                bytes[at] ^= 1 << below(random, 8);
                fs::write(file, bytes).unwrap();
            }
            3 => {
                fs::remove_file(file).unwrap();
                fs::create_dir(file).unwrap();
                self.damaged.push(file.to_owned());
            }
            _ => {}
        }
    }
}
