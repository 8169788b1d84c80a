//! The functions of the load that the parts of a belief consist of.

use super::CURVE;
use crate::cost::{Frame, Places};
use std::sync::Arc;

/// What keeps the basis of places that lie near each other solvable.
const JITTER: f64 = 1e-6;

/// A load as parts see it: the values of the functions that they consist of.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct View {
    whatever_moves: [f64; CURVE],
    by_motion: [f64; CURVE],
}

/// Orthonormal functions of the load: the likenesses to the first places, times the inverse of the root of their
/// covariance.
#[derive(Debug, Clone)]
pub(super) struct Basis {
    pub(super) places: Arc<Places>,
    pub(super) count: usize,
    /// Lower triangles, for loads whatever moves and by motion.
    roots: [[[f64; CURVE]; CURVE]; 2],
}

impl Basis {
    pub(super) fn new(places: Arc<Places>) -> Self {
        let count = places.loads().len().min(CURVE);
        let mut roots = [[[0.0; CURVE]; CURVE]; 2];
        for (root, by_motion) in roots.iter_mut().zip([false, true]) {
            let rows: Vec<Vec<f64>> = places.loads()[..count].iter().map(|l| places.likeness(l, by_motion)).collect();
            for i in 0..count {
                for j in 0..=i {
                    let sum: f64 = (0..j).map(|k| root[i][k] * root[j][k]).sum();
                    root[i][j] = if i == j {
                        (rows[i][i] + JITTER - sum).max(JITTER).sqrt()
                    } else {
                        (rows[i][j] - sum) / root[j][j]
                    };
                }
            }
        }
        Self { places, count, roots }
    }

    pub(super) fn view(&self, frame: &Frame<'_>) -> View {
        frame.likeness(&self.places, |likeness| {
            let solved = |by_motion: bool| {
                let (root, likeness) = (&self.roots[usize::from(by_motion)], likeness.of(by_motion));
                let mut values = [0.0; CURVE];
                for i in 0..self.count {
                    let sum: f64 = (0..i).map(|j| root[i][j] * values[j]).sum();
                    values[i] = (likeness[i] - sum) / root[i][i];
                }
                values
            };
            View { whatever_moves: solved(false), by_motion: solved(true) }
        })
    }

    /// Weights of the likenesses that make the same function as these of the basis.
    pub(super) fn weights(&self, of_basis: &[f64; CURVE], by_motion: bool) -> [f64; CURVE] {
        let root = &self.roots[usize::from(by_motion)];
        let mut weights = [0.0; CURVE];
        for i in (0..self.count).rev() {
            let sum: f64 = (i + 1..self.count).map(|j| root[j][i] * weights[j]).sum();
            weights[i] = (of_basis[i] - sum) / root[i][i];
        }
        weights
    }
}

impl View {
    pub(super) fn of(&self, by_motion: bool) -> &[f64; CURVE] {
        if by_motion { &self.by_motion } else { &self.whatever_moves }
    }

    /// This and a share of another, for a mean.
    pub(crate) fn add(&mut self, other: &Self, share: f64) {
        let both = self.whatever_moves.iter_mut().chain(&mut self.by_motion);
        both.zip(other.whatever_moves.iter().chain(&other.by_motion)).for_each(|(a, b)| *a += share * b);
    }
}
