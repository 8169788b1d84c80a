//! Notes that say the same of several reports, as one.

/// The notes without repetition. Those that begin with the name of a file and go on alike become one that names all of the files, and
/// those that differ in numbers alone become one with the range of each number. In the order of the first of each.
pub fn folded(notes: Vec<String>) -> Vec<String> {
    let mut kinds: Vec<Kind> = Vec::new();
    for note in notes {
        let (file, rest) = split(&note);
        let words: Vec<Word> = rest.split(' ').map(Word::of).collect();
        match kinds.iter_mut().find(|kind| kind.matches(file.is_some(), &words)) {
            Some(kind) => kind.take(file, &words),
            None => kinds.push(Kind { files: file.into_iter().map(str::to_owned).collect(), words }),
        }
    }
    kinds.iter().map(Kind::text).collect()
}

/// The name of the file that a note begins with, and what it goes on with.
fn split(note: &str) -> (Option<&str>, &str) {
    let first = note.split_once(' ').filter(|(word, _)| word.trim_end_matches(':').ends_with(".json"));
    first.map_or((None, note), |(word, rest)| (Some(word), rest))
}

struct Kind {
    /// Without repetition; empty where notes begin with none.
    files: Vec<String>,
    words: Vec<Word>,
}

#[derive(Debug)]
enum Word {
    Text(String),
    /// A number, or the least and the largest of several.
    Number(u64, u64),
}

impl Word {
    fn of(word: &str) -> Self {
        word.parse().map_or_else(|_| Self::Text(word.to_owned()), |number| Self::Number(number, number))
    }

    fn is_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Text(a), Self::Text(b)) => a == b,
            (Self::Number(..), Self::Number(..)) => true,
            _ => false,
        }
    }
}

impl Kind {
    fn matches(&self, with_file: bool, words: &[Word]) -> bool {
        let alike = |(a, b): (&Word, &Word)| a.is_like(b);
        self.files.is_empty() != with_file && self.words.len() == words.len() && self.words.iter().zip(words).all(alike)
    }

    fn take(&mut self, file: Option<&str>, words: &[Word]) {
        self.files.extend(file.filter(|f| !self.files.iter().any(|known| known == f)).map(str::to_owned));
        for (own, word) in self.words.iter_mut().zip(words) {
            if let (Word::Number(least, largest), Word::Number(low, high)) = (own, word) {
                (*least, *largest) = (*low.min(least), *high.max(largest));
            }
        }
    }

    fn text(&self) -> String {
        let words = self.words.iter().map(|word| match word {
            Word::Text(text) => text.clone(),
            Word::Number(least, largest) if least == largest => least.to_string(),
            Word::Number(least, largest) => format!("{least} to {largest}"),
        });
        let rest = words.collect::<Vec<_>>().join(" ");
        match &self.files[..] {
            [] => rest,
            [file] => format!("{file} {rest}"),
            files => format!("{}: each {rest}", files.join(", ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(notes: &[&str]) -> Vec<String> {
        folded(notes.iter().map(|n| (*n).to_owned()).collect())
    }

    #[test]
    fn alike_notes_become_one_and_others_stay_as_they_are() {
        let stays = ["nothing is validated: there is one report only", "a.json is left out: it is simulated"];
        assert_eq!(told(&stays), stays);
        let files =
            ["a.json is left out: it is old", "one", "b.json is left out: it is old", "c.json is left out: it is new"];
        assert_eq!(
            told(&files),
            ["a.json, b.json: each is left out: it is old", "one", "c.json is left out: it is new"]
        );
        let many: Vec<String> = (0..5).map(|k| format!("{k}.json is left out: it is old")).collect();
        assert_eq!(folded(many), ["0.json, 1.json, 2.json, 3.json, 4.json: each is left out: it is old"]);
    }

    #[test]
    fn numbers_become_ranges() {
        let crossovers = |a: u32, b: u32| format!("direct regression: {a} of {b} crossovers are means");
        assert_eq!(
            folded(vec![crossovers(3, 28), crossovers(12, 79), crossovers(3, 28), crossovers(4, 45)]),
            ["direct regression: 3 to 12 of 28 to 79 crossovers are means"]
        );
        // A number within a word names something.
        assert_eq!(told(&["sap@cpu1 is slow", "sap@cpu2 is slow", "sap@cpu1 is slow"]).len(), 2);
    }
}
