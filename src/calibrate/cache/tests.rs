use super::*;
use crate::adaptive::Keeper;
use crate::tuning::Step;

/// Tuning that tell which writer they are of.
fn tuning(writer: u32) -> Tuning {
    let step = |from_objects| Step { from_objects, algorithm: AlgorithmId::cpu("brute", 1) };
    Tuning::from_steps(std::iter::once(0).chain(1_000 * writer + 1..1_000 * writer + 200).map(step).collect()).unwrap()
}

fn key() -> Key {
    Key::new(&Registry::with_cores(2), &Model::built_in().unwrap()).unwrap()
}

fn entry(folder: &Path, key: Key) -> CacheFile {
    CacheFile::new(&Cache::Folder(folder.to_owned()), key).unwrap().unwrap()
}

fn read(file: &CacheFile) -> Tuning {
    file.read().unwrap().unwrap().0
}

fn names(folder: &Path) -> Vec<String> {
    fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
}

fn age(path: &Path, days: u32) {
    let modified = SystemTime::now() - Duration::from_secs(24 * 60 * 60) * days;
    File::options().append(true).open(path).unwrap().set_modified(modified).unwrap();
}

#[test]
fn what_nobody_uses_is_removed_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, days: u32| {
        let path = folder.path().join(name);
        fs::write(&path, "").unwrap();
        age(&path, days);
    };
    file("tuning-0123456789abcdef.json", 100);
    file("tuning-0123456789abcdef.unfinished.json", 100);
    file(".sapwise-crashed.tmp", 1);
    let stay = ["tuning-fedcba9876543210.json", ".sapwise-in-work.tmp", "notes.json", "tuning-of-mine.txt"];
    for (name, days) in stay.into_iter().zip([80, 0, 1000, 1000]) {
        file(name, days);
    }
    fs::create_dir(folder.path().join("tuning-folder.json")).unwrap();
    let entry = entry(folder.path(), key());
    entry.keep(tuning(1), 1.0).unwrap();
    let mut left = names(folder.path());
    left.retain(|name| !entry.path().ends_with(name) && name != "tuning-folder.json");
    left.sort();
    assert_eq!(left, [".sapwise-in-work.tmp", "notes.json", "tuning-fedcba9876543210.json", "tuning-of-mine.txt"]);
    // What is read is in use.
    age(entry.path(), 100);
    entry.read().unwrap().unwrap();
    entry.keep_unfinished(&[]).unwrap();
    CacheFile::new(&Cache::Folder(folder.path().to_owned()), Key { version: "0.0.0".to_owned(), ..key() })
        .unwrap()
        .unwrap()
        .keep(tuning(2), 1.0)
        .unwrap();
    assert_eq!(read(&entry), tuning(1));
}

#[test]
fn an_unfinished_measurement_is_kept_until_it_is_finished() {
    let folder = tempfile::tempdir().unwrap();
    let file = entry(folder.path(), key());
    assert!(file.read_unfinished().is_empty());
    let measured = vec![Parameter::measured("photons_per_s", 1e9, "test")];
    file.keep_unfinished(&measured).unwrap();
    assert_eq!(file.read_unfinished(), measured);
    // Of another machine, damaged, and gone.
    let other = entry(folder.path(), Key { usable_cores: key().usable_cores + 1, ..key() });
    fs::copy(file.unfinished(), other.unfinished()).unwrap();
    assert!(other.read_unfinished().is_empty());
    let text = fs::read_to_string(file.unfinished()).unwrap();
    fs::write(other.unfinished(), &text[..text.len() / 2]).unwrap();
    assert!(other.read_unfinished().is_empty());
    age(&file.unfinished(), 8);
    assert!(file.read_unfinished().is_empty());
    age(&file.unfinished(), 6);
    assert_eq!(file.read_unfinished(), measured);
    file.forget_unfinished();
    assert!(file.read_unfinished().is_empty());
}

#[test]
fn one_measures_at_a_time_and_who_stops_does_not_wait() {
    let folder = tempfile::tempdir().unwrap();
    let [one, other] = [1, 2].map(|cores| entry(folder.path(), Key { usable_cores: cores, ..key() }));
    let turn = one.wait_for_turn(Duration::ZERO, || false).unwrap();
    assert!(other.wait_for_turn(Duration::ZERO, || false).is_none());
    let looks = std::cell::Cell::new(0);
    let stop = || looks.replace(looks.get() + 1) == 3;
    assert!(other.wait_for_turn(Duration::MAX, stop).is_none());
    std::thread::scope(|scope| {
        let waits = scope.spawn(|| other.wait_for_turn(Duration::MAX, || false).is_some());
        drop(turn);
        assert!(waits.join().unwrap());
    });
    fs::write(folder.path().join("occupied"), "").unwrap();
    let nowhere = entry(&folder.path().join("occupied"), key());
    assert!(nowhere.wait_for_turn(Duration::MAX, || false).is_none());
}

#[test]
fn what_is_kept_comes_back_and_nothing_else_is_left() {
    let folder = tempfile::tempdir().unwrap();
    // A folder that is not there yet.
    let inner = folder.path().join("a").join("b");
    let entry = entry(&inner, key());
    assert_eq!(entry.read(), Ok(None));
    for writer in [1, 2] {
        entry.keep(tuning(writer), 1.0).unwrap();
        assert_eq!(read(&entry), tuning(writer));
    }
    assert_eq!(names(&inner), [entry.path().file_name().unwrap().to_str().unwrap()]);
    assert!(CacheFile::new(&Cache::None, key()).unwrap().is_none());
}

#[test]
fn what_is_learned_upon_older_figures_does_not_take_the_place_of_newer_ones() {
    let folder = tempfile::tempdir().unwrap();
    let (newer, mut older) = (entry(folder.path(), key()), entry(folder.path(), key()));
    older.measured.at_unix_s -= 1000;
    older.keep(tuning(1), 3.0).unwrap();
    assert_eq!(older.read().unwrap().unwrap().1.frames_over_predicted, 3.0);
    newer.keep(tuning(2), 1.0).unwrap();
    older.keep(tuning(3), 1.0).unwrap();
    assert_eq!(read(&older), tuning(2));
}

#[test]
fn every_part_of_the_key_has_a_file_of_its_own() {
    let folder = Path::new("nowhere");
    let gpu = GpuIdentity {
        index: 0,
        name: "card".to_owned(),
        device: "1:2".to_owned(),
        driver: "1.0".to_owned(),
        api: "vulkan".to_owned(),
        kind: crate::hardware::GpuKind::Discrete,
    };
    let with_gpu = Key { gpus: vec![gpu.clone()], ..key() };
    let new_driver = Key { gpus: vec![GpuIdentity { driver: "1.1".to_owned(), ..gpu }], ..key() };
    let mut revised = key();
    revised.algorithms[0].revision += 1;
    let mut pinned = Registry::with_cores(2);
    pinned.pin_threads();
    let mut slow = Registry::with_cores(2);
    slow.limit_simd(crate::cpu::SimdLevel::Portable);
    let mut model = Model::built_in().unwrap();
    model.methods[0].terms[0].unit *= 2.0;
    let of = |registry: &Registry| Key::new(registry, &Model::built_in().unwrap()).unwrap();
    let mut keys = vec![
        key(),
        with_gpu,
        new_driver,
        revised,
        of(&Registry::with_cores(1)),
        Key::new(&Registry::with_cores(2), &model).unwrap(),
        Key { version: "0.0.0".to_owned(), ..key() },
        Key { usable_cores: key().usable_cores + 1, ..key() },
        Key { machine: Machine { physical_id: "0".to_owned(), ..key().machine }, ..key() },
    ];
    // Under a quota no thread is bound.
    if pinned.helpers() == "pinned" {
        keys.push(of(&pinned));
    }
    if crate::cpu::SimdLevel::in_use() > crate::cpu::SimdLevel::Portable {
        keys.push(of(&slow));
    }
    let count = keys.len();
    let mut files: Vec<PathBuf> = keys.into_iter().map(|key| entry(folder, key).path).collect();
    files.sort();
    files.dedup();
    assert_eq!(files.len(), count);
    assert_eq!(entry(folder, key()).path, entry(folder, key()).path);
}

#[test]
fn what_is_damaged_foreign_or_old_is_told_and_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let entry = entry(folder.path(), key());
    entry.keep(tuning(1), 1.0).unwrap();
    let whole = fs::read_to_string(entry.path()).unwrap();
    let other_key = whole.replacen(&key().machine.physical_id, "0123456789abcdef", 1);
    let steps = whole.replacen("\"from_objects\": 0", "\"from_objects\": 7", 1);
    for (text, why) in [
        ("", "EOF"),
        (&whole[..whole.len() / 2], "EOF"),
        (&whole[..whole.len() - 2], "EOF"),
        (&whole.replacen("cache/4", "cache/1", 1), "the schema \"cache/1\" is of an older version"),
        (&whole.replacen("\"key\"", "\"host\": \"x\",\n  \"key\"", 1), "host is no key of cache/4"),
        (&other_key, "another machine"),
        (&steps, "don't begin at 0"),
    ] {
        assert_ne!(text, whole);
        fs::write(entry.path(), text).unwrap();
        let told = entry.read().unwrap_err();
        assert!(told.contains(why), "{why}: {told}");
        entry.keep(tuning(2), 1.0).unwrap();
        assert_eq!(read(&entry), tuning(2));
    }
    fs::write(entry.path(), [0xff; 100]).unwrap();
    assert!(entry.read().is_err());
}

#[test]
fn a_folder_in_its_place_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let entry = entry(folder.path(), key());
    fs::create_dir_all(entry.path().join("inside")).unwrap();
    assert!(entry.read().unwrap_err().contains("it is no file"));
    let told = entry.keep(tuning(1), 1.0).unwrap_err().to_string();
    assert!(told.contains("can't be written"), "{told}");
    assert_eq!(names(folder.path()).len(), 1);
}

/// Two writers and a reader, as of several processes at once: each file that is seen is whole and one of theirs.
#[test]
fn writers_at_once_leave_a_whole_file() {
    let folder = tempfile::tempdir().unwrap();
    entry(folder.path(), key()).keep(tuning(0), 1.0).unwrap();
    std::thread::scope(|scope| {
        let writers: Vec<_> = [1, 2]
            .map(|writer| {
                let entry = entry(folder.path(), key());
                scope.spawn(move || (0..200).for_each(|_| entry.keep(tuning(writer), 1.0).unwrap()))
            })
            .into();
        let entry = entry(folder.path(), key());
        let known = [tuning(0), tuning(1), tuning(2)];
        while writers.iter().any(|w| !w.is_finished()) {
            let seen = read(&entry);
            assert!(known.contains(&seen));
        }
    });
    assert_eq!(names(folder.path()).len(), 1);
}
