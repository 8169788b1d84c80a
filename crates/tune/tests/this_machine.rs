//! Starts on this machine: from nothing, from the cache, in the foreground and in the background, with frames
//! throughout.

#[cfg_attr(feature = "gpu", path = "../../gpu/tests/common/mod.rs")]
#[cfg_attr(not(feature = "gpu"), path = "../../../tests/common/mod.rs")]
mod common;

use common::{Random, naive};
use sapwise::tuning::Source;
use sapwise::{Aabb, Adaptive, AlgorithmId, BroadPhase, Error, PairOrder, Pairs, Registry, Tuning};
use sapwise_tune::{Origin, Setup, StartOptions};
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::{Duration, Instant, SystemTime};

/// Measures as briefly as possible, because no test looks at the values, and on one core, because other tests may
/// spoil the values of several cores beyond belief.
fn options(folder: &Path) -> StartOptions {
    StartOptions::new()
        .background(false)
        .cache(Some(folder.to_owned()))
        .registry(Arc::new(Registry::with_cores(1)))
        .measure(Some(Duration::ZERO))
}

fn start(options: &StartOptions) -> Adaptive {
    sapwise_tune::for_this_machine(options).unwrap()
}

fn origin(adaptive: &Adaptive) -> Origin {
    adaptive.setup().origin
}

fn count(folder: &Path) -> usize {
    fs::read_dir(folder).unwrap().count()
}

/// Runs a frame and compares it with the oracle.
fn frame(adaptive: &mut Adaptive, boxes: &[Aabb]) {
    let mut pairs = Pairs::with_order(PairOrder::Canonical);
    adaptive.find_pairs(boxes, &mut pairs).unwrap();
    assert!(pairs.as_slice() == naive(boxes));
}

/// Runs frames, each of which is decided on and therefore timed.
fn learn(adaptive: &mut Adaptive) {
    let boxes = boxes(300);
    for _ in 0..50 {
        adaptive.decide(&boxes);
        frame(adaptive, &boxes);
    }
}

fn boxes(count: usize) -> Vec<Aabb> {
    Random(7).cubes(count, [20.0; 3], 0.6)
}

/// Runs frames until the background thread is done.
fn frames_until_it_came(adaptive: &mut Adaptive) {
    let boxes = boxes(300);
    while origin(adaptive) == Origin::Awaited {
        frame(adaptive, &boxes);
    }
    frame(adaptive, &boxes);
}

#[test]
fn the_second_start_reads_what_the_first_wrote() {
    let folder = tempfile::tempdir().unwrap();
    let mut first = start(&options(folder.path()));
    assert_eq!(first.setup().remarks, [""; 0]);
    assert_eq!((origin(&first), first.tuning().source), (Origin::Probed, Source::Predicted));
    assert_eq!(first.tuning().defect(), None);
    frame(&mut first, &boxes(500));
    let file = first.setup().file.clone();
    assert!(file.as_ref().is_some_and(|file| file.is_file()) && count(folder.path()) == 1);
    let mut second = start(&options(folder.path()));
    assert_eq!((origin(&second), second.tuning()), (Origin::Cached, first.tuning()));
    assert!(second.setup().remarks.is_empty() && second.setup().file == file);
    frame(&mut second, &boxes(500));
    // Other algorithms have another tuning, in a file of their own.
    let mut more = Registry::with_cores(1);
    more.add("mine@cpu1".parse().unwrap(), 1, || Registry::with_cores(1).create(&"brute@cpu1".parse().unwrap()));
    let other = options(folder.path()).registry(Arc::new(more));
    assert_eq!((origin(&start(&other)), origin(&start(&other))), (Origin::Probed, Origin::Cached));
    assert_eq!(count(folder.path()), 2);
}

#[test]
fn an_old_tuning_is_measured_again() {
    let folder = tempfile::tempdir().unwrap();
    let file = start(&options(folder.path())).setup().file.clone().unwrap();
    let age = |days: u64| {
        let time = SystemTime::now() - Duration::from_secs(days * 24 * 60 * 60);
        fs::File::options().append(true).open(&file).unwrap().set_modified(time).unwrap();
    };
    age(29);
    let mut young = start(&options(folder.path()));
    assert_eq!(origin(&young), Origin::Cached);
    assert_eq!(origin(&start(&options(folder.path()).max_age(Duration::ZERO).measure(None))), Origin::Cached);
    // Saving what was learned does not make the measurement younger.
    learn(&mut young);
    young.save().unwrap();
    let days = fs::metadata(&file).unwrap().modified().unwrap().elapsed().unwrap().as_secs() / (24 * 60 * 60);
    assert_eq!(days, 29);
    age(31);
    let again = start(&options(folder.path()));
    assert_eq!((origin(&again), again.tuning().source), (Origin::Probed, Source::Predicted));
    assert_eq!(origin(&start(&options(folder.path()))), Origin::Cached);
}

#[test]
fn without_measuring_it_uses_what_is_kept_or_the_usual_tuning() {
    let folder = tempfile::tempdir().unwrap();
    for background in [false, true] {
        let mut adaptive = start(&options(folder.path()).measure(None).background(background));
        frames_until_it_came(&mut adaptive);
        assert_eq!((origin(&adaptive), adaptive.tuning().source), (Origin::Usual, Source::Default));
        assert!(matches!(&adaptive.setup().remarks[..], [why] if why.contains("is kept")));
        assert!(count(folder.path()) == 0 && !adaptive.save().unwrap());
    }
    let measured = start(&options(folder.path()));
    let kept = start(&options(folder.path()).measure(None));
    assert_eq!((origin(&kept), kept.tuning(), &kept.setup().remarks[..]), (Origin::Cached, measured.tuning(), &[][..]));
}

#[test]
fn the_next_start_begins_with_what_was_learned() {
    let folder = tempfile::tempdir().unwrap();
    let mut first = start(&options(folder.path()));
    learn(&mut first);
    let learned = first.learned();
    assert_eq!(learned.source, Source::Learned);
    first.save().unwrap();
    let second = start(&options(folder.path()));
    assert_eq!((origin(&second), second.tuning()), (Origin::Cached, &learned));
}

#[test]
fn an_unusable_cache_stops_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let works = |options: &StartOptions, remarks: &[&str]| {
        let mut adaptive = start(options);
        assert_eq!(origin(&adaptive), Origin::Probed);
        let told = &adaptive.setup().remarks;
        assert!(told.len() == remarks.len() && remarks.iter().zip(told).all(|(r, t)| t.contains(r)), "{told:?}");
        frame(&mut adaptive, &boxes(200));
        adaptive
    };
    let none = works(&options(folder.path()).cache(None), &[]);
    assert!(none.save().unwrap_err().to_string().contains("no cache"));
    let file = start(&options(folder.path())).setup().file.clone().unwrap();
    fs::write(&file, "{}").unwrap();
    works(&options(folder.path()), &["is ignored"]);
    assert_eq!(origin(&start(&options(folder.path()))), Origin::Cached);
    // A folder in the place of the file.
    fs::remove_file(&file).unwrap();
    fs::create_dir_all(file.join("inside")).unwrap();
    let blocked = works(&options(folder.path()), &["is ignored", "can't be written"]);
    assert!(blocked.save().unwrap_err().to_string().contains("can't be written"));
    // A file in the place of the folder: it can be neither read nor made, as on a read-only disk.
    let occupied = folder.path().join("occupied");
    fs::write(&occupied, "").unwrap();
    works(&options(&occupied.join("cache")), &["is ignored", "can't be written"]);
}

#[test]
fn concurrent_starts_share_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    std::thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(|| {
                let mut adaptive = start(&options(folder.path()));
                learn(&mut adaptive);
                adaptive.save().unwrap();
            });
        }
    });
    let after = start(&options(folder.path()));
    assert_eq!((origin(&after), after.tuning().source, count(folder.path())), (Origin::Cached, Source::Learned, 1));
}

#[test]
fn the_background_takes_over_between_frames() {
    let folder = tempfile::tempdir().unwrap();
    let background = options(folder.path()).background(true);
    let mut first = start(&background);
    first.set_exploring(false);
    // Only a frame checks whether the thread is done.
    assert_eq!((origin(&first), first.tuning().source), (Origin::Awaited, Source::Default));
    assert!(!first.save().unwrap(), "there is nothing to keep yet");
    let early = first.clone();
    assert_eq!((origin(&early), early.setup().remarks.len(), early.save().unwrap()), (Origin::Usual, 1, false));
    frames_until_it_came(&mut first);
    assert_eq!((origin(&first), first.tuning().source), (Origin::Probed, Source::Predicted));
    let late = first.clone();
    assert_eq!((late.setup(), late.tuning(), late.save().unwrap()), (first.setup(), first.tuning(), true));
    assert!(first.setup().remarks.is_empty() && first.setup().seconds > 0.0, "{:?}", first.setup());
    assert!(first.last_decision().unwrap().predicted_ns.is_some() && first.save().unwrap());
    // So does a decision without a frame.
    let mut second = start(&background);
    while origin(&second) == Origin::Awaited {
        assert!(second.decide(&boxes(100)).is_some());
    }
    assert_eq!(origin(&second), Origin::Cached);
}

#[test]
fn learning_that_was_turned_off_stays_off() {
    let folder = tempfile::tempdir().unwrap();
    let mut adaptive = start(&options(folder.path()).background(true));
    adaptive.set_learning(false);
    frames_until_it_came(&mut adaptive);
    learn(&mut adaptive);
    assert_eq!((origin(&adaptive), adaptive.learned().source), (Origin::Probed, Source::Predicted));
}

#[test]
fn a_drop_ends_the_thread() {
    let folder = tempfile::tempdir().unwrap();
    let registry = Arc::new(Registry::with_cores(1));
    // More time than the test waits.
    let long = options(folder.path())
        .background(true)
        .registry(Arc::clone(&registry))
        .measure(Some(Duration::from_secs(1000)));
    for pause in [0, 0, 0, 100] {
        let adaptive = start(&long);
        std::thread::sleep(Duration::from_millis(pause));
        let began = Instant::now();
        drop(adaptive);
        assert!(began.elapsed() < Duration::from_secs(10));
        assert_eq!(Arc::strong_count(&registry), 2, "ours and that of the options");
    }
    assert_eq!(count(folder.path()), 0);
}

/// A registry whose `bvh@cpu1` comes from `make`. It takes part, since the model does not know this revision of
/// `pair-cache`.
fn with_bvh(make: impl Fn() -> Result<Box<dyn BroadPhase>, Error> + Send + Sync + 'static) -> Arc<Registry> {
    let mut registry = Registry::with_cores(1);
    let tree: AlgorithmId = "bvh@cpu1".parse().unwrap();
    let revision = registry.entries().iter().find(|e| e.id == tree).unwrap().revision;
    registry.add(tree, revision, make);
    let pair_cache: AlgorithmId = "pair-cache@cpu1".parse().unwrap();
    registry.add(pair_cache.clone(), u32::MAX, move || Registry::with_cores(1).create(&pair_cache));
    Arc::new(registry)
}

#[test]
fn a_panic_in_the_background_is_a_remark() {
    let folder = tempfile::tempdir().unwrap();
    let registry = with_bvh(|| panic!("as the test wants"));
    let mut adaptive = start(&options(folder.path()).background(true).registry(registry));
    frames_until_it_came(&mut adaptive);
    assert_eq!((origin(&adaptive), adaptive.tuning().source), (Origin::Usual, Source::Default));
    assert!(matches!(&adaptive.setup().remarks[..], [why] if why.contains("panicked")), "{:?}", adaptive.setup());
    frame(&mut adaptive, &boxes(5000));
    assert!(!adaptive.save().unwrap());
}

#[test]
fn the_background_makes_the_algorithms_once() {
    static MADE: AtomicUsize = AtomicUsize::new(0);
    let folder = tempfile::tempdir().unwrap();
    let caller = std::thread::current().id();
    let registry = with_bvh(move || {
        assert_ne!(std::thread::current().id(), caller);
        MADE.fetch_add(1, Relaxed);
        Registry::with_cores(1).create(&"bvh@cpu1".parse().unwrap())
    });
    let mut adaptive = start(&options(folder.path()).background(true).registry(registry));
    frames_until_it_came(&mut adaptive);
    assert_eq!((origin(&adaptive), MADE.load(Relaxed)), (Origin::Probed, 1), "{:?}", adaptive.setup());
}

/// Starts as most programs do, except for the folder and the time.
#[test]
fn a_program_without_a_registry_gets_our_algorithms() {
    let folder = tempfile::tempdir().unwrap();
    let options = StartOptions::new().cache(Some(folder.path().to_owned())).measure(Some(Duration::ZERO));
    let mut adaptive = start(&options);
    frames_until_it_came(&mut adaptive);
    assert_eq!(origin(&adaptive), Origin::Probed, "{:?}", adaptive.setup());
    let known: Vec<String> = adaptive.tuning().algorithms().iter().map(ToString::to_string).collect();
    for id in ["brute@cpu1", "pair-cache@cpu1"] {
        assert!(known.iter().any(|k| k == id), "{known:?}");
    }
}

/// The program's pool and its GPU in one registry: measured, predicted, run and kept.
#[cfg(feature = "gpu")]
#[test]
fn a_program_brings_its_pool_and_its_gpu() {
    use sapwise::rayon1 as rayon;
    use sapwise_gpu::{Gpus, wgpu30 as wgpu};
    let Some(gpus) = common::gpus() else { return };
    let folder = tempfile::tempdir().unwrap();
    let own = common::programs_own(&gpus, 0, &wgpu::DeviceDescriptor::default());
    let mut registry = common::with_gpus(&Gpus::of([own]));
    registry.use_pool(Arc::new(rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap()));
    let options = options(folder.path()).background(true).registry(Arc::new(registry));
    let mut first = start(&options);
    frames_until_it_came(&mut first);
    assert_eq!(origin(&first), Origin::Probed);
    frame(&mut first, &boxes(1000));
    // Under the load of other tests a sample may be an impossible value; then a remark says that the next start
    // measures again.
    let known: Vec<String> = first.tuning().algorithms().iter().map(ToString::to_string).collect();
    let predicted = ["brute@gpu0", "sap@gpu0", "grid-sap@gpu0"].iter().all(|id| known.iter().any(|k| k == id));
    let told = first.setup().remarks.iter().any(|r| r.contains("gpu0") && r.contains("measures again"));
    assert!(predicted != told, "{known:?}: {:?}", first.setup());
    if predicted {
        let mut second = start(&options);
        frames_until_it_came(&mut second);
        assert_eq!((origin(&second), second.tuning()), (Origin::Cached, first.tuning()));
        frame(&mut second, &boxes(1000));
    }
}

/// Runs a test of this file in a process with this variable.
fn process(test: &str, variable: &str, value: &Path) {
    let mut command = std::process::Command::new(std::env::current_exe().unwrap());
    let ended = command.args(["--exact", test, "--ignored"]).env_remove("XDG_CACHE_HOME").env(variable, value).output();
    let ended = ended.unwrap();
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stdout));
}

#[test]
#[ignore = "a process that exit_during_the_start_is_clean starts"]
fn a_process_that_ends_at_once() {
    let folder = std::env::var_os("SAPWISE_TEST_FOLDER").unwrap();
    let mut adaptive = start(&options(Path::new(&folder)).background(true).measure(Some(Duration::from_secs(1000))));
    frame(&mut adaptive, &boxes(100));
    std::process::exit(0);
}

#[test]
fn exit_during_the_start_is_clean() {
    let folder = tempfile::tempdir().unwrap();
    process("a_process_that_ends_at_once", "SAPWISE_TEST_FOLDER", folder.path());
    assert_eq!(origin(&start(&options(folder.path()))), Origin::Probed);
}

#[cfg(target_os = "linux")]
#[test]
#[ignore = "a process that the_default_cache_is_the_users_folder starts"]
fn a_process_of_the_user() {
    let options = StartOptions::new().background(false).measure(Some(Duration::ZERO));
    let adaptive = start(&options.registry(Arc::new(Registry::with_cores(1))));
    let setup = adaptive.setup();
    let file = setup.file.clone().unwrap();
    match std::env::var_os("XDG_CACHE_HOME") {
        Some(folder) => assert_eq!(file.parent().unwrap(), Path::new(&folder).join("sapwise")),
        None => assert!(setup.remarks.iter().any(|r| r.contains("/dev/null/.cache/sapwise")), "{setup:?}"),
    }
}

#[cfg(target_os = "linux")]
#[test]
fn the_default_cache_is_the_users_folder() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("missing");
    process("a_process_of_the_user", "XDG_CACHE_HOME", &missing);
    assert_eq!(count(&missing.join("sapwise")), 1);
    // A home that is no folder.
    process("a_process_of_the_user", "HOME", Path::new("/dev/null"));
}

#[test]
fn a_given_tuning_has_no_start() {
    let registry = Registry::with_cores(1);
    let adaptive = Adaptive::new(Tuning::usual(&registry), &registry).unwrap();
    assert_eq!(adaptive.setup(), &Setup::default());
    assert!(adaptive.save().unwrap_err().to_string().contains("no cache file"));
}
