//! Names for the places of a page.

use std::collections::HashSet;

/// The names that are taken.
#[derive(Debug, Default)]
pub(super) struct Ids {
    taken: HashSet<String>,
}

impl Ids {
    /// The name that comes closest to the wanted one: a link that ends with it leads to one place only, and needs no escapes.
    pub(super) fn take(&mut self, wanted: &str) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '-' };
        let mut base: String = wanted.chars().map(plain).collect();
        if base.is_empty() {
            base.push('-');
        }
        let mut name = base.clone();
        let mut number = 2;
        while !self.taken.insert(name.clone()) {
            name = format!("{base}-{number}");
            number += 1;
        }
        name
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_taken_once_and_is_plain() {
        let mut ids = Ids::default();
        let names = ["a", "a", "a-2", "a b\"<é", "", ""].map(|wanted| ids.take(wanted));
        assert_eq!(names, ["a", "a-2", "a-2-2", "a-b---", "-", "--2"]);
    }
}
