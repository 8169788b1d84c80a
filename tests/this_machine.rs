//! The start on a machine: cache, measurement in the foreground and in the background, and frames through all of it.

#[path = "this_machine/age.rs"]
mod age;
mod common;
#[path = "this_machine/shipped.rs"]
mod shipped;

use common::{Random, naive};
use sapwise::{
    Aabb, Adaptive, AlgorithmId, BroadPhase, Cache, Error, Origin, PairOrder, Pairs, Registry, Setup, Source,
    StartOptions, Tuning,
};
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::Duration;

/// Measures as briefly as it can: what comes out is not looked at. On one core, whose figures can't be spoiled beyond belief by the other
/// tests.
fn options(folder: &Path) -> StartOptions {
    StartOptions::new()
        .background(false)
        .cache(Cache::Folder(folder.to_owned()))
        .registry(Arc::new(Registry::with_cores(1)))
        .probe_limit(Duration::ZERO)
}

fn start(options: &StartOptions) -> Adaptive {
    Adaptive::for_this_machine(options).unwrap()
}

fn origin(adaptive: &Adaptive) -> Origin {
    adaptive.setup().origin
}

/// The files of the cache, without the one that is locked while a process measures.
fn names(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    names.filter(|name| name != ".sapwise.lock").collect()
}

/// Runs a frame and holds it against the oracle.
fn frame(adaptive: &mut Adaptive, boxes: &[Aabb]) {
    let mut pairs = Pairs::with_order(PairOrder::Canonical);
    adaptive.find_pairs(boxes, &mut pairs).unwrap();
    assert!(pairs.as_slice() == naive(boxes));
}

/// The same, decided on and therefore timed, many times.
fn learn(adaptive: &mut Adaptive, boxes: &[Aabb]) {
    for _ in 0..50 {
        adaptive.decide(boxes);
        frame(adaptive, boxes);
    }
}

fn boxes(count: usize) -> Vec<Aabb> {
    Random(7).cubes(count, [20.0; 3], 0.6)
}

/// Runs frames until the background has brought something; how many.
fn frames_until_it_came(adaptive: &mut Adaptive) -> usize {
    let boxes = boxes(300);
    let mut frames = 0;
    while origin(adaptive) == Origin::Awaited {
        frame(adaptive, &boxes);
        frames += 1;
    }
    frame(adaptive, &boxes);
    frames
}

#[test]
fn the_second_start_takes_what_the_first_has_kept() {
    let folder = tempfile::tempdir().unwrap();
    let mut first = start(&options(folder.path()));
    assert_eq!(first.setup().remarks, [""; 0]);
    assert_eq!((origin(&first), first.tuning().source), (Origin::Probed, Source::Predicted));
    assert_eq!(first.tuning().defect(), None);
    frame(&mut first, &boxes(500));
    let file = first.setup().file.clone().unwrap();
    assert_eq!(names(folder.path()), [file.file_name().unwrap().to_str().unwrap()]);
    let mut second = start(&options(folder.path()));
    assert_eq!(origin(&second), Origin::Cached);
    assert_eq!(second.tuning(), first.tuning());
    assert!(second.setup().remarks.is_empty() && second.setup().file == Some(file));
    frame(&mut second, &boxes(500));
    // Other algorithms have another tuning, in a file of their own.
    let mut more = Registry::with_cores(1);
    more.add("mine@cpu1".parse().unwrap(), 1, || Registry::with_cores(1).create(&"brute@cpu1".parse().unwrap()));
    let other = options(folder.path()).registry(Arc::new(more));
    assert_eq!(origin(&start(&other)), Origin::Probed);
    assert_eq!(origin(&start(&other)), Origin::Cached);
    assert_eq!(names(folder.path()).len(), 2);
}

#[test]
fn a_start_that_may_not_measure_takes_what_is_kept_and_else_the_usual_tuning() {
    let folder = tempfile::tempdir().unwrap();
    for background in [false, true] {
        let unmeasured =
            options(folder.path()).measure(false).background(background).wait_at_most(Duration::from_secs(60));
        let mut adaptive = start(&unmeasured);
        assert_eq!((origin(&adaptive), adaptive.tuning().source), (Origin::Usual, Source::Default));
        assert!(matches!(&adaptive.setup().remarks[..], [why] if why.contains("was not to be measured")));
        assert!(names(folder.path()).is_empty());
        frame(&mut adaptive, &boxes(300));
    }
    let measured = start(&options(folder.path()));
    let kept = start(&options(folder.path()).measure(false));
    assert_eq!((origin(&kept), kept.tuning(), &kept.setup().remarks[..]), (Origin::Cached, measured.tuning(), &[][..]));
}

#[test]
fn what_was_learned_is_there_at_the_next_start() {
    let folder = tempfile::tempdir().unwrap();
    let mut first = start(&options(folder.path()));
    let boxes = boxes(400);
    learn(&mut first, &boxes);
    let learned = first.learned();
    assert_eq!(learned.source, Source::Learned);
    first.save().unwrap();
    let second = start(&options(folder.path()));
    assert_eq!((origin(&second), second.tuning()), (Origin::Cached, &learned));
    let mut third = start(&options(folder.path()).learning(false));
    learn(&mut third, &boxes);
    assert_eq!(third.learned(), learned);
}

#[test]
fn a_damaged_file_is_told_replaced_and_harmless() {
    let folder = tempfile::tempdir().unwrap();
    let file = start(&options(folder.path())).setup().file.clone().unwrap();
    let whole = fs::read_to_string(&file).unwrap();
    for text in ["", "{}", &whole[..whole.len() / 2], &whole.replace("cache/4", "cache/1")] {
        fs::write(&file, text).unwrap();
        let mut again = start(&options(folder.path()));
        assert_eq!(origin(&again), Origin::Probed);
        assert!(
            again.setup().remarks.len() == 1 && again.setup().remarks[0].contains("is ignored"),
            "{:?}",
            again.setup()
        );
        frame(&mut again, &boxes(200));
        assert_eq!(origin(&start(&options(folder.path()))), Origin::Cached);
    }
}

#[test]
fn no_cache_a_folder_in_its_place_and_a_file_in_the_folders_place_keep_nothing_from_working() {
    let folder = tempfile::tempdir().unwrap();
    let works = |options: &StartOptions, remarks: &[&str]| {
        let mut adaptive = start(options);
        assert_eq!(origin(&adaptive), Origin::Probed);
        let told = &adaptive.setup().remarks;
        assert!(told.len() == remarks.len() && remarks.iter().zip(told).all(|(r, t)| t.contains(r)), "{told:?}");
        frame(&mut adaptive, &boxes(200));
        adaptive
    };
    let none = works(&options(folder.path()).cache(Cache::None), &[]);
    assert!(none.save().unwrap_err().to_string().contains("no cache"));
    let file = start(&options(folder.path())).setup().file.clone().unwrap();
    fs::remove_file(&file).unwrap();
    fs::create_dir_all(file.join("inside")).unwrap();
    let blocked = works(&options(folder.path()), &["is ignored", "can't be written"]);
    assert!(blocked.save().unwrap_err().to_string().contains("can't be written"));
    // Where the folder should be there is a file: it can neither be read nor made. So it is on a disk that can't be written.
    let occupied = folder.path().join("occupied");
    fs::write(&occupied, "").unwrap();
    works(&options(&occupied.join("cache")), &["is ignored", "can't be written"]);
}

#[cfg(unix)]
#[test]
fn a_folder_without_write_permission_keeps_nothing_from_working() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    fs::set_permissions(folder.path(), PermissionsExt::from_mode(0o555)).unwrap();
    let mut adaptive = start(&options(folder.path()));
    frame(&mut adaptive, &boxes(200));
    // A superuser may write anyway.
    let refused = fs::File::create(folder.path().join("try")).is_err();
    assert_eq!(adaptive.save().is_err(), refused);
    assert_eq!(adaptive.setup().remarks.len(), usize::from(refused));
    fs::set_permissions(folder.path(), PermissionsExt::from_mode(0o755)).unwrap();
}

#[test]
fn starts_at_once_share_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    std::thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(|| {
                let mut adaptive = start(&options(folder.path()));
                learn(&mut adaptive, &boxes(200));
                adaptive.save().unwrap();
            });
        }
    });
    let after = start(&options(folder.path()));
    assert_eq!((origin(&after), after.tuning().source), (Origin::Cached, Source::Learned));
    assert_eq!(names(folder.path()).len(), 1);
}

#[test]
fn the_background_takes_over_between_frames() {
    let folder = tempfile::tempdir().unwrap();
    let background = options(folder.path()).background(true).exploring(false);
    let mut first = start(&background);
    // The flag is only looked at when a frame runs.
    assert_eq!((origin(&first), first.tuning().source), (Origin::Awaited, Source::Default));
    assert!(!first.save().unwrap(), "there is nothing to keep yet");
    assert!(frames_until_it_came(&mut first) > 0);
    assert_eq!((origin(&first), first.tuning().source), (Origin::Probed, Source::Predicted));
    assert!(first.setup().remarks.is_empty() && first.setup().seconds > 0.0, "{:?}", first.setup());
    assert!(first.last_decision().unwrap().predicted_ns.is_some());
    assert!(first.save().unwrap());
    let mut second = start(&background);
    assert_eq!(origin(&second), Origin::Awaited);
    frames_until_it_came(&mut second);
    assert_eq!(origin(&second), Origin::Cached);
    // A decision without a frame takes over too.
    let mut third = start(&background);
    while origin(&third) == Origin::Awaited {
        assert!(third.decide(&boxes(100)).is_some());
    }
    frame(&mut third, &boxes(100));
    assert_eq!(origin(&third), Origin::Cached);
}

#[test]
fn switches_outlast_the_background() {
    let folder = tempfile::tempdir().unwrap();
    let mut adaptive = start(&options(folder.path()).background(true));
    adaptive.set_learning(false);
    frames_until_it_came(&mut adaptive);
    assert_eq!(origin(&adaptive), Origin::Probed);
    learn(&mut adaptive, &boxes(300));
    assert_eq!(adaptive.learned().source, Source::Predicted);
}

#[test]
fn the_thread_ends_with_who_waits_for_it_and_the_next_start_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let registry = Arc::new(Registry::with_cores(1));
    // So much time that it can't be done.
    let long =
        options(folder.path()).background(true).registry(Arc::clone(&registry)).probe_limit(Duration::from_secs(1000));
    let unfinished = || names(folder.path()).into_iter().find(|name| name.ends_with(".unfinished.json"));
    let waiting = start(&long);
    while unfinished().is_none() {
        std::thread::yield_now();
    }
    drop(waiting);
    // The thread lets go of the registry when it ends.
    assert_eq!(Arc::strong_count(&registry), 2, "ours and that of the options");
    // Whoever goes on has the figures of before; what they are the measurement's own tests look at.
    let text = fs::read_to_string(folder.path().join(unfinished().unwrap())).unwrap();
    assert!(text.contains("unfinished/1") && text.contains("\"usable_cores\""), "{text}");
    let mut second = start(&options(folder.path()));
    assert_eq!((origin(&second), unfinished()), (Origin::Probed, None));
    assert!(second.setup().remarks.is_empty(), "{:?}", second.setup());
    frame(&mut second, &boxes(200));
    // A thread that has hardly begun.
    for _ in 0..20 {
        drop(start(&long));
        assert_eq!(Arc::strong_count(&registry), 2);
    }
}

#[test]
fn who_waits_at_the_start_begins_with_the_tuning() {
    let folder = tempfile::tempdir().unwrap();
    let background = options(folder.path()).background(true);
    let mut patient = start(&background.clone().wait_at_most(Duration::from_secs(600)));
    assert_eq!((origin(&patient), patient.tuning().source), (Origin::Probed, Source::Predicted));
    frame(&mut patient, &boxes(200));
    let short = start(
        &background.cache(Cache::None).probe_limit(Duration::from_secs(1000)).wait_at_most(Duration::from_millis(1)),
    );
    assert_eq!(origin(&short), Origin::Awaited);
}

/// A registry whose `grid-sap@cpu1` is made by `make`.
fn with_grid_sap(make: impl Fn() -> Result<Box<dyn BroadPhase>, Error> + Send + Sync + 'static) -> Arc<Registry> {
    let mut registry = Registry::with_cores(1);
    let strips: AlgorithmId = "grid-sap@cpu1".parse().unwrap();
    let revision = registry.entries().iter().find(|e| e.id == strips).unwrap().revision;
    registry.add(strips, revision, make);
    Arc::new(registry)
}

#[test]
fn a_panic_in_the_background_is_a_remark() {
    let folder = tempfile::tempdir().unwrap();
    let registry = with_grid_sap(|| panic!("as the test wants"));
    let mut adaptive = start(&options(folder.path()).background(true).registry(registry));
    frames_until_it_came(&mut adaptive);
    assert_eq!((origin(&adaptive), adaptive.tuning().source), (Origin::Usual, Source::Default));
    assert!(
        adaptive.setup().remarks.len() == 1 && adaptive.setup().remarks[0].contains("panicked"),
        "{:?}",
        adaptive.setup()
    );
    frame(&mut adaptive, &boxes(5000));
    assert!(!adaptive.save().unwrap());
}

/// Algorithms are made once for a start, and on the thread in the background.
#[test]
fn algorithms_are_made_off_the_calling_thread() {
    static MADE: AtomicUsize = AtomicUsize::new(0);
    let folder = tempfile::tempdir().unwrap();
    let caller = std::thread::current().id();
    let registry = with_grid_sap(move || {
        assert_ne!(std::thread::current().id(), caller);
        MADE.fetch_add(1, Relaxed);
        Registry::with_cores(1).create(&"grid-sap@cpu1".parse().unwrap())
    });
    let mut adaptive = start(&options(folder.path()).background(true).registry(registry));
    frames_until_it_came(&mut adaptive);
    assert_eq!((origin(&adaptive), MADE.load(Relaxed)), (Origin::Probed, 1), "{:?}", adaptive.setup());
}

#[test]
fn a_model_that_knows_nothing_here_leaves_the_usual_tuning() {
    let folder = tempfile::tempdir().unwrap();
    let mut model = sapwise::Model::built_in().unwrap();
    model.methods.iter_mut().for_each(|m| m.revision += 1);
    for background in [false, true] {
        let mut adaptive = start(&options(folder.path()).model(model.clone()).background(background));
        frames_until_it_came(&mut adaptive);
        assert_eq!(origin(&adaptive), Origin::Usual);
        assert!(adaptive.setup().remarks[0].contains("predicts none"), "{:?}", adaptive.setup());
    }
    assert!(names(folder.path()).is_empty());
}

/// What most programs do, but for the folder and the time.
#[test]
fn a_program_that_names_no_algorithms_gets_all_of_ours() {
    let folder = tempfile::tempdir().unwrap();
    for background in [true, false] {
        let mut options = options(folder.path()).background(background);
        options.registry = None;
        let mut adaptive = start(&options);
        frames_until_it_came(&mut adaptive);
        assert!([Origin::Probed, Origin::Cached].contains(&origin(&adaptive)), "{:?}", adaptive.setup());
        let known: Vec<String> = adaptive.tuning().algorithms().iter().map(ToString::to_string).collect();
        for id in ["brute@cpu1", "sap@cpu1", "grid-sap@cpu1", "bvh@cpu1", "pair-cache@cpu1"] {
            assert!(known.iter().any(|k| k == id), "{known:?}");
        }
        frame(&mut adaptive, &boxes(1000));
    }
}

/// The program's pool and its GPU in one registry: measured, predicted, run and kept.
#[cfg(feature = "measure-gpu")]
#[test]
fn a_program_brings_its_pool_and_its_gpu() {
    use sapwise::gpu::{Gpu, Gpus, wgpu30 as wgpu};
    use sapwise::{GpuIdentity, rayon1 as rayon};
    let Some(gpus) = common::gpus() else { return };
    let folder = tempfile::tempdir().unwrap();
    let opened = gpus.adapter(0).unwrap().request_device(&wgpu::DeviceDescriptor::default());
    let (device, queue) = pollster::block_on(opened).unwrap();
    let identity = GpuIdentity::of(0, &device.adapter_info());
    let mut registry = Registry::with_cores(1);
    registry.use_pool(Arc::new(rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap()));
    registry.add_gpus(&Gpus::of([Gpu::from_parts(device, queue, identity.clone())]));
    let options = options(folder.path()).background(true).registry(Arc::new(registry));
    let mut first = start(&options);
    frames_until_it_came(&mut first);
    assert_eq!(origin(&first), Origin::Probed);
    frame(&mut first, &boxes(1000));
    // Under the load of other tests one sample may be a figure that can't be; then it is told and measured again.
    let known: Vec<String> = first.tuning().algorithms().iter().map(ToString::to_string).collect();
    let predicted = ["brute@gpu0", "sap@gpu0", "grid-sap@gpu0"].iter().all(|id| known.iter().any(|k| k == id));
    let told = first.setup().remarks.iter().any(|r| r.contains("gpu0") && r.contains("measures again"));
    assert!(predicted != told, "{known:?}: {:?}", first.setup());
    if predicted {
        let text = fs::read_to_string(first.setup().file.as_ref().unwrap()).unwrap();
        assert!(text.contains("\"given\"") && text.contains(&format!("\"name\": {:?}", identity.name)), "{text}");
        let mut second = start(&options);
        frames_until_it_came(&mut second);
        assert_eq!((origin(&second), second.tuning()), (Origin::Cached, first.tuning()));
        frame(&mut second, &boxes(1000));
    }
}

/// A process that keeps its tuning in the user's folder; with a home that is no folder it works all the same.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "a process that the_users_folder_is_shared_by_processes starts, with variables of its own"]
fn a_process_of_the_user() {
    let Some(folder) = std::env::var_os("XDG_CACHE_HOME") else {
        let mut adaptive = start(&options(Path::new("")).cache(Cache::User));
        frame(&mut adaptive, &boxes(200));
        assert_eq!(origin(&adaptive), Origin::Probed);
        let told = &adaptive.setup().remarks;
        assert!(
            told.iter().any(|r| r.contains("/dev/null/.cache/sapwise") && r.contains("can't be written")),
            "{told:?}"
        );
        return;
    };
    let mut adaptive = start(&options(Path::new("")).cache(Cache::User));
    let file = adaptive.setup().file.clone().unwrap();
    assert_eq!(file.parent().unwrap(), Path::new(&folder).join("sapwise"));
    for _ in 0..20 {
        learn(&mut adaptive, &boxes(50));
        adaptive.save().unwrap();
    }
}

#[test]
#[ignore = "a process that processes_that_start_together_measure_once starts"]
fn a_process_among_others() {
    let folder = std::env::var_os("SAPWISE_TEST_FOLDER").unwrap();
    // Measured for as long as others are waited for: however slow this machine is, nobody gives up.
    let adaptive = start(&options(Path::new(&folder)).probe_limit(Duration::from_secs(600)));
    println!("origin: {:?}", origin(&adaptive));
}

#[test]
fn processes_that_start_together_measure_once() {
    let folder = tempfile::tempdir().unwrap();
    let process = |_| {
        let mut command = std::process::Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", "a_process_among_others", "--ignored", "--nocapture"]);
        command.env("SAPWISE_TEST_FOLDER", folder.path()).stdout(std::process::Stdio::piped()).spawn().unwrap()
    };
    let processes: Vec<_> = (0..16).map(process).collect();
    let told = processes.into_iter().map(|p| String::from_utf8(p.wait_with_output().unwrap().stdout).unwrap());
    let told: Vec<String> = told.collect();
    let how_many = |origin: &str| told.iter().filter(|text| text.contains(&format!("origin: {origin}"))).count();
    assert_eq!((how_many("Probed"), how_many("Cached")), (1, 15), "{told:?}");
    assert_eq!(names(folder.path()).len(), 1);
}

/// A process that returns from `main` while the thread in the background measures.
#[test]
#[ignore = "a process that exit_during_the_start_is_clean starts"]
fn a_process_that_ends_at_once() {
    let folder = std::env::var_os("SAPWISE_TEST_FOLDER").unwrap();
    let mut adaptive = start(&options(Path::new(&folder)).background(true).probe_limit(Duration::from_secs(1000)));
    frame(&mut adaptive, &boxes(100));
    assert!(!adaptive.save().unwrap());
    if std::env::var_os("SAPWISE_TEST_EXIT").is_some() {
        std::process::exit(0);
    }
}

#[test]
fn exit_during_the_start_is_clean() {
    let folder = tempfile::tempdir().unwrap();
    for exits in [false, true] {
        let mut command = std::process::Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", "a_process_that_ends_at_once", "--ignored"]).env("SAPWISE_TEST_FOLDER", folder.path());
        if exits {
            command.env("SAPWISE_TEST_EXIT", "1");
        }
        let ended = command.output().unwrap();
        assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stdout));
    }
    // Nobody holds the lock, and what they left is no obstacle.
    assert_eq!(origin(&start(&options(folder.path()))), Origin::Probed);
}

#[cfg(target_os = "linux")]
#[test]
fn the_users_folder_is_shared_by_processes() {
    let folder = tempfile::tempdir().unwrap();
    let process = |variable: &str, value: &Path| {
        let mut command = std::process::Command::new(std::env::current_exe().unwrap());
        command
            .args(["--exact", "a_process_of_the_user", "--ignored"])
            .env_remove("XDG_CACHE_HOME")
            .env(variable, value);
        command.stdout(std::process::Stdio::null()).spawn().unwrap()
    };
    let shared = [0, 1].map(|_| process("XDG_CACHE_HOME", folder.path()));
    let homeless = process("HOME", Path::new("/dev/null"));
    for mut child in shared.into_iter().chain([homeless]) {
        assert!(child.wait().unwrap().success());
    }
    let kept = folder.path().join("sapwise");
    let after = start(&options(&kept));
    assert_eq!((origin(&after), after.tuning().source), (Origin::Cached, Source::Learned));
    assert_eq!(names(&kept).len(), 1);
}

#[test]
fn given_tuning_have_no_start_of_their_own() {
    let registry = Registry::with_cores(1);
    let adaptive = Adaptive::new(Tuning::usual(&registry), &registry).unwrap();
    assert_eq!(adaptive.setup(), &Setup::default());
    assert!(adaptive.save().unwrap_err().to_string().contains("given by the program"));
}
