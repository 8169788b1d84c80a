//! Benchmarks and an example only; nothing here is a library.
