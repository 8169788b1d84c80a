//! Events for switches.

use sapwise::tuning::Step;
use sapwise::{Aabb, Adaptive, BroadPhase, Pairs, Registry, Tuning};
use std::fmt;
use std::sync::{Arc, Mutex};
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Level, Metadata, Subscriber};

/// A subscriber that stores level, target and message of every event.
#[derive(Clone, Default)]
struct Told(Arc<Mutex<Vec<(Level, String, String)>>>);

struct Message(String);

impl Visit for Message {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        if field.name() == "message" {
            self.0 = format!("{value:?}");
        }
    }
}

impl Subscriber for Told {
    fn enabled(&self, _: &Metadata<'_>) -> bool {
        true
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, event: &Event<'_>) {
        let mut message = Message(String::new());
        event.record(&mut message);
        let metadata = event.metadata();
        self.0.lock().unwrap().push((*metadata.level(), metadata.target().to_owned(), message.0));
    }

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

#[test]
fn each_switch_is_an_event_with_its_reason() {
    let step = |from_objects, id: &str| Step { from_objects, algorithm: id.parse().unwrap() };
    let tuning = Tuning::from_steps(vec![step(0, "brute@cpu1"), step(64, "sap@cpu1")]).unwrap();
    let mut adaptive = Adaptive::new(tuning, &Registry::with_cores(1)).unwrap();
    let told = Told::default();
    tracing::subscriber::with_default(told.clone(), || {
        for objects in [10, 10, 10, 200, 200] {
            let boxes: Vec<Aabb> = (0..objects).map(|k| Aabb::cube([k as f32; 3], 0.5)).collect();
            adaptive.find_pairs(&boxes, &mut Pairs::new()).unwrap();
        }
    });
    let told = told.0.lock().unwrap();
    assert!(told.iter().all(|(level, target, _)| (*level, target.as_str()) == (Level::DEBUG, "sapwise::adaptive")));
    let messages: Vec<&str> = told.iter().map(|(_, _, message)| message.as_str()).collect();
    assert_eq!(messages.len(), 2, "{messages:?}");
    assert!(messages[0].starts_with("brute@cpu1, the cheapest in the first frame"), "{messages:?}");
    assert!(messages[1].starts_with("sap@cpu1, cheaper than the one before"), "{messages:?}");
}
