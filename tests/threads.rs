//! What an engine may share between its threads.

use sapwise::{Adaptive, BroadPhase, Changes, Error, Load, Model, Pairs, Registry, Tuning};

/// Compiles where all of these may be sent to another thread and looked at from several.
#[test]
fn what_an_engine_holds_is_send_and_sync() {
    fn both<T: Send + Sync + ?Sized>() {}
    both::<Adaptive>();
    both::<dyn BroadPhase>();
    both::<Registry>();
    both::<Pairs>();
    both::<Changes>();
    both::<Tuning>();
    both::<Model>();
    both::<Load>();
    both::<Error>();
}
