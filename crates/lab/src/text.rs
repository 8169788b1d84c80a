//! Text in columns.

/// Draws rows with every column but the last padded to its widest cell, two blanks between columns.
pub fn columns(rows: &[Vec<String>]) -> String {
    let count = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |row: &Vec<String>, column: usize| row.get(column).map_or(0, |cell| cell.chars().count());
    let widths: Vec<usize> = (0..count).map(|k| rows.iter().map(|row| width(row, k)).max().unwrap_or(0)).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (cell, &width) in row.iter().zip(&widths) {
            line.push_str(&format!("{cell:width$}  "));
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

/// Returns each of some values once, in the order of the first.
pub fn once<T: PartialEq>(values: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut known = Vec::new();
    for value in values {
        position_or_push(&mut known, value);
    }
    known
}

/// Returns the position of a value in a list, and adds it at the end if it is missing.
pub(crate) fn position_or_push<T: PartialEq>(list: &mut Vec<T>, value: T) -> usize {
    list.iter().position(|known| *known == value).unwrap_or_else(|| {
        list.push(value);
        list.len() - 1
    })
}

/// Writes a number of things: `1 host`, `2 hosts`.
pub fn count(number: usize, thing: &str) -> String {
    format!("{number} {thing}{}", if number == 1 { "" } else { "s" })
}

/// Writes a whole number with a blank between groups of three digits.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_aligned_without_trailing_blanks() {
        let rows = [vec!["a".to_owned(), "long".to_owned(), "x".to_owned()], vec!["bcd".to_owned(), "e".to_owned()]];
        assert_eq!(columns(&rows), "a    long  x\nbcd  e\n");
    }

    #[test]
    fn values_are_kept_once_in_the_order_of_the_first() {
        assert_eq!(once([3, 1, 3, 2, 1]), [3, 1, 2]);
    }

    #[test]
    fn one_thing_has_no_plural() {
        assert_eq!([0, 1, 2].map(|k| count(k, "repeat")), ["0 repeats", "1 repeat", "2 repeats"]);
    }

    #[test]
    fn digits_are_grouped() {
        assert_eq!(grouped(1_000_000), "1 000 000");
        assert_eq!(grouped(12), "12");
    }
}
