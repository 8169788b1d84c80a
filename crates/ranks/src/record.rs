//! The record that every rank sends to every other at the beginning of a frame.

use crate::error::Error;
use sapwise::error::BoxDefect;

/// Words of a record.
pub(crate) const WORDS: usize = 8;

/// The record of a rank.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct RankRecord {
    /// Boxes that it sends to the receiver of this record.
    pub(crate) sends: u64,
    /// Its boxes.
    pub(crate) boxes: u64,
    /// Its ids.
    pub(crate) ids: u64,
    /// Its first invalid box, and the defect.
    pub(crate) defect: Option<(u64, BoxDefect)>,
    /// Boxes of its last searches, received ones included: the median; 0 if unknown.
    pub(crate) searched: u64,
    /// Nanoseconds of these searches: the median; 0 if unknown.
    pub(crate) search_ns: u64,
    /// Nanoseconds of the last cut.
    pub(crate) cut_ns: u64,
    /// Whether its list is mirrored.
    pub(crate) mirrored: bool,
    /// Whether its list has a limit.
    pub(crate) limited: bool,
}

impl RankRecord {
    /// A record of boxes, and of searched boxes with their time.
    pub(crate) fn timed(boxes: u64, searched: u64, search_ns: u64) -> Self {
        Self { boxes, ids: boxes, searched, search_ns, ..Self::default() }
    }

    pub(crate) fn words(&self) -> [u64; WORDS] {
        let defect = self.defect.map_or(0, |(index, what)| 1 + 2 * index + u64::from(what == BoxDefect::Inverted));
        let flags = u64::from(self.mirrored) | u64::from(self.limited) << 1;
        [self.sends, self.boxes, self.ids, defect, self.searched, self.search_ns, self.cut_ns, flags]
    }

    pub(crate) fn of(words: &[u64]) -> Self {
        let &[sends, boxes, ids, defect, searched, search_ns, cut_ns, flags] = words else { return Self::default() };
        let defect = defect.checked_sub(1).map(|d| {
            let what = if d % 2 == 1 { BoxDefect::Inverted } else { BoxDefect::NotANumber };
            (d / 2, what)
        });
        let (mirrored, limited) = (flags & 1 != 0, flags & 2 != 0);
        Self { sends, boxes, ids, defect, searched, search_ns, cut_ns, mirrored, limited }
    }

    /// The error of the lowest rank with invalid input.
    pub(crate) fn error(records: &[Self]) -> Option<Error> {
        let of = |(rank, record): (usize, &Self)| {
            if record.ids != record.boxes {
                return Some(Error::MissingIds { rank, boxes: record.boxes, ids: record.ids });
            }
            record.defect.map(|(index, defect)| Error::InvalidBox { rank, index, defect })
        };
        records.iter().enumerate().find_map(of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_survive_as_words_and_the_lowest_rank_has_the_error() {
        let good = RankRecord { sends: 3, boxes: 5, ids: 5, cut_ns: 7, mirrored: true, ..RankRecord::default() };
        let bad = |index, what| RankRecord { defect: Some((index, what)), limited: true, ..good };
        for record in [good, bad(0, BoxDefect::NotANumber), bad(9, BoxDefect::Inverted), RankRecord::timed(1, 2, 3)] {
            assert_eq!(RankRecord::of(&record.words()), record);
        }
        assert_eq!(RankRecord::error(&[good; 3]), None);
        let records = [good, bad(4, BoxDefect::Inverted), bad(0, BoxDefect::NotANumber)];
        let wanted = Error::InvalidBox { rank: 1, index: 4, defect: BoxDefect::Inverted };
        assert_eq!(RankRecord::error(&records), Some(wanted));
        let short = RankRecord { ids: 4, ..good };
        assert_eq!(RankRecord::error(&[good, short]), Some(Error::MissingIds { rank: 1, boxes: 5, ids: 4 }));
    }
}
