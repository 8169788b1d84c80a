//! The command `sapwise` as a library, so that a program of a few lines is the whole command.

mod algorithms;
mod args;
mod boxes;
mod card;
mod check;
mod child;
mod command;
mod compare;
mod contention;
mod date;
mod destination;
mod document;
mod exit;
mod files;
mod gpus;
mod hardware;
mod interrupt;
mod output;
mod plot;
mod prediction;
mod profiles;
mod progress;
mod provenance;
mod random;
mod restriction;
mod revisions;
mod simulate;
mod simulation;
mod steadiness;
mod summary;
mod sweep;
mod table;
mod train;
mod turns;
mod verbs;

pub use command::Command;
