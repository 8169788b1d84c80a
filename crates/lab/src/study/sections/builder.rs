//! A section of the page while it is made.

use crate::page::{Block, Section};
use anyhow::Result;

/// A section that is being made. What it lacks is told on the page and at its end.
pub(super) struct SectionBuilder<'a> {
    pub(super) section: Section,
    pub(super) missing: &'a mut Vec<String>,
}

impl<'a> SectionBuilder<'a> {
    pub(super) fn new(id: &str, title: &str, missing: &'a mut Vec<String>) -> Self {
        Self { section: Section { id: id.to_owned(), title: title.to_owned(), blocks: Vec::new() }, missing }
    }

    pub(super) fn text(&mut self, text: impl Into<String>) {
        self.section.blocks.push(Block::Text(text.into()));
    }

    pub(super) fn lacks(&mut self, what: impl Into<String>) {
        let what = what.into();
        self.missing.push(format!("{}: {what}", self.section.title));
        self.section.blocks.push(Block::Missing(what));
    }

    pub(super) fn push(&mut self, block: Result<Block>) -> Result<()> {
        self.section.blocks.push(block?);
        Ok(())
    }
}
