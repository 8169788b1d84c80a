//! Who goes first.

/// Random orders from a seed, so that no algorithm always follows the same one through the caches.
#[derive(Debug)]
pub(crate) struct Turns(u64);

impl Turns {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// An order of `0..count`.
    pub(crate) fn order(&mut self, count: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..count).collect();
        for k in (1..count).rev() {
            order.swap(k, (self.next() % (k as u64 + 1)) as usize);
        }
        order
    }

    /// splitmix64 (Steele, Lea, Flood 2014).
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_turn_comes_once_and_orders_differ() {
        let mut turns = Turns::new(1);
        let orders: Vec<Vec<usize>> = (0..20).map(|_| turns.order(6)).collect();
        for order in &orders {
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, [0, 1, 2, 3, 4, 5]);
        }
        assert!(orders.iter().any(|o| *o != orders[0]));
    }
}
