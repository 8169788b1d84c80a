//! Codes of cells: interleaved numbers, and Hilbert's curve.

/// Puts two zeros between any two of the lower ten bits.
#[inline]
pub(super) fn spread3(v: u32) -> u32 {
    let v = (v | v << 16) & 0x0300_00ff;
    let v = (v | v << 8) & 0x0300_f00f;
    let v = (v | v << 4) & 0x030c_30c3;
    (v | v << 2) & 0x0924_9249
}

/// Puts a zero between any two of the lower 16 bits.
#[inline]
pub(super) fn spread2(v: u32) -> u32 {
    let v = (v | v << 8) & 0x00ff_00ff;
    let v = (v | v << 4) & 0x0f0f_0f0f;
    let v = (v | v << 2) & 0x3333_3333;
    (v | v << 1) & 0x5555_5555
}

/// States of Hilbert's curve in space: 8 corners at which it enters a cube times 3 directions in which it crosses it.
const STATES: usize = 24;
/// Octants of octants of octants: the curve is looked up in three steps at once.
const LOOKED_UP: usize = 512;

/// For each state and the three steps of a Morton code: the three steps of the Hilbert code, and the next state above.
static HILBERT: [u16; STATES * LOOKED_UP] = {
    let mut table = [0; STATES * LOOKED_UP];
    let mut at = 0;
    while at < table.len() {
        let (mut state, mut code, mut shift) = (at / LOOKED_UP, 0, 9);
        while shift > 0 {
            shift -= 3;
            let (rank, next) = hilbert_step(state, at >> shift & 7);
            (code, state) = (code << 3 | rank, next);
        }
        table[at] = (state << 9 | code) as u16;
        at += 1;
    }
    table
};

/// Returns the rank of an octant on Hilbert's curve through a cube in this state, and the state in the octant.
///
/// After Hamilton, Compact Hilbert Indices (Dalhousie University, CS-2006-07): a state is three times the entry corner
/// plus the direction.
const fn hilbert_step(state: usize, octant: usize) -> (usize, usize) {
    const fn rotated(corner: usize, by: usize) -> usize {
        (corner << (by % 3) | corner >> (3 - by % 3)) & 7
    }
    let (entry, direction) = (state / 3, state % 3);
    let gray = rotated(octant ^ entry, 2 - direction);
    let rank = gray ^ gray >> 1 ^ gray >> 2;
    if rank == 0 {
        return (rank, entry * 3 + (direction + 1) % 3);
    }
    let even = (rank - 1) & !1;
    let turn =
        if rank.is_multiple_of(2) { (!(rank - 1)).trailing_zeros() } else { (!rank).trailing_zeros() } as usize % 3;
    (rank, (entry ^ rotated(even ^ even >> 1, direction + 1)) * 3 + (direction + 1 + turn) % 3)
}

/// Returns the number on Hilbert's curve of a cell with this Morton code.
#[inline]
pub(super) fn hilbert(morton: u32) -> u32 {
    let (mut code, mut state) = (0, 0);
    for shift in [18, 9, 0] {
        let entry = u32::from(HILBERT[(state << 9 | morton >> shift & 511) as usize]);
        code = code << 9 | entry & 511;
        state = entry >> 9;
    }
    code
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hilbert_steps_to_a_neighbour() {
        let mut cells: Vec<(u32, [u32; 3])> = (0..1 << 15)
            .map(|k| [k & 31, k >> 5 & 31, k >> 10])
            .map(|c| (hilbert(spread3(c[0]) | spread3(c[1]) << 1 | spread3(c[2]) << 2), c))
            .collect();
        cells.sort_unstable();
        for (k, two) in cells.windows(2).enumerate() {
            let apart: u32 = (0..3).map(|a| two[0].1[a].abs_diff(two[1].1[a])).sum();
            assert_eq!((two[0].0, apart), (k as u32, 1));
        }
    }
}
