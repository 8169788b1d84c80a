//! Times avian's broad phase and that of a space, step by step in turn: `tools/avian.sh bench`.
//!
//!     compare [SHARE [STEPS]]     a SHARE-th of the bodies [default: 1], for STEPS steps [default: 600]

mod scenes;

use avian3d::collider_tree::ColliderTreeDiagnostics;
use avian3d::collision::CollisionDiagnostics;
use avian3d::prelude::*;
use bevy::prelude::*;
use sapwise_avian::SapwiseBroadPhasePlugin;
use scenes::scenes;
use std::time::{Duration, Instant};

/// When a step began, and how long it took.
#[derive(Resource)]
struct Step(Instant, Duration);

/// Times the steps of avian alone, without the rest of an update.
fn time_steps(app: &mut App) {
    let begin = |mut step: ResMut<Step>| step.0 = Instant::now();
    let end = |mut step: ResMut<Step>| step.1 = step.0.elapsed();
    let systems = (begin.before(PhysicsStepSystems::First), end.after(PhysicsStepSystems::Last));
    app.insert_resource(Step(Instant::now(), Duration::ZERO)).add_systems(PhysicsSchedule, systems);
}

/// The times of the steps of one app.
#[derive(Default)]
struct Times {
    broad_phase: Vec<Duration>,
    trees: Vec<Duration>,
    step: Vec<Duration>,
}

impl Times {
    fn note(&mut self, app: &mut App) {
        app.update();
        let world = app.world();
        let trees = world.resource::<ColliderTreeDiagnostics>();
        self.broad_phase.push(world.resource::<CollisionDiagnostics>().broad_phase);
        self.trees.push(trees.update + trees.optimize);
        self.step.push(world.resource::<Step>().1);
    }
}

/// Returns what `part` of a hundred of these times do not exceed, in milliseconds.
fn quantile(times: &mut [Duration], part: usize) -> f64 {
    times.sort_unstable();
    times[(times.len() * part / 100).min(times.len() - 1)].as_secs_f64() * 1e3
}

fn main() {
    let mut numbers = std::env::args().skip(1).map(|word| word.parse().expect("SHARE and STEPS are numbers"));
    let (share, steps) = (numbers.next().unwrap_or(1), numbers.next().unwrap_or(600));
    println!(
        "scene,bodies,steps,broad_phase,broad_phase_median_ms,broad_phase_p99_ms,trees_median_ms,trees_p99_ms,\
         step_median_ms,step_p99_ms"
    );
    for scene in scenes(share) {
        let physics = || PhysicsPlugins::default().build().add(time_steps);
        let other = physics().disable::<BvhBroadPhasePlugin>();
        let mut apps = [scene.app(physics()), scene.app(other.add(SapwiseBroadPhasePlugin::<()>::default()))];
        let mut times = [Times::default(), Times::default()];
        for step in 0..steps {
            // Neither always comes first.
            for k in [step % 2, 1 - step % 2] {
                times[k].note(&mut apps[k]);
            }
        }
        for (name, (app, times)) in ["avian", "sapwise"].into_iter().zip(apps.iter_mut().zip(&mut times)) {
            let bodies = app.world_mut().query::<&RigidBody>().iter(app.world()).count();
            print!("{},{bodies},{steps},{name}", scene.name);
            for times in [&mut times.broad_phase, &mut times.trees, &mut times.step] {
                print!(",{:.4},{:.4}", quantile(times, 50), quantile(times, 99));
            }
            println!();
        }
    }
}
