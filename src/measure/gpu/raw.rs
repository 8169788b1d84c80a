//! What the driver of a GPU tells and wgpu does not: processors, lanes, memory.

/// What the driver told. Empty where the GPU is not driven through Vulkan.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Raw {
    /// Multiprocessors, compute units or shader cores, and who said so.
    pub(super) processors: Option<(u32, &'static str)>,
    /// Multiply-adds that can start in one cycle on all processors, and who said so.
    pub(super) lanes: Option<(u32, &'static str)>,
    /// Lanes that run in lockstep unless a kernel asks for others, and who said so.
    pub(super) subgroup: Option<(u32, &'static str)>,
    /// Heaps of memory.
    pub(super) heaps: Vec<Heap>,
}

/// A heap of memory.
#[cfg_attr(target_vendor = "apple", allow(dead_code, reason = "Metal has no heaps to list"))]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Heap {
    pub(super) bytes: u64,
    /// Whether it is the GPU's own.
    pub(super) is_local: bool,
    /// Whether the CPU reaches what of it is the GPU's own.
    pub(super) is_visible: bool,
    /// Bytes that this process may still have of it, where the driver tells.
    pub(super) free: Option<u64>,
}

impl Raw {
    /// Bytes of the GPU's own heaps.
    pub(super) fn local_bytes(&self) -> Option<u64> {
        let bytes = self.heaps.iter().filter(|h| h.is_local).fold(0_u64, |sum, h| sum.saturating_add(h.bytes));
        (bytes > 0).then_some(bytes)
    }

    /// Bytes of the largest of the GPU's own heaps.
    pub(super) fn largest_local_bytes(&self) -> Option<u64> {
        self.heaps.iter().filter(|h| h.is_local).map(|h| h.bytes).max()
    }

    /// Bytes of the largest of them that the CPU reaches; 0 where there is none.
    pub(super) fn visible_local_bytes(&self) -> Option<u64> {
        self.largest_local_bytes()?;
        Some(self.heaps.iter().filter(|h| h.is_local && h.is_visible).map(|h| h.bytes).max().unwrap_or(0))
    }

    /// Whether the CPU reaches all of it and not a window only.
    pub(super) fn has_resizable_bar(&self) -> Option<bool> {
        Some(self.visible_local_bytes()? >= self.largest_local_bytes()?)
    }

    /// Bytes of the largest heap of the GPU that are free, or all of them where the driver does not tell.
    pub(super) fn free_bytes(&self) -> Option<u64> {
        self.heaps.iter().filter(|h| h.is_local).map(|h| h.free.unwrap_or(h.bytes).min(h.bytes)).max()
    }

    /// Whether all memory that the GPU sees is its own, as it is where it shares the CPU's.
    pub(super) fn is_unified(&self) -> Option<bool> {
        (!self.heaps.is_empty()).then(|| self.heaps.iter().all(|h| h.is_local))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GIB: u64 = 1 << 30;

    fn heap(bytes: u64, is_local: bool, free: Option<u64>) -> Heap {
        Heap { bytes, is_local, is_visible: !is_local || bytes < GIB, free }
    }

    #[test]
    fn a_card_and_its_window() {
        let heaps =
            vec![heap(8 * GIB, true, Some(6 * GIB)), heap(16 * GIB, false, None), heap(GIB / 4, true, Some(GIB / 4))];
        let raw = Raw { heaps, ..Raw::default() };
        assert_eq!(raw.local_bytes(), Some(8 * GIB + GIB / 4));
        assert_eq!(raw.free_bytes(), Some(6 * GIB));
        assert_eq!(raw.is_unified(), Some(false));
        assert_eq!((raw.largest_local_bytes(), raw.visible_local_bytes()), (Some(8 * GIB), Some(GIB / 4)));
        assert_eq!(raw.has_resizable_bar(), Some(false));
    }

    #[test]
    fn a_card_that_the_cpu_reaches_whole_and_one_that_it_does_not_reach() {
        let card = Heap { is_visible: true, ..heap(8 * GIB, true, None) };
        let raw = Raw { heaps: vec![card, heap(16 * GIB, false, None)], ..Raw::default() };
        assert_eq!((raw.visible_local_bytes(), raw.has_resizable_bar()), (Some(8 * GIB), Some(true)));
        let raw = Raw { heaps: vec![heap(8 * GIB, true, None), heap(16 * GIB, false, None)], ..Raw::default() };
        assert_eq!((raw.visible_local_bytes(), raw.has_resizable_bar()), (Some(0), Some(false)));
    }

    #[test]
    fn one_memory_and_none() {
        let raw = Raw { heaps: vec![heap(2 * GIB, true, None)], ..Raw::default() };
        assert_eq!((raw.local_bytes(), raw.free_bytes(), raw.is_unified()), (Some(2 * GIB), Some(2 * GIB), Some(true)));
        let raw = Raw::default();
        assert_eq!((raw.local_bytes(), raw.free_bytes(), raw.is_unified()), (None, None, None));
        assert_eq!((raw.largest_local_bytes(), raw.visible_local_bytes(), raw.has_resizable_bar()), (None, None, None));
    }
}
